// Shadow rays through the triangles' tree: eight-wide nodes (Ylitie, Karras & Laine 2017) of 80 bytes, five rows each. Twin
// of `Sun` in scene/shade.rs.

@group(0) @binding(5) var<storage, read> nodes: array<vec4<u32>>;
/// Three rows a triangle, in the tree's order and units: corner 0, corner 0 - corner 1, corner 2 - corner 0.
@group(0) @binding(6) var<storage, read> obstacles: array<vec4<f32>>;

struct Obstacle {
    found: bool,
    t: f32,
    slot: u32,
}

fn byte_of(low: u32, high: u32, index: u32) -> u32 {
    return (select(low, high, index >= 4u) >> (8u * (index & 3u))) & 255u;
}

/// The t at which a ray meets a triangle, or a negative number.
fn meets(slot: u32, origin: vec3<f32>, direction: vec3<f32>) -> f32 {
    let v0 = obstacles[3u * slot].xyz;
    let e1 = obstacles[3u * slot + 1u].xyz;
    let e2 = obstacles[3u * slot + 2u].xyz;
    let normal = cross(e1, e2);
    let to_corner = v0 - origin;
    let across = cross(direction, to_corner);
    let volume = dot(normal, direction);
    if volume == 0.0 {
        return -1.0;
    }
    let u = dot(across, e2) / volume;
    let v = dot(across, e1) / volume;
    if min(min(u, v), 1.0 - u - v) < -TRIANGLE_EDGE {
        return -1.0;
    }
    return dot(normal, to_corner) / volume;
}

/// The nearest triangle that a ray of unit direction meets beyond `t_min`, or `any`, in the tree's units.
fn find(origin: vec3<f32>, direction: vec3<f32>, t_min: f32, any_one: bool) -> Obstacle {
    var best = Obstacle(false, 3e38, 0u);
    let tiny = abs(direction) < vec3(1e-18);
    let inverse = 1.0 / select(direction, vec3(1e-18), tiny);
    var stack: array<u32, 96>;
    var top = 1u;
    stack[0] = 0u;
    while top > 0u {
        top -= 1u;
        let node = stack[top] * 5u;
        let head = nodes[node];
        let p = bitcast<vec3<f32>>(head.xyz);
        let extent = bitcast<vec3<f32>>(vec3(head.w & 255u, head.w >> 8u & 255u, head.w >> 16u & 255u) << vec3(23u));
        let imask = head.w >> 24u;
        let base = nodes[node + 1u];
        let x = nodes[node + 2u];
        let y = nodes[node + 3u];
        let z = nodes[node + 4u];
        let begin = (p - origin) * inverse;
        let per_step = extent * inverse;
        for (var child = 0u; child < 8u; child++) {
            let meta_bits = byte_of(base.z, base.w, child);
            if meta_bits == 0u {
                continue;
            }
            let low = vec3<f32>(vec3(byte_of(x.x, x.y, child), byte_of(y.x, y.y, child), byte_of(z.x, z.y, child)));
            let high = vec3<f32>(vec3(byte_of(x.z, x.w, child), byte_of(y.z, y.w, child), byte_of(z.z, z.w, child)));
            let a = low * per_step + begin;
            let b = high * per_step + begin;
            let near = max(max(min(a.x, b.x), min(a.y, b.y)), max(min(a.z, b.z), t_min));
            let far = min(min(max(a.x, b.x), max(a.y, b.y)), min(max(a.z, b.z), best.t));
            // Boxes are rounded outwards, but not by much.
            if near > far * 1.00001 + 1e-4 {
                continue;
            }
            if (imask >> child & 1u) != 0u {
                let slot = (meta_bits & 31u) - 24u;
                if top < 96u {
                    stack[top] = base.x + countOneBits(imask & ~(0xffffffffu << slot));
                    top += 1u;
                }
                continue;
            }
            let first = base.y + (meta_bits & 31u);
            let count = countOneBits(meta_bits & 0xe0u);
            for (var i = first; i < first + count; i++) {
                let t = meets(i, origin, direction);
                if t >= t_min && t < best.t {
                    best = Obstacle(true, t, i);
                    if any_one {
                        return best;
                    }
                }
            }
        }
    }
    return best;
}

/// Whether an obstacle belongs to the faceted surface that the point is on.
fn is_itself(point: vec3<f32>, normal: vec3<f32>, obstacle: Obstacle) -> bool {
    let v0 = obstacles[3u * obstacle.slot].xyz / look.scale;
    let ab = -obstacles[3u * obstacle.slot + 1u].xyz / look.scale;
    let ac = obstacles[3u * obstacle.slot + 2u].xyz / look.scale;
    let edge = max(length(ab), max(length(ac - ab), length(ac)));
    let across = cross(ab, ac);
    let size = length(across);
    if size == 0.0 {
        return false;
    }
    let facet = across / size;
    let bend = length(cross(facet, normal));
    let away = abs(dot(facet, point - v0));
    return dot(normal, look.to_sun) < TERMINATOR && abs(dot(facet, look.to_sun)) < TERMINATOR
        && obstacle.t / look.scale < NEIGHBORHOOD * edge
        && away < 0.75 * NEIGHBORHOOD * edge * bend + 2.0 * look.apart;
}

/// Whether the sun lights a point.
fn is_lit(point: vec3<f32>, normal: vec3<f32>) -> bool {
    let facing = dot(normal, look.to_sun);
    if facing <= 0.0 {
        return false;
    }
    if look.scale == 0.0 {
        return true;
    }
    let origin = (point + normal * look.apart) * look.scale;
    var t_min = 0.0;
    if !find(origin, look.to_sun, t_min, true).found {
        return true;
    }
    if facing >= TERMINATOR {
        return false;
    }
    for (var i = 0u; i < PASSES; i++) {
        let obstacle = find(origin, look.to_sun, t_min, false);
        if !obstacle.found {
            return true;
        }
        if !is_itself(point, normal, obstacle) {
            return false;
        }
        t_min = obstacle.t + look.apart * look.scale;
    }
    return false;
}
