// A picture, texel by texel: one to a pixel where it has the viewport's size.

@group(0) @binding(0) var picture: texture_2d<f32>;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) texel: vec2<f32>,
}

// One triangle that covers the viewport.
@vertex
fn blit_vertex(@builtin(vertex_index) index: u32) -> Corner {
    let corner = vec2<f32>(f32(index & 1u), f32(index >> 1u)) * 2.0;
    let position = vec4<f32>(corner.x * 2.0 - 1.0, 1.0 - corner.y * 2.0, 0.0, 1.0);
    return Corner(position, corner * vec2<f32>(textureDimensions(picture)));
}

@fragment
fn blit_fragment(corner: Corner) -> @location(0) vec4<f32> {
    return textureLoad(picture, vec2<u32>(corner.texel), 0);
}
