// Ellipses drawn as quads.

@fragment
fn cover(in: Corner) {
    let at = pixel_of(in.position);
    let pixel = at.y * frame.size.x + at.x;
    if owner_of(pixel) != in.ids.y {
        return;
    }
    let part = part_at(vec2<f32>(at) + 0.5 - in.middle, in.form, in.values.x);
    if part > 0.0 {
        add(pixel, part, in.values.y, in.values.z, in.ids.x);
    }
}
