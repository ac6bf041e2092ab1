//! A splat pass as rows of four words: what the shaders read of cameras, patches, batches and pixels.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use crate::backend::ExecuteReport;
use crate::plan::{CameraInstance, DepthKey, SplatPass};
use crate::visibility::Visibility;

/// Four words.
pub(super) type Row = [u32; 4];

/// Surfels of a chunk: a workgroup.
pub(super) const CHUNK: u32 = 64;
/// Set in a chunk's camera if its surfels may have several images.
const SEVERAL: u32 = 1 << 31;
/// No patch's pixel.
pub(super) const NO_OWNER: u32 = u32::MAX;

/// Rows of a camera and what stands in them, for the shaders. Where a vector has three numbers the fourth is another
/// quantity: see [`camera_rows`].
pub(super) const LAYOUT: [(&str, u32); 22] = [
    ("V1", 0),
    ("D1", 1),
    ("E1", 2),
    ("E2", 3),
    ("F1", 4),
    ("F2", 5),
    ("N0", 6),
    ("N1", 7),
    ("N2", 8),
    ("AXIS", 9),
    ("START", 10),
    ("PER_AXIS", 11),
    ("DIRECTION", 12),
    ("ROTATION", 15),
    ("SCREEN", 18),
    ("PER_PX", 21),
    ("FRONT", 25),
    ("GUARD", 26),
    ("FROM_EYE", 27),
    ("IDS", 30),
    ("CAMERA_ROWS", 31),
    ("CHUNK", CHUNK),
];
const CAMERA_ROWS: usize = 31;

/// The numbers of a frame; as `Frame` in `shaders/plan.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Frame {
    pub(super) size: [u32; 2],
    pub(super) cameras: u32,
    pub(super) patches: u32,
    pub(super) batches: u32,
    pub(super) chunks: u32,
    pub(super) deviations: u32,
    pub(super) owners: u32,
    pub(super) first_hider: u32,
    pub(super) capacity: u32,
    pub(super) push_back: u32,
    pub(super) first_root: u32,
    pub(super) chunk_count: u32,
    pub(super) counts: u32,
    pub(super) padding: [u32; 2],
}

/// Chunks whose surfels have one image at most, and the others behind them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Chunks {
    pub(super) single: u32,
    pub(super) several: u32,
    /// Of those several only the first counts.
    pub(super) first_root: bool,
}

impl Chunks {
    pub(super) fn all(self) -> u32 {
        self.single + self.several
    }

    /// Vertices of the quads of all; `None` if they cannot be counted in a draw.
    pub(super) fn vertices(self) -> Option<u32> {
        self.all().checked_mul(6 * CHUNK)
    }
}

/// The rows of one frame; reused.
#[derive(Default)]
pub(super) struct Records {
    rows: Vec<Row>,
    frame: Frame,
    chunks: Chunks,
    owners: Vec<u32>,
    parts: Vec<Part>,
}

/// What some cameras give.
#[derive(Default)]
struct Part {
    batches: Vec<Row>,
    single: Vec<Row>,
    several: Vec<Row>,
    list: Vec<crate::plan::Batch>,
    surfels: u64,
    nanoseconds: u64,
}

/// Cameras that a task culls.
const CAMERAS: usize = 32;

impl Records {
    /// Culls, and lists everything; the report has what is known by then. `None` if there are more than `most` rows: they
    /// are not all made first.
    pub(super) fn fill(
        &mut self,
        pass: &SplatPass<'_>,
        visibility: &Visibility,
        most: u32,
    ) -> Option<ExecuteReport> {
        let size = visibility.size;
        let tasks = pass.cameras.len().div_ceil(CAMERAS);
        if self.parts.len() < tasks {
            self.parts.resize_with(tasks, Part::default);
        }
        let lists = pass.cameras.par_chunks(CAMERAS).zip(&mut self.parts).enumerate();
        let rows = AtomicUsize::new(pass.cameras.len() * CAMERA_ROWS);
        let most = most as usize;
        lists.for_each(|(task, (cameras, part))| {
            part.fill(pass, task * CAMERAS, cameras, &rows, most);
        });
        if rows.into_inner() > most {
            // Their memory too.
            self.parts.clear();
            return None;
        }
        let parts = &self.parts[..tasks];

        let rows = &mut self.rows;
        rows.clear();
        let mut frame = Frame {
            size: [size.width, size.height],
            first_hider: pass.first_hider,
            push_back: u32::from(pass.depth == DepthKey::PushBack),
            first_root: u32::from(pass.first_root_only),
            ..Frame::default()
        };
        frame.cameras = index(rows.len());
        rows.resize(rows.len() + pass.cameras.len() * CAMERA_ROWS, [0; 4]);
        let to = rows.par_chunks_exact_mut(CAMERA_ROWS);
        to.zip(&pass.cameras).for_each(|(to, camera)| to.copy_from_slice(&camera_rows(camera)));
        frame.patches = index(rows.len());
        for patch in &pass.patches {
            let [left, top] = patch.rect.min;
            rows.push([left, top, patch.rect.width(), patch.rect.height()]);
            let own = patch.own.map_or([0, 0], |own| [1, own.first_pixel]);
            rows.push([own[0], own[1], 0, 0]);
        }
        frame.batches = index(rows.len());
        let mut firsts = Vec::with_capacity(parts.len());
        let mut batches = 0;
        for part in parts {
            firsts.push(batches);
            batches += index(part.batches.len() / 2);
            rows.extend_from_slice(&part.batches);
        }
        frame.chunks = index(rows.len());
        for list in [|p: &Part| &p.single, |p: &Part| &p.several] as [fn(&Part) -> &Vec<Row>; 2] {
            for (part, first) in parts.iter().zip(&firsts) {
                let moved =
                    |&[camera, from, to, begin]: &Row| [camera, from + first, to + first, begin];
                rows.extend(list(part).iter().map(moved));
            }
        }
        let count = |list: fn(&Part) -> usize| index(parts.iter().map(list).sum());
        self.chunks = Chunks {
            single: count(|p| p.single.len()),
            several: count(|p| p.several.len()),
            first_root: pass.first_root_only,
        };
        frame.chunk_count = self.chunks.all();
        frame.deviations = index(rows.len());
        let bits = |v: &[f32; 3]| [v[0].to_bits(), v[1].to_bits(), v[2].to_bits(), 0];
        rows.extend(pass.pixels.deviations.iter().map(bits));
        frame.owners = index(rows.len());
        owners(pass, visibility, &mut self.owners);
        rows.extend(self.owners.chunks_exact(4).map(|o| [o[0], o[1], o[2], o[3]]));
        self.frame = frame;

        let threads = rayon::current_num_threads() as f64;
        Some(ExecuteReport {
            cameras: Some(pass.cameras.len()),
            patches: pass.patches.len(),
            batches: Some(u64::from(batches)),
            projections: Some(parts.iter().map(|p| p.surfels).sum()),
            cull_ms: Some(parts.iter().map(|p| p.nanoseconds).sum::<u64>() as f64 * 1e-6 / threads),
            ..ExecuteReport::default()
        })
    }

    pub(super) fn rows(&self) -> &[Row] {
        &self.rows
    }

    pub(super) fn chunks(&self) -> Chunks {
        self.chunks
    }

    pub(super) fn frame(&self, capacity: u32, counts: bool) -> Frame {
        Frame { capacity, counts: u32::from(counts), ..self.frame }
    }
}

impl Part {
    fn fill(
        &mut self,
        pass: &SplatPass<'_>,
        first: usize,
        cameras: &[CameraInstance],
        rows: &AtomicUsize,
        most: usize,
    ) {
        let start = Instant::now();
        self.batches.clear();
        self.single.clear();
        self.several.clear();
        self.surfels = 0;
        let mut list = std::mem::take(&mut self.list);
        for (i, camera) in cameras.iter().enumerate() {
            if rows.load(Ordering::Relaxed) > most {
                break;
            }
            list.clear();
            let before = self.rows();
            pass.batches.cull(camera, &mut list);
            self.surfels += list.iter().map(|b| u64::from(b.count)).sum::<u64>();
            for several in [false, true] {
                self.run(index(first + i), several, &list);
            }
            rows.fetch_add(self.rows() - before, Ordering::Relaxed);
        }
        self.list = list;
        self.nanoseconds = u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX);
    }

    fn rows(&self) -> usize {
        self.batches.len() + self.single.len() + self.several.len()
    }

    /// Numbers the surfels of a camera's batches that may have `several` images, or not, and cuts them into chunks.
    fn run(&mut self, camera: u32, several: bool, list: &[crate::plan::Batch]) {
        let chunks = if several { &mut self.several } else { &mut self.single };
        let camera = if several { camera | SEVERAL } else { camera };
        let mut count = 0;
        for batch in list.iter().filter(|b| (b.roots > 1) == several) {
            let own = index(self.batches.len() / 2);
            // The last chunk has it too, and those that begin in it.
            if let Some(last) = chunks.last_mut().filter(|c| c[0] == camera && count < c[3] + CHUNK)
            {
                last[2] = own + 1;
            }
            let end = count + batch.count;
            let mut begin = count.next_multiple_of(CHUNK);
            while begin < end {
                chunks.push([camera, own, own + 1, begin]);
                begin += CHUNK;
            }
            self.batches.push([count, batch.count, batch.first, batch.stride]);
            let [lo, hi] = batch.lambda.map(f32::to_bits);
            self.batches.push([lo, hi, 0, 0]);
            count = end;
        }
    }
}

fn index(count: usize) -> u32 {
    u32::try_from(count).expect("a plan has fewer than 2^32 rows")
}

/// Which patch each pixel belongs to; whole rows of four.
fn owners(pass: &SplatPass<'_>, visibility: &Visibility, out: &mut Vec<u32>) {
    out.clear();
    out.resize(visibility.size.pixels().next_multiple_of(4), NO_OWNER);
    let width = visibility.size.width;
    for (i, patch) in (0u32..).zip(&pass.patches) {
        for y in patch.rect.min[1]..patch.rect.max[1] {
            for x in patch.rect.min[0]..patch.rect.max[0] {
                if patch.owns(visibility, &pass.pixels.rows, x, y) {
                    out[(y * width + x) as usize] = i;
                }
            }
        }
    }
}

/// See [`LAYOUT`].
pub(super) fn camera_rows(c: &CameraInstance) -> [Row; CAMERA_ROWS] {
    let three = |v: [f32; 3], w: f32| [v[0], v[1], v[2], w].map(f32::to_bits);
    let flag = |on: bool| if on { 1.0 } else { 0.0 };
    let t = &c.camera;
    let [base, per_lambda] = c.per_px;
    [
        three(t.v1, t.disk),
        three(t.d1, c.radius),
        three(t.e1, c.extent),
        three(t.e2, flag(c.gaze.is_some())),
        three(t.f1, 0.0),
        three(t.f2, 0.0),
        three(t.n0, t.nd[0]),
        three(t.n1, t.nd[1]),
        three(t.n2, t.nd[2]),
        three(t.axis, flag(t.wide)),
        t.start.map(f32::to_bits),
        t.per_axis.map(f32::to_bits),
        three(c.direction[0], 0.0),
        three(c.direction[1], 0.0),
        three(c.direction[2], 0.0),
        three(c.rotation[0], 0.0),
        three(c.rotation[1], 0.0),
        three(c.rotation[2], 0.0),
        three(c.screen[0], 0.0),
        three(c.screen[1], 0.0),
        three(c.screen[2], 0.0),
        three(base[0], 0.0),
        three(base[1], 0.0),
        three(per_lambda[0], 0.0),
        three(per_lambda[1], 0.0),
        three(c.front, 0.0),
        three(c.guard, 0.0),
        three(c.from_eye[0], 0.0),
        three(c.from_eye[1], 0.0),
        three(c.from_eye[2], 0.0),
        [c.patch, c.representatives, 0, 0],
    ]
}
