/// Three numbers of nine bits and their exponent.
fn unpack_radiance(bits: u32) -> vec3<f32> {
    let scale = ldexp(1.0, i32(bits >> 27u) - 24);
    return vec3(f32(bits & 511u), f32(bits >> 9u & 511u), f32(bits >> 18u & 511u)) * scale;
}
