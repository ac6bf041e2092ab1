// Squares drawn as points or quads, twice.

fn is_filled(in: Corner, at: vec2<u32>) -> bool {
    let i = vec2<i32>(at) - in.first;
    return (in.ids.z >> u32(i.x + i.y * 2) & 1u) != 0u;
}

@fragment
fn cover(in: Corner) {
    let at = pixel_of(in.position);
    let pixel = at.y * frame.size.x + at.x;
    if owner_of(pixel) == in.ids.y {
        put_head(pixel, head_of(in.values.z, is_filled(in, at)));
    }
}

@fragment
fn cover_again(in: Corner) {
    let at = pixel_of(in.position);
    let pixel = at.y * frame.size.x + at.x;
    if owner_of(pixel) == in.ids.y {
        put_tail(pixel, head_of(in.values.z, is_filled(in, at)), in.ids.x);
    }
}
