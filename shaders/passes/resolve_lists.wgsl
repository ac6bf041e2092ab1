// From lists to pixels. Twin of backend/cpu/splat/blend.rs, but that a pixel looks for its splats itself, the nearest
// first.

/// Radiance times coverage, coverage.
@group(0) @binding(3) var<storage, read_write> colors: array<vec4<f32>>;
/// How full the pixel is, depth of its nearest splat, how full it was when a farther surface came.
@group(0) @binding(4) var<storage, read_write> layers: array<vec4<f32>>;
/// Depth and surfel of the nearest that shows.
@group(0) @binding(5) var<storage, read_write> nearest: array<vec2<u32>>;

const NONE: u32 = 0xffffffffu;

@compute @workgroup_size(64)
fn blend(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let pixel = (group.y * GROUPS + group.x) * 64u + lane;
    if pixel >= frame.size.x * frame.size.y {
        return;
    }
    let head = atomicLoad(&heads[pixel + 1u]);
    var color = vec4(0.0);
    var full = 0.0;
    var near = 0.0;
    var front = 2.0;
    var first = vec2(NONE);
    var last = vec2(0u);
    var begun = false;
    // Where the splats of the front lie, times what they cover.
    var around = vec2(0.0);
    loop {
        // The nearest one behind the last.
        var found = vec2(NONE);
        var part = 0.0;
        var share = 0.0;
        var own_about = vec2(0.0);
        for (var i = head; i != 0u;) {
            let entry = entries[i];
            i = entry.next;
            let key = vec2(entry.depth, entry.surfel);
            let behind = !begun || last.x < key.x || (last.x == key.x && last.y < key.y);
            if behind && (key.x < found.x || (key.x == found.x && key.y < found.y)) {
                found = key;
                let values = unpack2x16float(entry.part);
                part = values.x;
                share = values.y;
                own_about = unpack2x16float(entry.about);
            }
        }
        if found.x == NONE || full >= WHOLE {
            break;
        }
        last = found;
        begun = true;
        let depth = bitcast<f32>(found.x);
        if full <= 0.0 {
            near = depth;
        }
        if near < depth - share * depth && 1.0 < front {
            front = closed(full, around);
            color *= front / full;
            full = front;
        }
        part = min(part, 1.0 - full);
        if part <= 0.0 {
            continue;
        }
        if 1.0 < front {
            around += own_about * part;
        }
        full += part;
        if found.y < frame.first_hider {
            if color.w <= 0.0 {
                first = found;
            }
            color += vec4(radiance_of(found.y), 1.0) * part;
        }
    }
    if 1.0 < front && 0.0 < full && full < WHOLE {
        let whole = closed(full, around);
        color *= whole / full;
        full = whole;
    }
    colors[pixel] = color;
    layers[pixel] = vec4(full, near, front, 0.0);
    nearest[pixel] = first;
}
