// Projection in a vertex shader. Splats of one pixel are points; all others are quads that cover whole pixels.

struct Corner {
    @builtin(position) position: vec4<f32>,
    /// Of an ellipse: in the picture.
    @location(0) @interpolate(flat) middle: vec2<f32>,
    @location(1) @interpolate(flat) form: vec3<f32>,
    @location(2) @interpolate(flat) values: vec3<f32>,
    /// Surfel, patch, which pixels it only fills, first pixel.
    @location(3) @interpolate(flat) ids: vec3<u32>,
    @location(4) @interpolate(flat) first: vec2<i32>,
}

@vertex
fn splat_corner(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Corner {
    var out: Corner;
    // Outside of everything.
    out.position = vec4(2.0, 2.0, 0.0, 1.0);
    let number = index / CORNERS;
    let corner = index % CORNERS;
    let job = job_of(number / CHUNK, number % CHUNK, instance);
    if !job.exists {
        return out;
    }
    var s: Splat;
    let place = vec3(surfel_x[job.surfel], surfel_y[job.surfel], surfel_z[job.surfel]);
    let q = place - row(job.camera + V1).xyz;
    let images = images_of(job.camera, q, job.lambda);
    if job.piece < images.pieces.count {
        s = splat_of(job, project(job.camera, images, job.piece));
    } else if job.piece == PIECES {
        for (var piece = 0u; piece < images.pieces.count; piece++) {
            let image = project(job.camera, images, piece);
            s = splat_of(job, image);
            if s.drawn || (frame.first_root != 0u && is_seen(job.camera, image)) {
                break;
            }
        }
    }
    if !s.drawn {
        return out;
    }
    // The picture's pixel (0, 0) in the tile.
    let zero = vec2<f32>(s.origin) - 1.0;
    var low = s.middle;
    var high = s.middle + f32(SIDE);
    if ELLIPSE {
        low = ceil(s.middle - s.half - 0.5);
        high = floor(s.middle + s.half - 0.5) + 1.0;
    }
    // Only the patch's pixels: not its border.
    low = max(low, vec2(1.0));
    high = min(high, vec2<f32>(s.size) + 1.0);
    if any(low >= high) {
        return out;
    }
    let far = vec2(corner == 1u || corner >= 4u, corner == 2u || corner == 3u || corner == 5u);
    var at = select(low, high, far) + zero;
    if CORNERS == 1u {
        at = low + zero + 0.5;
    }
    let clip = at / vec2<f32>(frame.size) * 2.0 - 1.0;
    out.position = vec4(clip.x, -clip.y, 0.5, 1.0);
    out.middle = s.middle + zero;
    out.form = s.form;
    out.values = vec3(s.weight, s.range, s.depth);
    out.ids = vec3(s.surfel, s.owner, s.fills);
    out.first = vec2<i32>(s.middle + zero);
    return out;
}

fn pixel_of(position: vec4<f32>) -> vec2<u32> {
    return vec2<u32>(position.xy);
}
