// What every pass of a frame reads: the plan's lists, one after the other, and the surfels.

struct Frame {
    /// Of the picture, in pixels.
    size: vec2<u32>,
    /// Rows of `plan` where each list begins.
    cameras: u32,
    patches: u32,
    batches: u32,
    chunks: u32,
    deviations: u32,
    owners: u32,
    /// Surfels from this one on show nothing.
    first_hider: u32,
    /// Entries that there is room for.
    capacity: u32,
    push_back: u32,
    first_root: u32,
    chunk_count: u32,
    /// Whether points with an image are counted.
    counts: u32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> plan: array<vec4<u32>>;

fn row(index: u32) -> vec4<f32> {
    return bitcast<vec4<f32>>(plan[index]);
}

/// Which patch a pixel belongs to.
fn owner_of(pixel: u32) -> u32 {
    return plan[frame.owners + pixel / 4u][pixel % 4u];
}

/// One of the surfels that a camera projects.
struct Job {
    exists: bool,
    /// The camera's first row.
    camera: u32,
    surfel: u32,
    stride: u32,
    lambda: vec2<f32>,
    /// Which piece of λ to look for a root in; all of them if `PIECES`.
    piece: u32,
}

const PIECES: u32 = 3u;
/// Set in a chunk's camera if its surfels may have several images.
const SEVERAL: u32 = 0x80000000u;

/// The surfel at `lane` of a chunk. Its batch is found by halving: the chunk's batches follow each other.
fn job_of(chunk: u32, lane: u32, instance: u32) -> Job {
    var job: Job;
    let c = plan[frame.chunks + chunk];
    let number = c.w + lane;
    var low = c.y;
    var high = c.z;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if plan[frame.batches + 2u * middle].x <= number {
            low = middle;
        } else {
            high = middle;
        }
    }
    let batch = plan[frame.batches + 2u * low];
    job.exists = number - batch.x < batch.y;
    job.camera = frame.cameras + (c.x & ~SEVERAL) * CAMERA_ROWS;
    job.surfel = batch.z + (number - batch.x) * batch.w;
    job.stride = batch.w;
    job.lambda = row(frame.batches + 2u * low + 1u).xy;
    job.piece = select(PIECES, instance, (c.x & SEVERAL) != 0u && frame.first_root == 0u);
    return job;
}
