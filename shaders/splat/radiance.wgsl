// Colours of the surfels.

/// Two halves.
@group(0) @binding(2) var<storage, read> radiance_rg: array<u32>;
@group(0) @binding(6) var<storage, read> radiance_b: array<f32>;

fn radiance_of(surfel: u32) -> vec3<f32> {
    return vec3(unpack2x16float(radiance_rg[surfel]), radiance_b[surfel]);
}
