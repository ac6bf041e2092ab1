fn cover(s: Splat, again: bool) {
    for (var i = 0u; i < SIDE * SIDE; i++) {
        let slot = vec2<u32>(s.middle) + vec2(i % SIDE, i / SIDE);
        if any(slot < vec2(1u)) || any(slot > s.size) {
            continue;
        }
        let at = s.origin + slot - 1u;
        let pixel = at.y * frame.size.x + at.x;
        if owner_of(pixel) != s.owner {
            continue;
        }
        put(pixel, head_of(s.depth, (s.fills >> i & 1u) != 0u), s.surfel, again);
    }
}
