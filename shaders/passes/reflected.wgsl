// Triangles between images on a mirror: the frontmost back faces of the mirror, its own pixels, then the triangles.

struct View {
    position: vec3<f32>,
    focal_px: f32,
    right: vec3<f32>,
    /// No corner is nearer.
    near: f32,
    up: vec3<f32>,
    /// The largest distance of an image.
    farthest: f32,
    forward: vec3<f32>,
    /// Whether images are on the mirror: ordered by their distances, and everything linear over the picture.
    on_mirror: u32,
    size: vec2<f32>,
    /// The part's triangles.
    first: u32,
    end: u32,
}

@group(0) @binding(0) var<uniform> view: View;
/// Scene space; the distance.
@group(0) @binding(1) var<storage, read> corners: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> indices: array<u32>;
/// By pixel.
@group(0) @binding(3) var<storage, read> mirror_ids: array<u32>;
@group(0) @binding(4) var backs: texture_depth_2d;

struct Fragment {
    @builtin(position) position: vec4<f32>,
    @location(0) weights: vec2<f32>,
    @location(1) depth: f32,
    @location(2) @interpolate(flat) triangle: u32,
}

/// A corner before the eye: to the right, upward, and ahead.
fn seen(corner: vec3<f32>) -> vec3<f32> {
    let offset = corner - view.position;
    return vec3(dot(offset, view.right), dot(offset, view.up), dot(offset, view.forward));
}

fn clip(p: vec3<f32>) -> vec4<f32> {
    let scale = 2.0 * view.focal_px / view.size;
    return vec4(p.xy * scale, p.z - view.near, p.z);
}

@vertex
fn back_corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return clip(seen(corners[indices[i]].xyz));
}

@vertex
fn image_corner(@builtin(vertex_index) i: u32) -> Fragment {
    let corner = corners[indices[i]];
    let p = seen(corner.xyz);
    var position = clip(p);
    if view.on_mirror != 0u {
        position = vec4(position.xy / p.z, corner.w / view.farthest, 1.0);
    }
    let k = i % 3u;
    return Fragment(position, vec2(f32(k == 1u), f32(k == 2u)), p.z, i / 3u);
}

@fragment
fn show_triangle(in: Fragment) -> @location(0) vec4<u32> {
    if view.on_mirror != 0u {
        let read = textureLoad(backs, vec2<i32>(in.position.xy), 0);
        // Nothing there: infinitely far.
        let back = view.near / max(1.0 - read, 1e-30);
        if in.depth > back * BACK_SLACK {
            discard;
        }
    }
    return vec4(in.triangle + 1u, bitcast<u32>(in.weights.x), bitcast<u32>(in.weights.y), 0u);
}

/// A triangle over the whole picture.
@vertex
fn whole_picture(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

/// Leaves the part's own pixels, for the stencil.
@fragment
fn own_pixels(@builtin(position) position: vec4<f32>) {
    let pixel = vec2<u32>(position.xy);
    let id = mirror_ids[pixel.y * u32(view.size.x) + pixel.x];
    if id < view.first || id >= view.end {
        discard;
    }
}
