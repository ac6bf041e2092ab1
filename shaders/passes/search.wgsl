// Reflection points of a list of points.

struct Task {
    eye: vec3<f32>,
    side: u32,
    inward: u32,
    iterations: u32,
    count: u32,
    /// Estalella: ε. Roger & Holzschuch: the angle.
    limit: f32,
}

struct Result {
    point: vec3<f32>,
    normal: vec3<f32>,
    steps: u32,
    hidden: bool,
}

@group(0) @binding(0) var<uniform> task: Task;
@group(0) @binding(1) var<storage, read> radial: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> surface: array<f32>;
@group(0) @binding(3) var<storage, read> points: array<f32>;
@group(0) @binding(4) var<storage, read_write> found: array<vec4<f32>>;

fn point_at(i: u32) -> vec3<f32> {
    return vec3(points[3u * i], points[3u * i + 1u], points[3u * i + 2u]);
}

fn store(i: u32, r: Result) {
    // A hollow mirror hides what is behind the tangent plane at its image.
    let behind = dot(point_at(i) - r.point, r.normal) <= 0.0;
    let hidden = select(r.hidden, behind, task.inward != 0u);
    found[2u * i] = vec4(r.point, f32(r.steps));
    found[2u * i + 1u] = vec4(r.normal, select(0.0, 1.0, hidden));
}

@compute @workgroup_size(64)
fn search_estalella(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = (group.y * GROUPS + group.x) * 64u + lane;
    if i < task.count {
        store(i, find_estalella(point_at(i)));
    }
}

@compute @workgroup_size(64)
fn search_roger(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = (group.y * GROUPS + group.x) * 64u + lane;
    if i < task.count {
        var found_here = find_roger(point_at(i));
        found_here.hidden = hides(point_at(i));
        store(i, found_here);
    }
}

/// What a cube map (`radial`) holds in the points' directions.
@compute @workgroup_size(64)
fn look_up(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let i = (group.y * GROUPS + group.x) * 64u + lane;
    if i < task.count {
        found[i] = radial_at(point_at(i));
    }
}
