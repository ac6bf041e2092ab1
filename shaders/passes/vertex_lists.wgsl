// Ellipses drawn as quads.

@fragment
fn cover(in: Corner) {
    let at = pixel_of(in.position);
    let pixel = at.y * frame.size.x + at.x;
    if owner_of(pixel) != in.ids.y {
        return;
    }
    let d = vec2<f32>(at) + 0.5 - in.middle;
    add(pixel, d, in.form, in.values.x, in.values.y, in.values.z, in.ids.x);
}
