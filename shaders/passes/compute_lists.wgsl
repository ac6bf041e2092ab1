fn cover(s: Splat, again: bool) {
    let size = vec2<f32>(s.size);
    let first = vec2(max(ceil(s.middle.y - s.half.y - 0.5), 1.0), min(floor(s.middle.y + s.half.y - 0.5), size.y));
    for (var y = first.x; y <= first.y; y += 1.0) {
        let dy = y + 0.5 - s.middle.y;
        // Between the roots of 1 = form(dx, dy).
        let mid = -s.form.y * dy / s.form.x;
        let half = sqrt(max((1.0 - s.form.z * dy * dy) / s.form.x + mid * mid, 0.0));
        let begin = max(ceil(s.middle.x + mid - half - 0.5), 1.0);
        let end = min(floor(s.middle.x + mid + half - 0.5), size.x);
        for (var x = begin; x <= end; x += 1.0) {
            let at = s.origin + vec2<u32>(vec2(x, y)) - 1u;
            let pixel = at.y * frame.size.x + at.x;
            if owner_of(pixel) != s.owner {
                continue;
            }
            add(pixel, vec2(x + 0.5 - s.middle.x, dy), s.form, s.weight, s.range, s.depth, s.surfel);
        }
    }
}
