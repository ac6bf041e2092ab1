// From keys to pixels.

@group(0) @binding(3) var<storage, read_write> reflection: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> nearest: array<vec2<u32>>;

const NONE: u32 = 0xffffffffu;

@compute @workgroup_size(64)
fn resolve(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let pixel = (group.y * GROUPS + group.x) * 64u + lane;
    if pixel >= frame.size.x * frame.size.y {
        return;
    }
    let key = ~key_at(pixel);
    let shows = key.x != NONE && key.y < frame.first_hider;
    if shows {
        reflection[pixel] = vec4(radiance_of(key.y), 1.0);
        nearest[pixel] = key;
    } else {
        reflection[pixel] = vec4(0.0);
        nearest[pixel] = vec2(NONE);
    }
}
