// From a point to its images in one camera. A camera's rows are those of backend/gpu/records.rs.

struct Image {
    lambda: f32,
    b2: f32,
    b3: f32,
    found: bool,
}

/// form.x + b2 form.y + b3 form.z.
fn linear(image: Image, form: vec3<f32>) -> f32 {
    return image.b2 * form.y + image.b3 * form.z + form.x;
}

/// Lanes in which all three weights are at least -margin.
fn within(image: Image, margin: vec3<f32>) -> bool {
    let b1 = 1.0 - image.b2 - image.b3;
    return image.found && -margin.x <= b1 && -margin.y <= image.b2 && -margin.z <= image.b3;
}

fn cubic(camera: u32, q: vec3<f32>) -> vec4<f32> {
    let n0 = row(camera + N0);
    let n1 = row(camera + N1);
    let n2 = row(camera + N2);
    return vec4(dot(q, n0.xyz), dot(q, n1.xyz) - n0.w, dot(q, n2.xyz) - n1.w, -n2.w);
}

fn size_of(v: vec3<f32>) -> f32 {
    return abs(v.x) + abs(v.y) + abs(v.z);
}

/// How far from zero the cubic of `q` may turn round at λ and still have a double root: by rounding, and within the disk.
fn noise(camera: u32, q: vec3<f32>, lambda: f32) -> f32 {
    let n0 = row(camera + N0).xyz;
    let n1 = row(camera + N1).xyz;
    let n2 = row(camera + N2).xyz;
    let normal = lambda * (lambda * size_of(n2) + size_of(n1)) + size_of(n0);
    let reach = size_of(q) + abs(lambda) * size_of(row(camera + D1).xyz);
    return normal * reach * NOISE + length(lambda * (lambda * n2 + n1) + n0) * row(camera + V1).w;
}

/// Narrows λ to where v1 + `q` can have an image in the grown camera.
fn bracket(camera: u32, q: vec3<f32>, lambda: vec2<f32>) -> vec2<f32> {
    let axis = row(camera + AXIS);
    if axis.w != 0.0 {
        return lambda;
    }
    let ends = (vec4(dot(q, axis.xyz)) - row(camera + START)) * row(camera + PER_AXIS);
    let size = abs(ends);
    let slack = (size.x + size.y + size.z + size.w) * 1e-5;
    let least = min(min(ends.x, ends.y), min(ends.z, ends.w));
    let most = max(max(ends.x, ends.y), max(ends.z, ends.w));
    return vec2(max(least - slack, lambda.x), min(most + slack, lambda.y));
}

fn image_at(camera: u32, q: vec3<f32>, root: Root) -> Image {
    let lambda = root.lambda;
    let e1 = lambda * row(camera + F1).xyz + row(camera + E1).xyz;
    let e2 = lambda * row(camera + F2).xyz + row(camera + E2).xyz;
    let x = q - lambda * row(camera + D1).xyz;
    let n = cross(e1, e2);
    let nn = dot(n, n);
    let solid = 0.0 < nn;
    let inverse = 1.0 / select(1.0, nn, solid);
    return Image(lambda, dot(cross(x, e2), n) * inverse, dot(cross(e1, x), n) * inverse, root.found && solid);
}

/// A point's cubic and where its roots may be: one image a piece.
struct Images {
    q: vec3<f32>,
    cubic: vec4<f32>,
    pieces: Pieces,
}

/// Of the point v1 + `q` with λ in a range.
fn images_of(camera: u32, q: vec3<f32>, lambda: vec2<f32>) -> Images {
    let c = cubic(camera, q);
    let narrow = bracket(camera, q, lambda);
    return Images(q, c, pieces_between(c, narrow.x, narrow.y));
}

/// The image whose λ lies in one of the pieces.
fn project(camera: u32, images: Images, piece: u32) -> Image {
    var root = root_in_piece(images.cubic, images.pieces, piece);
    if !root.found && images.pieces.count > 1u {
        let p = images.pieces.ends.y;
        let q = images.pieces.ends.z;
        let noise_at = vec2(noise(camera, images.q, p), noise(camera, images.q, q));
        root = double_root(images.cubic, images.pieces, piece, noise_at);
    }
    if !root.found {
        return Image(root.lambda, 0.0, 0.0, false);
    }
    return image_at(camera, images.q, root);
}
