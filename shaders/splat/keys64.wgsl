// Squares: the nearest key of every pixel at once, inverted so that 0 is empty.

@group(0) @binding(7) var<storage, read_write> keys: array<atomic<u64>>;
/// Behind the pixels: points with an image.
@group(0) @binding(8) var<storage, read_write> tails: array<atomic<u32>>;

fn head_of(depth: f32, fills: bool) -> u32 {
    return ~(bitcast<u32>(depth) | select(0u, 0x80000000u, fills));
}

/// One more point has an image.
fn count_valid() {
    atomicAdd(&tails[frame.size.x * frame.size.y], 1u);
}

fn put(pixel: u32, head: u32, surfel: u32, again: bool) {
    atomicMax(&keys[pixel], (u64(head) << 32u) | u64(~surfel));
}

fn key_at(pixel: u32) -> vec2<u32> {
    let key = atomicLoad(&keys[pixel]);
    return vec2(u32(key >> 32u), u32(key));
}
