// From an image to what is drawn of it. Positions are in the patch's tile, which has a border of one pixel.

@group(0) @binding(2) var<storage, read> surfel_x: array<f32>;
@group(0) @binding(3) var<storage, read> surfel_y: array<f32>;
@group(0) @binding(4) var<storage, read> surfel_z: array<f32>;
@group(0) @binding(5) var<storage, read> surfel_extent: array<f32>;
@group(0) @binding(6) var<storage, read> surfel_normal: array<u32>;

struct Splat {
    drawn: bool,
    owner: u32,
    surfel: u32,
    /// Of its patch.
    origin: vec2<u32>,
    size: vec2<u32>,
    /// In the tile.
    middle: vec2<f32>,
    /// Of an ellipse.
    form: vec3<f32>,
    half: vec2<f32>,
    weight: f32,
    range: f32,
    depth: f32,
    /// Of a square: a bit for each of its pixels that it only fills.
    fills: u32,
}

/// How the point that is seen moves with the place on the screen, a pixel to the right and a pixel down.
struct Steps {
    right: vec3<f32>,
    down: vec3<f32>,
}

/// a, b, c of the squared distance a x² + 2 b x y + c y².
fn form_of(steps: Steps, size: f32) -> vec3<f32> {
    return vec3(dot(steps.right, steps.right), dot(steps.right, steps.down), dot(steps.down, steps.down)) * size;
}

/// The determinant of the form for a size of 1, which the difference of products would lose.
fn det_of(steps: Steps) -> f32 {
    let across = cross(steps.right, steps.down);
    return dot(across, across);
}

fn steps_about(camera: u32, image: Image, d: vec3<f32>) -> Steps {
    let right = image.lambda * row(camera + PER_PX + 2u).xyz + row(camera + PER_PX).xyz;
    let down = image.lambda * row(camera + PER_PX + 3u).xyz + row(camera + PER_PX + 1u).xyz;
    let per_length = 1.0 / dot(d, d);
    return Steps(right - (dot(right, d) * per_length) * d, down - (dot(down, d) * per_length) * d);
}

/// From the camera's image to that of rays which run `apart` beside, in pixels.
fn correction(steps: Steps, apart: vec3<f32>) -> vec2<f32> {
    let form = form_of(steps, 1.0);
    let u = dot(steps.right, apart);
    let v = dot(steps.down, apart);
    let det = det_of(steps);
    var moved = vec2(0.0);
    if 0.0 < det {
        moved = vec2(u * form.z - v * form.y, v * form.x - u * form.y) * (-1.0 / det);
    }
    return clamp(moved, vec2(-MOST_CORRECTION_PX), vec2(MOST_CORRECTION_PX));
}

fn normal_of(camera: u32, surfel: u32) -> vec3<f32> {
    let folded = unpack2x16snorm(surfel_normal[surfel]);
    var n = vec3(folded, 1.0 - abs(folded.x) - abs(folded.y));
    if n.z < 0.0 {
        n = vec3((vec2(1.0) - abs(folded.yx)) * select(vec2(-1.0), vec2(1.0), folded >= vec2(0.0)), n.z);
    }
    n = normalize(n);
    return vec3(
        dot(n, row(camera + ROTATION).xyz),
        dot(n, row(camera + ROTATION + 1u).xyz),
        dot(n, row(camera + ROTATION + 2u).xyz),
    );
}

struct OnSurface {
    steps: Steps,
    facing: bool,
    thin: f32,
}

/// Steps along the ray as steps along the surfel's plane.
fn on_surface(camera: u32, steps: Steps, d: vec3<f32>, normal: vec3<f32>) -> OnSurface {
    let along = dot(normal, d);
    let least = sqrt(dot(d, d)) * LEAST_FACING;
    let size = 1.0 / max(abs(along), least);
    let inverse = select(size, -size, along < 0.0);
    let right_n = dot(normal, steps.right) * inverse;
    let down_n = dot(normal, steps.down) * inverse;
    let facing = along < 0.0 || row(camera + E2).w == 0.0;
    return OnSurface(Steps(steps.right - right_n * d, steps.down - down_n * d), facing, abs(along) * size);
}

/// A square's pixels whose centres lie too far away for their rays to see the surfel.
fn fills_of(form: vec3<f32>, det: f32, first: vec2<f32>) -> u32 {
    let least = det / (form.x + form.z) * (REACH * REACH);
    var bits = 0u;
    for (var i = 0u; i < SIDE * SIDE; i++) {
        let at = first + select(vec2(0.5), vec2(f32(i % 2u), f32(i / 2u)), SIDE == 2u);
        let distance = at.x * at.x * form.x + (at.x * at.y * form.y) * 2.0 + at.y * at.y * form.z;
        if 1.0 < distance && 1.0 < distance * least {
            bits |= 1u << i;
        }
    }
    return bits;
}

fn depth_of(camera: u32, image: Image, d: vec3<f32>) -> f32 {
    var depth = image.lambda * sqrt(dot(d, d));
    if frame.push_back != 0u {
        let v = vec3(
            linear(image, row(camera + FROM_EYE).xyz),
            linear(image, row(camera + FROM_EYE + 1u).xyz),
            linear(image, row(camera + FROM_EYE + 2u).xyz),
        );
        depth = depth + sqrt(dot(v, v));
    }
    return max(depth, 0.0);
}

/// Whether the camera sees the image: it lies in the guard band and on the mirror's front.
fn is_seen(camera: u32, image: Image) -> bool {
    return within(image, row(camera + GUARD).xyz) && 0.0 < linear(image, row(camera + FRONT).xyz);
}

/// Whether the image lies in the camera's triangle, or its cell's rectangle.
fn is_valid(camera: u32, image: Image) -> bool {
    let owner = frame.patches + 2u * plan[camera + IDS].x;
    if plan[owner + 1u].x == 0u {
        return within(image, vec3(EDGE_TOLERANCE)) && is_seen(camera, image);
    }
    let w = linear(image, row(camera + SCREEN + 2u).xyz);
    if !is_seen(camera, image) || !(0.0 < w) {
        return false;
    }
    let at = vec2(linear(image, row(camera + SCREEN).xyz), linear(image, row(camera + SCREEN + 1u).xyz)) / w;
    return all(at >= vec2(0.0)) && all(at < vec2<f32>(plan[owner].zw));
}

/// What an image draws into its patch's tile, if anything.
fn splat_of(job: Job, image: Image) -> Splat {
    var s: Splat;
    s.drawn = false;
    let camera = job.camera;
    if !is_seen(camera, image) {
        return s;
    }
    s.owner = plan[camera + IDS].x;
    s.surfel = job.surfel;
    let place = plan[frame.patches + 2u * s.owner];
    let own = plan[frame.patches + 2u * s.owner + 1u];
    s.origin = place.xy;
    s.size = place.zw;
    let offset = select(1.0, 0.5, SIDE == 2u);
    let w = linear(image, row(camera + SCREEN + 2u).xyz);
    if !(0.0 < w) {
        return s;
    }
    s.middle = vec2(linear(image, row(camera + SCREEN).xyz), linear(image, row(camera + SCREEN + 1u).xyz)) / w + offset;
    let beyond = select(0.0, LARGEST_ELLIPSE, ELLIPSE) + select(0.0, CELL_SLACK_PX, own.x != 0u);
    let end = vec2<f32>(s.size + 1u);
    if any(s.middle < vec2(-beyond)) || any(s.middle >= end + beyond) {
        return s;
    }
    let d = vec3(
        linear(image, row(camera + DIRECTION).xyz),
        linear(image, row(camera + DIRECTION + 1u).xyz),
        linear(image, row(camera + DIRECTION + 2u).xyz),
    );
    s.depth = depth_of(camera, image, d);
    let steps = steps_about(camera, image, d);
    let radius = row(camera + D1).w;
    if own.x != 0u {
        let at = vec2<u32>(clamp(floor(s.middle - offset), vec2(0.0), vec2<f32>(s.size - 1u)));
        let deviation = row(frame.deviations + own.y + at.y * s.size.x + at.x).xyz;
        s.middle += correction(steps, deviation * (image.lambda / radius));
    }
    let share = row(camera + E1).w / surfel_extent[job.surfel];
    let size = share * share / f32(job.stride);
    if ELLIPSE {
        let on = on_surface(camera, steps, d, normal_of(camera, job.surfel));
        if !on.facing {
            return s;
        }
        kernel(&s, form_of(on.steps, size), det_of(on.steps) * (size * size));
        s.weight *= on.thin;
        s.range = SAME_SURFACE_RADII * radius / sqrt(size);
        s.drawn = all(s.middle + s.half >= vec2(0.0)) && all(s.middle - s.half < end);
    } else {
        s.drawn = all(s.middle >= vec2(0.0)) && all(s.middle < end);
        let first = floor(s.middle);
        s.fills = fills_of(form_of(steps, size), det_of(steps) * (size * size), first - s.middle);
        s.middle = first;
    }
    return s;
}

/// A splat's kernel in the picture, from the disk that holds its surfel.
fn kernel(s: ptr<function, Splat>, form: vec3<f32>, own_det: f32) {
    let least = 1.0 / (LARGEST_ELLIPSE * LARGEST_ELLIPSE);
    let most = 1.0 / max(own_det, least * least * least);
    // Every axis with 1 / r² = e becomes e + l² / (e + l).
    let trace = form.x + form.z;
    let added = own_det + trace * least + least * least;
    let per = least * least / added;
    let a = form.x + (form.z + least) * per;
    let c = form.z + (form.x + least) * per;
    let det = (own_det + trace * least) * (own_det / added)
        + (trace * trace - own_det + trace * least + least * least) * per;
    let spread = SPREAD * SPREAD / det;
    let pixel = PIXEL * PIXEL;
    let xx = c * spread + pixel;
    let xy = (form.y - form.y * per) * spread;
    let yy = a * spread + pixel;
    let per_det = 1.0 / (spread * spread * det + spread * (a + c) * pixel + pixel * pixel);
    (*s).form = vec3(yy, xy, xx) * per_det;
    (*s).half = vec2(sqrt(xx), sqrt(yy));
    (*s).weight = sqrt(most * per_det) * (3.0 * PER_DISK);
}
