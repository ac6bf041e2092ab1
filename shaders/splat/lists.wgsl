// Ellipses: every pixel has a list of what covers it. Element 0 of `heads` counts all entries.

@group(0) @binding(7) var<storage, read_write> heads: array<atomic<u32>>;
/// The next entry, depth, share of the pixel and reach in depth (two halves), surfel. Entry 0 is not used.
@group(0) @binding(8) var<storage, read_write> entries: array<vec4<u32>>;

/// One more point has an image.
fn count_valid() {
    atomicAdd(&heads[frame.size.x * frame.size.y + 1u], 1u);
}

/// The part of a pixel that a splat covers, at `d` pixels from its middle.
fn part_at(d: vec2<f32>, form: vec3<f32>, weight: f32) -> f32 {
    let inside = max(1.0 - (d.x * (d.x * form.x + 2.0 * form.y * d.y) + form.z * d.y * d.y), 0.0);
    return inside * inside * weight * GAIN;
}

fn add(pixel: u32, part: f32, range: f32, depth: f32, surfel: u32) {
    let entry = atomicAdd(&heads[0], 1u) + 1u;
    if entry >= frame.capacity {
        return;
    }
    // Shares of the depth: halves have little range.
    let share = min(range / max(depth, 1e-30), 60000.0);
    let next = atomicExchange(&heads[pixel + 1u], entry);
    entries[entry] = vec4(next, bitcast<u32>(depth), pack2x16float(vec2(min(part, 1.0), share)), surfel);
}
