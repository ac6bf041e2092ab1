// Cube maps and what a reflector's hold. Rows of a face are task.side + 2 texels long.

struct Place {
    first: u32,
    between: vec2<f32>,
}

fn unit_or(v: vec3<f32>, other: vec3<f32>) -> vec3<f32> {
    let size = length(v);
    if size > 0.0 && size < 1e30 {
        return v / size;
    }
    return other;
}

/// Perpendicular to a unit vector.
fn any_orthonormal_vector(v: vec3<f32>) -> vec3<f32> {
    let side = select(-1.0, 1.0, v.z >= 0.0);
    let a = -1.0 / (side + v.z);
    return vec3(v.x * v.y * a, side + v.y * v.y * a, -v.y);
}

fn place_of(direction: vec3<f32>) -> Place {
    let size = abs(direction);
    var face = 0u;
    var front = direction.x;
    var columns = -direction.z;
    var rows = -direction.y;
    if size.x >= size.y && size.x >= size.z {
        if direction.x < 0.0 {
            face = 1u;
            front = -direction.x;
            columns = direction.z;
        }
    } else if size.y >= size.z {
        face = select(2u, 3u, direction.y < 0.0);
        front = size.y;
        columns = direction.x;
        rows = select(direction.z, -direction.z, direction.y < 0.0);
    } else {
        face = select(4u, 5u, direction.z < 0.0);
        front = size.z;
        columns = select(direction.x, -direction.x, direction.z < 0.0);
    }
    let side = f32(task.side);
    let at = (vec2(columns, rows) / front + 1.0) * 0.5 * side + 0.5;
    let cell = clamp(floor(at), vec2(0.0), vec2(side));
    let row = task.side + 2u;
    return Place((face * row + u32(cell.y)) * row + u32(cell.x), at - cell);
}

/// The gradient of the radius, and the radius.
fn radial_at(direction: vec3<f32>) -> vec4<f32> {
    let place = place_of(direction);
    let below = place.first + task.side + 2u;
    let upper = mix(radial[place.first], radial[place.first + 1u], place.between.x);
    let lower = mix(radial[below], radial[below + 1u], place.between.x);
    return mix(upper, lower, place.between.y);
}

struct Surface {
    point: vec3<f32>,
    normal: vec3<f32>,
}

fn surface_texel(texel: u32, part: u32) -> vec3<f32> {
    let at = texel * 6u + part;
    return vec3(surface[at], surface[at + 1u], surface[at + 2u]);
}

fn surface_part(place: Place, part: u32) -> vec3<f32> {
    let below = place.first + task.side + 2u;
    let x = place.between.x;
    let upper = mix(surface_texel(place.first, part), surface_texel(place.first + 1u, part), x);
    let lower = mix(surface_texel(below, part), surface_texel(below + 1u, part), x);
    return mix(upper, lower, place.between.y);
}

fn surface_at(direction: vec3<f32>) -> Surface {
    let place = place_of(direction);
    let normal = unit_or(surface_part(place, 3u), vec3(0.0, 1.0, 0.0));
    return Surface(surface_part(place, 0u), normal);
}

fn foot_direction(direction: vec3<f32>) -> vec3<f32> {
    let at = surface_at(direction);
    if task.inward != 0u && dot(at.normal, task.eye - at.point) < 0.0 {
        return -direction;
    }
    return direction;
}

/// How far outside the surface a point is, as a share of the radius.
fn outside(p: vec3<f32>) -> f32 {
    return length(p) / radial_at(p).w - 1.0;
}

/// Whether a point is in the hidden region.
fn hides(point: vec3<f32>) -> bool {
    if task.inward != 0u {
        return false;
    }
    var least = outside(point);
    let sight = point - task.eye;
    var at = 1.0;
    for (var k = 1u; k < SIGHT_SAMPLES; k += 1u) {
        let t = f32(k) / f32(SIGHT_SAMPLES);
        let now = outside(task.eye + sight * t);
        if now < least {
            least = now;
            at = t;
        }
    }
    var step = 0.5 / f32(SIGHT_SAMPLES);
    for (var k = 0u; k < SIGHT_HALVINGS; k += 1u) {
        for (var side = -1.0; side < 2.0; side += 2.0) {
            let t = at + side * step;
            let now = outside(task.eye + sight * clamp(t, 0.0, 1.0));
            if now < least {
                least = now;
                at = t;
            }
        }
        step *= 0.5;
    }
    return least < 0.0;
}
