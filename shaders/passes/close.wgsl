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
    var sides = array<Beside, 4>(
        beside(at - vec2(1, 0), owner), beside(at + vec2(1, 0), owner),
        beside(at - vec2(0, 1), owner), beside(at + vec2(0, 1), owner),
    );
    let full = layer.x;
    if CLOSING <= full && full < WHOLE {
        let covered = max(min(sides[0].layer.x, sides[1].layer.x), min(sides[2].layer.x, sides[3].layer.x));
        own *= max(covered, full) / full;
    }
    let front = layer.z;
    if CLOSING <= front && front < WHOLE {
        var closed = front;
        var between = own;
        for (var i = 0; i < 4; i += 2) {
            let a = sides[i];
            let b = sides[i + 1];
            let covered = min(min(a.layer.x, a.layer.z), min(b.layer.x, b.layer.z));
            let off = abs(0.5 * (a.layer.y + b.layer.y) - layer.y);
            let alike = off <= SAME_SURFACE_SHARE * layer.y + SLOPE * abs(a.layer.y - b.layer.y);
            if covered > closed && alike {
                closed = covered;
                between = (a.color + b.color) * 0.5;
            }
        }
        own = mix(own, between, (closed - front) / (1.0 - front));
    }
    reflection[pixel] = own;
}
