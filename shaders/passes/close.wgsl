// Gaps of a surface between two pixels that show it are closed. Twin of `Layers::at` in backend/cpu/splat/blend.rs.

@group(0) @binding(2) var<storage, read> colors: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> layers: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> reflection: array<vec4<f32>>;

/// Of a neighbour: how full, depth, front; what is not the patch's counts as full and shows nothing.
struct Beside {
    layer: vec3<f32>,
    color: vec4<f32>,
}

fn beside(at: vec2<i32>, owner: u32) -> Beside {
    let size = vec2<i32>(frame.size);
    if any(at < vec2(0)) || any(at >= size) {
        return Beside(vec3(1.0, 0.0, 2.0), vec4(0.0));
    }
    let pixel = u32(at.y * size.x + at.x);
    if owner_of(pixel) != owner {
        return Beside(vec3(1.0, 0.0, 2.0), vec4(0.0));
    }
    return Beside(layers[pixel].xyz, colors[pixel]);
}

/// The mean of what lies around a pixel, if that is one surface with what landed first there; else nothing.
fn surrounding(at: vec2<i32>, near: f32, owner: u32) -> vec4<f32> {
    var sum = vec4(0.0);
    var own = 0.0;
    for (var i = 0; i < 2; i += 1) {
        let step = select(vec2(0, 1), vec2(1, 0), i == 0);
        var depths = vec2(near);
        var count = 0.0;
        for (var k = 0; k < 2; k += 1) {
            let n = beside(at + step * (2 * k - 1), owner);
            if min(n.layer.x, n.layer.z) < SURROUNDED {
                return vec4(0.0);
            }
            if n.layer.y > 0.0 {
                if n.color.w < SURROUNDED {
                    return vec4(0.0);
                }
                depths[k] = n.layer.y;
                count += 1.0;
                sum += n.color;
            }
        }
        let slope = select(0.0, abs(depths.x - depths.y), count == 2.0);
        let off = abs(0.5 * (depths.x + depths.y) - near);
        if off > SAME_SURFACE_SHARE * near + SLOPE * slope {
            return vec4(0.0);
        }
        own += count;
    }
    return select(vec4(0.0), sum / max(own, 1.0), own >= 3.0);
}

@compute @workgroup_size(64)
fn close(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let pixel = (group.y * GROUPS + group.x) * 64u + lane;
    if pixel >= frame.size.x * frame.size.y {
        return;
    }
    let owner = owner_of(pixel);
    var own = vec4(0.0);
    if owner != NO_OWNER {
        own = colors[pixel];
    }
    if own.w == 0.0 {
        reflection[pixel] = vec4(0.0);
        return;
    }
    let at = vec2(i32(pixel % frame.size.x), i32(pixel / frame.size.x));
    let layer = layers[pixel].xyz;
    // Gaps a pixel wide, then two, in the row and the column.
    let full = layer.x;
    let front = layer.z;
    if min(full, front) < CLOSING {
        let around = surrounding(at, layer.y, owner);
        if around.w > 0.0 {
            own = around;
        }
    }
    var covered = full;
    var closed = front;
    var mean = own;
    for (var i = 0; i < 6; i += 1) {
        let step = select(vec2(0, 1), vec2(1, 0), i < 3);
        let kind = i % 3;
        let a = beside(at - step * select(1, 2, kind == 2), owner);
        let b = beside(at + step * select(1, 2, kind == 1), owner);
        // The gap's other pixel.
        var between = Beside(vec3(1.0, 0.0, 2.0), vec4(0.0));
        if kind != 0 {
            between = beside(at + step * select(-1, 1, kind == 1), owner);
        }
        if kind == 0 || CLOSING_TWO <= min(between.layer.x, full) {
            covered = max(covered, min(a.layer.x, b.layer.x));
        }
        let share = select(select(1.0 / 3.0, 2.0 / 3.0, kind == 2), 0.5, kind == 0);
        let both = min(min(a.layer.x, a.layer.z), min(b.layer.x, b.layer.z));
        let off = abs(mix(a.layer.y, b.layer.y, share) - layer.y);
        let alike = off <= SAME_SURFACE_SHARE * layer.y + SLOPE * abs(a.layer.y - b.layer.y);
        let of_front = min(between.layer.x, between.layer.z);
        let narrow = kind == 0 || CLOSING_TWO <= min(of_front, front);
        if both > closed && alike && narrow {
            closed = both;
            mean = mix(a.color, b.color, share);
        }
    }
    if CLOSING <= full && full < WHOLE {
        own *= covered / full;
    }
    if CLOSING <= front && front < WHOLE {
        own = mix(own, mean, (closed - front) / (1.0 - front));
    }
    reflection[pixel] = own;
}
