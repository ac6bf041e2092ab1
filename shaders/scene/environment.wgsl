// A panorama's radiance by direction. Twin of scene/environment/image.rs.

/// Nodes of a cube's faces, which share those on their common edges: +x, -x, +y, -y, +z, -z.
@group(0) @binding(11) var panorama: texture_2d_array<f32>;

/// Radiance from a direction of any length but zero.
fn panorama_at(direction: vec3<f32>) -> vec3<f32> {
    let size = abs(direction);
    var face = 4u;
    var front = direction.z;
    if size.x >= size.y && size.x >= size.z {
        face = 0u;
        front = direction.x;
    } else if size.y >= size.z {
        face = 2u;
        front = direction.y;
    }
    let side = select(1.0, -1.0, front < 0.0);
    var along = vec2(side * direction.x, -direction.y);
    if face == 0u {
        along.x = -side * direction.z;
    } else if face == 2u {
        along = vec2(direction.x, side * direction.z);
    }
    let cells = f32(textureDimensions(panorama).x - 1u);
    let at = (along / max(abs(front), 1e-37) + 1.0) * (0.5 * cells);
    let cell = clamp(floor(at), vec2(0.0), vec2(cells - 1.0));
    let between = at - cell;
    let first = vec2<u32>(cell);
    let layer = face + select(0u, 1u, front < 0.0);
    let upper = mix(
        textureLoad(panorama, first, layer, 0).xyz,
        textureLoad(panorama, first + vec2(1u, 0u), layer, 0).xyz,
        between.x,
    );
    let lower = mix(
        textureLoad(panorama, first + vec2(0u, 1u), layer, 0).xyz,
        textureLoad(panorama, first + vec2(1u, 1u), layer, 0).xyz,
        between.x,
    );
    return mix(upper, lower, between.y);
}

