// The search of Roger & Holzschuch 2006.

struct Sample {
    direction: vec3<f32>,
    point: vec3<f32>,
    slope: vec3<f32>,
    gradient: vec3<f32>,
    path: f32,
}

fn sample_at(vertex: vec3<f32>, direction: vec3<f32>) -> Sample {
    let u = unit_or(direction, vec3(0.0, 1.0, 0.0));
    let read = radial_at(u);
    let point = u * read.w;
    let from_eye = point - task.eye;
    let from_vertex = point - vertex;
    let eye_length = length(from_eye);
    let vertex_length = length(from_vertex);
    let e = from_eye / max(eye_length, 1e-30) + from_vertex / max(vertex_length, 1e-30);
    let along = dot(e, u);
    let gradient = read.xyz * along + (e - u * along) * read.w;
    return Sample(u, point, read.xyz, gradient, eye_length + vertex_length);
}

/// Whether `a` is nearer to the reflection point than `b`.
fn nearer(a: Sample, b: Sample) -> bool {
    let shorter = b.path - a.path;
    if task.inward == 0u && abs(shorter) > LENGTH_NOISE * length(a.point) {
        return shorter > 0.0;
    }
    return dot(a.gradient, a.gradient) < dot(b.gradient, b.gradient);
}

/// Indices of the samples, the nearest first.
fn order(samples: array<Sample, 3>) -> vec3<u32> {
    var all = samples;
    var list = vec3(0u, 1u, 2u);
    if nearer(all[list.y], all[list.x]) {
        list = list.yxz;
    }
    if nearer(all[list.z], all[list.y]) {
        list = list.xzy;
    }
    if nearer(all[list.y], all[list.x]) {
        list = list.yxz;
    }
    return list;
}

fn result_of(s: Sample, steps: u32) -> Result {
    var outward = s.point - s.slope;
    if task.inward != 0u {
        outward = -outward;
    }
    return Result(s.point, unit_or(outward, s.direction), steps, false);
}

fn find_roger(vertex: vec3<f32>) -> Result {
    var samples: array<Sample, 3>;
    let a = sample_at(vertex, foot_direction(unit_or(vertex, vec3(0.0, 1.0, 0.0))));
    let b = sample_at(vertex, foot_direction(unit_or(task.eye, vec3(0.0, 1.0, 0.0))));
    let any = any_orthonormal_vector(a.direction);
    var across = cross(a.direction, b.direction);
    if length(across) < 1e-4 {
        across = any;
    } else {
        across = unit_or(across, any);
    }
    let opening = max(length(a.direction - b.direction), LEAST_SIDE);
    let middle_of = (a.direction + b.direction) * 0.5;
    samples[0] = a;
    samples[1] = b;
    samples[2] = sample_at(vertex, middle_of + across * (HEIGHT * opening));
    var newest = 3u;
    var has_discarded = false;
    var discarded = a;
    var trust = TRUST_FIRST;
    for (var steps = 1u; steps <= task.iterations; steps += 1u) {
        let list = order(samples);
        let best = list.x;
        let middle = list.y;
        let worst = list.z;
        let nearest = samples[best];
        let old = select(worst, middle, worst == newest);
        let ga = samples[0].gradient - samples[2].gradient;
        let gb = samples[1].gradient - samples[2].gradient;
        let gc = samples[2].gradient;
        let aa = dot(ga, ga);
        let ab = dot(ga, gb);
        let bb = dot(gb, gb);
        let determinant = aa * bb - ab * ab;
        let first = samples[middle].direction - nearest.direction;
        let second = samples[worst].direction - nearest.direction;
        let crossed = cross(first, second);
        let most = dot(first, first) * dot(second, second);
        if determinant <= LEAST_DETERMINANT * aa * bb || dot(crossed, crossed) <= LEAST_AREA * most {
            if has_discarded {
                samples[old] = discarded;
                has_discarded = false;
            } else {
                newest = old;
                let other = any_orthonormal_vector(nearest.direction);
                let sideways = unit_or(cross(nearest.direction, first), other);
                let opened = clamp(length(first), NEW_SIDE_LEAST, NEW_SIDE_MOST);
                samples[old] = sample_at(vertex, nearest.direction + sideways * opened);
            }
            continue;
        }
        let ac = dot(ga, gc);
        let bc = dot(gb, gc);
        let alpha = (ab * bc - bb * ac) / determinant;
        let beta = (ab * ac - aa * bc) / determinant;
        let aimed = samples[0].direction * alpha + samples[1].direction * beta
            + samples[2].direction * (1.0 - alpha - beta);
        var step = aimed - nearest.direction;
        let slope = length(nearest.gradient);
        if task.inward == 0u && dot(nearest.gradient, step) > 0.0 {
            step = nearest.gradient * (-min(trust, slope) / max(slope, 1e-30));
        } else {
            step = step * min(trust / max(length(step), 1e-30), 1.0);
        }
        let size = length(step);
        let new_sample = sample_at(vertex, nearest.direction + step);
        let distance = max(length(nearest.point - task.eye), 1e-30);
        let moved = size * length(nearest.point) / distance;
        if nearer(new_sample, nearest) {
            trust = min(1.5 * trust, TRUST_MOST);
        } else {
            trust = max(0.5 * size, NEW_SIDE_LEAST);
        }
        discarded = samples[worst];
        has_discarded = true;
        samples[worst] = new_sample;
        newest = worst;
        if moved < task.limit
            && length(new_sample.gradient) < GRADIENT_ENDS * task.limit * distance {
            return result_of(new_sample, steps);
        }
    }
    return result_of(samples[order(samples).x], task.iterations);
}
