// The search of Estalella et al. 2005.

struct Bisector {
    point: vec3<f32>,
    normal: vec3<f32>,
    toward: vec3<f32>,
    error: f32,
}

fn height_over(at: Surface, point: vec3<f32>) -> f32 {
    return dot(point - at.point, at.normal);
}

fn bisector(given: vec3<f32>, hidden: bool, direction: vec3<f32>) -> Bisector {
    let at = surface_at(direction);
    var vertex = given;
    if hidden {
        vertex = given - at.normal * (2.0 * height_over(at, given));
    }
    let to_eye = unit_or(task.eye - at.point, vec3(0.0));
    let to_vertex = unit_or(vertex - at.point, vec3(0.0));
    let b = unit_or(to_eye + to_vertex, at.normal);
    let toward = b - at.normal;
    let along = toward - at.normal * dot(toward, at.normal);
    return Bisector(at.point, at.normal, along, 0.5 * (1.0 - dot(b, at.normal)));
}

/// Direction of the foot, and how high the point is over it as a share.
fn foot(point: vec3<f32>) -> vec4<f32> {
    let direction = foot_direction(unit_or(point, vec3(0.0, 1.0, 0.0)));
    let radius = radial_at(direction).w;
    let height = abs(length(point) - radius);
    return vec4(direction, height / (height + radius));
}

fn entry(vertex: vec3<f32>, radius: f32) -> vec3<f32> {
    let ahead = unit_or(vertex - task.eye, vec3(0.0));
    let nearest = task.eye - ahead * dot(task.eye, ahead);
    let depth = sqrt(max(radius * radius - dot(nearest, nearest), 0.0));
    return nearest - ahead * depth;
}

fn first_direction(vertex: vec3<f32>, hidden: bool) -> vec3<f32> {
    let eye = foot(task.eye);
    let own = foot(vertex);
    if hidden {
        return entry(vertex, radial_at(eye.xyz).w);
    }
    return unit_or(eye.xyz * own.w + own.xyz * eye.w, eye.xyz);
}

fn turns(radius: f32, to: vec3<f32>) -> f32 {
    return 0.5 * radius / max(length(to), 1e-30);
}

fn by_bisector(vertex: vec3<f32>, hidden: bool) -> Result {
    var at = bisector(vertex, hidden, first_direction(vertex, hidden));
    var best = at;
    let first = length(at.point);
    var size = 1.0 / (1.0 + turns(first, task.eye - at.point) + turns(first, vertex - at.point));
    var steps = 0u;
    while steps < task.iterations && best.error > task.limit {
        steps += 1u;
        let radius = length(at.point);
        let reach = length(at.toward);
        let ahead = at.toward / max(reach, 1e-30);
        let most = MOST_STEP * radius;
        let half_step = min(0.5 * size * radius * reach, 0.5 * most);
        let middle = bisector(vertex, hidden, at.point + ahead * half_step);
        let shrunk = (reach - dot(middle.toward, ahead)) / max(half_step, 1e-30);
        let back = shrunk < 0.0 && task.inward != 0u;
        var full = STEP_SHARE_MOST * half_step;
        size = 2.0 * size;
        if shrunk > 0.0 || back {
            full = reach / max(abs(shrunk), 1e-30);
            size = 1.0 / max(abs(shrunk) * radius, 1e-30);
        }
        full = min(clamp(full, STEP_SHARE_LEAST * half_step, STEP_SHARE_MOST * half_step), most);
        size = clamp(size, STEP_RANGE_LEAST, STEP_RANGE_MOST);
        let turned = unit_or(middle.toward, ahead);
        var along = ahead;
        if dot(turned, ahead) > TURN {
            along = turned;
        }
        if back {
            full = -full;
        }
        at = bisector(vertex, hidden, at.point + along * full);
        if at.error < best.error {
            best = at;
        }
    }
    return Result(best.point, best.normal, steps, hidden);
}

fn find_estalella(vertex: vec3<f32>) -> Result {
    return by_bisector(vertex, hides(vertex));
}
