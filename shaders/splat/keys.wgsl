// Squares: the nearest key of every pixel, in two halves, inverted so that 0 is empty. The first pass finds the first half
// (fills, depth), the second one the least surfel among those.

@group(0) @binding(7) var<storage, read_write> heads: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> tails: array<atomic<u32>>;

fn head_of(depth: f32, fills: bool) -> u32 {
    return ~(bitcast<u32>(depth) | select(0u, 0x80000000u, fills));
}

fn put_head(pixel: u32, head: u32) {
    atomicMax(&heads[pixel], head);
}

fn put_tail(pixel: u32, head: u32, surfel: u32) {
    if atomicLoad(&heads[pixel]) == head {
        atomicMax(&tails[pixel], ~surfel);
    }
}

/// One more point has an image.
fn count_valid() {
    atomicAdd(&tails[frame.size.x * frame.size.y], 1u);
}

fn put(pixel: u32, head: u32, surfel: u32, again: bool) {
    if again {
        put_tail(pixel, head, surfel);
    } else {
        put_head(pixel, head);
    }
}

fn key_at(pixel: u32) -> vec2<u32> {
    return vec2(atomicLoad(&heads[pixel]), atomicLoad(&tails[pixel]));
}
