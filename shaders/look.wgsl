// What surfaces and sky look like: twin of backend/cpu/finish.rs, scene/shade.rs and scene/environment.rs.

struct Look {
    /// Of the eye; the rays through neighbouring pixels are `right` and -`up` apart.
    eye: vec3<f32>,
    white: f32,
    right: vec3<f32>,
    width: u32,
    up: vec3<f32>,
    height: u32,
    forward: vec3<f32>,
    /// Surfaces, of which the first are mirrors.
    surfaces: u32,
    to_sun: vec3<f32>,
    mirrors: u32,
    sun: vec3<f32>,
    /// Triangles of mirrors: their ids come first.
    mirror_triangles: u32,
    ambient: vec3<f32>,
    /// How far above a surface shadow rays start, scene units.
    apart: f32,
    zenith: vec3<f32>,
    /// CONSTANT_SKY: `zenith` everywhere; CLEAR_SKY: it has parts; else the panorama.
    environment: u32,
    horizon: vec3<f32>,
    /// Units of the triangles' tree per scene unit; 0: there are no triangles.
    scale: f32,
    ground: vec3<f32>,
    padding: u32,
}

@group(0) @binding(0) var<uniform> look: Look;
/// By pixel: the id that all its samples show, or MIXED and where its five are listed behind the pixels.
@group(0) @binding(1) var<storage, read> samples: array<u32>;
/// Three rows a triangle, by id: position and packed normal of a corner, scene space.
@group(0) @binding(2) var<storage, read> triangles: array<vec4<u32>>;
/// Six rows a surface: see backend/gpu/surfaces.rs.
@group(0) @binding(3) var<storage, read> surfaces: array<vec4<u32>>;

const NONE: u32 = 0xffffffffu;
const MIXED: u32 = 0x80000000u;
const SKY: u32 = NONE;
const CONSTANT_SKY: u32 = 0u;
const CLEAR_SKY: u32 = 1u;

struct Seen {
    /// SKY, or an index.
    surface: u32,
    id: u32,
}

fn id_of(pixel: u32, sample: u32) -> u32 {
    let id = samples[pixel];
    if id == NONE || (id & MIXED) == 0u {
        return id;
    }
    return samples[look.width * look.height + (id & ~MIXED) * 5u + sample];
}

fn seen_at(pixel: u32, sample: u32) -> Seen {
    let id = id_of(pixel, sample);
    if id == NONE {
        return Seen(SKY, id);
    }
    var low = 0u;
    var high = look.surfaces;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if surfaces[middle * SURFACE_ROWS].x <= id {
            low = middle;
        } else {
            high = middle;
        }
    }
    return Seen(low, id);
}

fn surface_row(surface: u32, index: u32) -> vec4<f32> {
    return bitcast<vec4<f32>>(surfaces[surface * SURFACE_ROWS + index]);
}

struct Corner {
    position: vec3<f32>,
    normal: vec3<f32>,
}

fn corner_of(id: u32, corner: u32) -> Corner {
    let bits = triangles[3u * id + corner];
    let folded = unpack2x16snorm(bits.w);
    var n = vec3(folded, 1.0 - abs(folded.x) - abs(folded.y));
    if n.z < 0.0 {
        n = vec3((vec2(1.0) - abs(folded.yx)) * select(vec2(-1.0), vec2(1.0), folded >= vec2(0.0)), n.z);
    }
    return Corner(bitcast<vec3<f32>>(bits.xyz), normalize(n));
}

/// Where a sample lies in its pixel, in eighths.
fn eighths(sample: u32) -> vec2<f32> {
    return vec2<f32>(vec2(SAMPLES_X, SAMPLES_Y) >> vec2(4u * sample) & vec2(15u));
}

/// The view ray through a place of the picture, in pixels; not of unit length.
fn view_ray(px: vec2<f32>) -> vec3<f32> {
    let from_middle = px - 0.5 * vec2<f32>(vec2(look.width, look.height));
    return look.forward + look.right * from_middle.x - look.up * from_middle.y;
}

/// Weights of a triangle's corners where a ray from the eye meets its plane, if it does so before it.
fn weights_at(id: u32, ray: vec3<f32>) -> vec4<f32> {
    let a = corner_of(id, 0u).position - look.eye;
    let e1 = corner_of(id, 1u).position - look.eye - a;
    let e2 = corner_of(id, 2u).position - look.eye - a;
    let p = cross(ray, e2);
    let det = dot(e1, p);
    if det == 0.0 {
        return vec4(0.0);
    }
    let q = cross(-a, e1);
    let u = dot(-a, p) / det;
    let v = dot(ray, q) / det;
    let before = dot(e2, q) / det > 0.0;
    return vec4(1.0 - u - v, u, v, select(0.0, 1.0, before));
}

fn displayed(radiance: vec3<f32>) -> vec3<f32> {
    return clamp(radiance, vec3(0.0), vec3(look.white));
}

fn smooth_step(begin: f32, end: f32, x: f32) -> f32 {
    let t = clamp((x - begin) / (end - begin), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

/// Radiance from a unit direction.
fn sky(direction: vec3<f32>) -> vec3<f32> {
    if look.environment == CONSTANT_SKY {
        return look.zenith;
    }
    if look.environment != CLEAR_SKY {
        return panorama_at(direction);
    }
    let above = smooth_step(-HORIZON_BLUR, HORIZON_BLUR, direction.y);
    let air = 1.0 - clamp(direction.y, 0.0, 1.0);
    let air2 = air * air;
    let blue = mix(look.zenith, look.horizon, air * (0.15 + 0.85 * air2 * air));
    let down = 1.0 - clamp(-direction.y, 0.0, 1.0);
    let down2 = down * down;
    let down4 = down2 * down2;
    let land = mix(look.ground * (0.6 + 0.4 * down2), look.horizon, 0.6 * down4 * down4 * down4);
    let facing = max(dot(direction, look.to_sun), 0.0);
    let p2 = facing * facing;
    let p8 = p2 * p2 * p2 * p2;
    let p32 = p8 * p8 * p8 * p8;
    let p128 = p32 * p32 * p32 * p32;
    let p512 = p128 * p128 * p128 * p128;
    let p2048 = p512 * p512 * p512 * p512;
    let glow = 0.03 * p8 + 0.08 * p32 + 0.15 * p128 + 0.3 * p512 + 0.8 * p2048;
    let disc = SUN_DISC * smooth_step(SUN_EDGE_OUTER, SUN_EDGE_INNER, facing);
    return mix(land, blue + look.sun * (glow + disc), above);
}
