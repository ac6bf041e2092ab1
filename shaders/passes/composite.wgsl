// The picture: the direct view, and at the samples that show a mirror the reflection at its pixel.

@group(0) @binding(8) var<storage, read> completed: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read> direct: array<vec4<f32>>;
@group(0) @binding(10) var<storage, read_write> picture: array<vec4<f32>>;

/// The mean of the reflections at the neighbouring pixels that show the mirror at their centres, if there are any.
fn borrowed(pixel: u32, mirror: u32) -> vec4<f32> {
    let x = i32(pixel % look.width);
    let y = i32(pixel / look.width);
    var sum = vec4(0.0);
    for (var row = max(y - 1, 0); row < min(y + 2, i32(look.height)); row++) {
        for (var column = max(x - 1, 0); column < min(x + 2, i32(look.width)); column++) {
            let at = u32(row) * look.width + u32(column);
            if seen_at(at, 0u).surface == mirror {
                sum += vec4(displayed(completed[at].xyz), 1.0);
            }
        }
    }
    return sum;
}

/// What the flat triangle would reflect if there were nothing but sky.
fn flat_sky(px: vec2<f32>, seen: Seen) -> vec3<f32> {
    let direction = normalize(view_ray(px));
    let a = corner_of(seen.id, 0u).position;
    let ab = corner_of(seen.id, 1u).position - a;
    let ac = corner_of(seen.id, 2u).position - a;
    var normal = -direction;
    if dot(ab, ab) > 0.0 && dot(ac, ac) > 0.0 {
        let across = cross(normalize(ab), normalize(ac));
        if dot(across, across) > 0.0 {
            normal = normalize(across);
        }
    }
    return displayed(sky(reflect(direction, normal)) * surface_row(seen.surface, 1u).xyz);
}

@compute @workgroup_size(64)
fn compose(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let pixel = (group.y * GROUPS + group.x) * 64u + lane;
    if pixel >= look.width * look.height {
        return;
    }
    let corner = vec2<f32>(vec2(pixel % look.width, pixel / look.width));
    let center = seen_at(pixel, 0u);
    var sum = direct[pixel].xyz;
    var done = 0u;
    for (var first = 0u; first < 5u; first++) {
        let seen = seen_at(pixel, first);
        if (done >> first & 1u) != 0u || seen.surface >= look.mirrors {
            continue;
        }
        var count = 0.0;
        var middle = vec2(0.0);
        for (var s = first; s < 5u; s++) {
            if seen_at(pixel, s).surface == seen.surface {
                done |= 1u << s;
                count += 1.0;
                middle += eighths(s);
            }
        }
        var value: vec3<f32>;
        if center.surface == seen.surface {
            value = displayed(completed[pixel].xyz);
        } else {
            let near = borrowed(pixel, seen.surface);
            if near.w > 0.0 {
                value = near.xyz / near.w;
            } else {
                value = flat_sky(corner + middle / (8.0 * count), seen);
            }
        }
        sum += value * count;
    }
    picture[pixel] = vec4(sum / 5.0, 1.0);
}
