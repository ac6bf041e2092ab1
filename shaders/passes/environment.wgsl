// The reflection completed: the environment where nothing landed, and the mirror's tint.

@group(0) @binding(7) var<storage, read> reflection: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> completed: array<vec4<f32>>;

@compute @workgroup_size(64)
fn complete(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let pixel = (group.y * GROUPS + group.x) * 64u + lane;
    if pixel >= look.width * look.height {
        return;
    }
    let seen = seen_at(pixel, 0u);
    if seen.surface >= look.mirrors {
        completed[pixel] = vec4(0.0);
        return;
    }
    var own = reflection[pixel];
    if own.w < 1.0 {
        let px = vec2<f32>(vec2(pixel % look.width, pixel / look.width)) + 0.5;
        let ray = normalize(view_ray(px));
        let w = weights_at(seen.id, ray);
        let sum = corner_of(seen.id, 0u).normal * w.x + corner_of(seen.id, 1u).normal * w.y
            + corner_of(seen.id, 2u).normal * w.z;
        var direction = vec3(0.0, 1.0, 0.0);
        if dot(sum, sum) > 0.0 {
            direction = reflect(ray, normalize(sum));
        }
        own = vec4(own.xyz + sky(direction) * (1.0 - own.w), own.w);
    }
    completed[pixel] = vec4(own.xyz * surface_row(seen.surface, 1u).xyz, own.w);
}
