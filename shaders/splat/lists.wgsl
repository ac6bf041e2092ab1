// Ellipses: every pixel has a list of what covers it. Element 0 of `heads` counts all entries.

@group(0) @binding(7) var<storage, read_write> heads: array<atomic<u32>>;
struct Entry {
    next: u32,
    depth: u32,
    surfel: u32,
    /// Two halves: share of the pixel, reach in depth.
    part: u32,
    /// Two halves: where the splat lies about the pixel, see `about`.
    about: u32,
}

/// Entry 0 is not used.
@group(0) @binding(8) var<storage, read_write> entries: array<Entry>;

/// One more point has an image.
fn count_valid() {
    atomicAdd(&heads[frame.size.x * frame.size.y + 1u], 1u);
}

/// The part of a pixel that a splat covers, at `d` pixels from its middle.
fn part_at(d: vec2<f32>, form: vec3<f32>, weight: f32) -> f32 {
    let inside = max(1.0 - (d.x * (d.x * form.x + 2.0 * form.y * d.y) + form.z * d.y * d.y), 0.0);
    return inside * inside * weight * GAIN;
}

/// From the middle of a splat to a place `d` pixels away, in its own size. What is small counts as if it lay beside.
fn about(d: vec2<f32>, form: vec3<f32>) -> vec2<f32> {
    let half = sqrt(form.zx / max(form.x * form.z - form.y * form.y, 1e-30));
    let small = clamp((LARGE_TO - min(half.x, half.y)) / (LARGE_TO - LARGE_FROM), 0.0, 1.0);
    return d / half + vec2(small, 0.0);
}

/// How full of its front a pixel counts. Twin of `closed` in backend/cpu/splat/blend.rs.
fn closed(full: f32, about: vec2<f32>) -> f32 {
    let far = dot(about, about) / (full * full);
    let within = AROUND_WITHIN * AROUND_WITHIN;
    let beyond = AROUND_BEYOND * AROUND_BEYOND;
    let around = clamp((beyond - far) / (beyond - within), 0.0, 1.0);
    let some = clamp((full - GAP_FROM) / (GAP_TO - GAP_FROM), 0.0, 1.0);
    return full + (1.0 - full) * around * some;
}

fn add(pixel: u32, d: vec2<f32>, form: vec3<f32>, weight: f32, range: f32, depth: f32, surfel: u32) {
    let part = part_at(d, form, weight);
    if part <= 0.0 {
        return;
    }
    let entry = atomicAdd(&heads[0], 1u) + 1u;
    if entry >= frame.capacity {
        return;
    }
    // Shares of the depth: halves have little range.
    let share = min(range / max(depth, 1e-30), 60000.0);
    let next = atomicExchange(&heads[pixel + 1u], entry);
    let values = pack2x16float(vec2(min(part, 1.0), share));
    entries[entry] = Entry(next, bitcast<u32>(depth), surfel, values, pack2x16float(about(d, form)));
}
