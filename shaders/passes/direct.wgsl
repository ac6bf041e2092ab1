// The direct view: what the samples of a pixel show that show no mirror, added up. Twin of backend/cpu/direct.rs.

/// Colours of corners, three a triangle, as halves: of objects with colours at their vertices.
@group(0) @binding(4) var<storage, read> colors: array<vec2<u32>>;
@group(0) @binding(9) var<storage, read_write> direct: array<vec4<f32>>;

struct Met {
    weights: vec3<f32>,
    point: vec3<f32>,
}

/// Where a view ray meets a triangle; where it passes it, the nearest place.
fn met(id: u32, px: vec2<f32>) -> Met {
    let found = weights_at(id, view_ray(px));
    var w = vec3(1.0 / 3.0);
    if found.w > 0.0 {
        w = max(found.xyz, vec3(0.0));
        w = w / (w.x + w.y + w.z);
    }
    let point = corner_of(id, 0u).position * w.x + corner_of(id, 1u).position * w.y + corner_of(id, 2u).position * w.z;
    return Met(w, point);
}

fn is_odd(x: f32) -> bool {
    return x - 2.0 * floor(x * 0.5) >= 1.0;
}

fn albedo(surface: u32, id: u32, at: Met) -> vec3<f32> {
    let head = surfaces[surface * SURFACE_ROWS];
    let first = surface_row(surface, 1u);
    if head.z == CONSTANT {
        return first.xyz;
    }
    if head.z == VERTEX {
        let corner = head.w + 3u * (id - head.x);
        var sum = vec3(0.0);
        for (var i = 0u; i < 3u; i++) {
            let color = colors[corner + i];
            sum += vec3(unpack2x16float(color.x), unpack2x16float(color.y).x) * at.weights[i];
        }
        return sum;
    }
    let point = vec4(at.point, 1.0);
    let local = vec3(dot(surface_row(surface, 3u), point), dot(surface_row(surface, 4u), point), dot(surface_row(surface, 5u), point));
    let p = local / first.w + vec3(1e-4);
    var odd = is_odd(floor(p.x) + floor(p.y) + floor(p.z));
    if head.z == STRIPES {
        odd = is_odd(p.y);
    } else if head.z == RINGS {
        odd = is_odd(length(p.xz));
    }
    return select(first.xyz, surface_row(surface, 2u).xyz, odd);
}

/// What an object's reflectance is multiplied by.
fn light(id: u32, at: Met) -> vec3<f32> {
    let sum = corner_of(id, 0u).normal * at.weights.x + corner_of(id, 1u).normal * at.weights.y
        + corner_of(id, 2u).normal * at.weights.z;
    let size = length(sum);
    let normal = select(vec3(0.0, 1.0, 0.0), sum / max(size, 1e-20), size > 1e-20);
    let lit = select(0.0, max(dot(normal, look.to_sun), 0.0), is_lit(at.point, normal));
    return look.ambient + look.sun * lit;
}

@compute @workgroup_size(64)
fn draw_direct(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let pixel = (group.y * GROUPS + group.x) * 64u + lane;
    if pixel >= look.width * look.height {
        return;
    }
    let corner = vec2<f32>(vec2(pixel % look.width, pixel / look.width));
    var sum = vec3(0.0);
    var done = 0u;
    for (var first = 0u; first < 5u; first++) {
        if (done >> first & 1u) != 0u {
            continue;
        }
        // The samples that show the same surface: they share its light, or the sky.
        let seen = seen_at(pixel, first);
        var members = 0u;
        var count = 0.0;
        var middle = vec2(0.0);
        for (var s = first; s < 5u; s++) {
            if seen_at(pixel, s).surface == seen.surface {
                members |= 1u << s;
                count += 1.0;
                middle += eighths(s);
            }
        }
        done |= members;
        middle /= count;
        if seen.surface == SKY {
            sum += displayed(sky(normalize(view_ray(corner + middle / 8.0)))) * count;
        } else if seen.surface >= look.mirrors {
            var nearest = first;
            var least = 1e9;
            for (var s = first; s < 5u; s++) {
                let away = eighths(s) - middle;
                if (members >> s & 1u) != 0u && dot(away, away) < least {
                    least = dot(away, away);
                    nearest = s;
                }
            }
            let id = id_of(pixel, nearest);
            let lit = light(id, met(id, corner + middle / 8.0));
            for (var s = first; s < 5u; s++) {
                if (members >> s & 1u) != 0u {
                    let own = id_of(pixel, s);
                    sum += displayed(albedo(seen.surface, own, met(own, corner + eighths(s) / 8.0)) * lit);
                }
            }
        }
    }
    direct[pixel] = vec4(sum, 0.0);
}
