//! Blocks: the mirrors' pixels by 16 x 16, each of which walks the trees once for all its rays.
//!
//! The rays of a block that go on from each other are a [`Beam`]. In the plane of a surfel across the beam's axis each ray lies at a
//! place that is linear in the plane's distance, so that its distance from the surfel is known without solving for anything, on folds and
//! caustics as elsewhere. Trees are walked near parts first ([`walk`]), until a beam's pixels are full; objects before the mirrors that
//! may hide what was found. Surfels become splats for the whole beam ([`project`]), whose shape bends with the rays ([`bounds`]). Then a
//! lane is a pixel: each group of 4 x 4 blends the splats that may reach it, by its exact rays ([`blend`]). A picture's gaps are closed at
//! the end ([`close`]).

mod beam;
mod blend;
mod block;
mod bounds;
mod close;
mod fit;
mod project;
mod seen;
mod splats;
#[cfg(test)]
mod tests;
mod walk;

use std::time::Instant;

use fearless_simd::{Simd, dispatch};
use glam::{DVec2, Vec3, Vec4};
use rayon::prelude::*;

use self::beam::{Beam, Place, image_near};
use self::block::{BLOCK, Block, GROUP};
use self::close::{Layer, Picture, Tile};
use self::seen::{Room, Seen};
use self::walk::{Walk, clouds_met};
use super::super::FrameInput;
use super::cameras::{self, CameraSettings, Top};
use super::cells::sees_nothing;
use crate::accel::kd_tree::{CHILDREN, WideNode};
use crate::context::Context;
use crate::error::Result;
use crate::image::{Planes, Reason};
use crate::plan::pool::Pool;
use crate::plan::{GatherCounts, GatherKernel, GatherTimes, Reflection};
use crate::visibility::mirror_rays::{AREA, RayField, TILE, TILE_PX};

/// See [`cameras::CONTACT`].
#[expect(clippy::cast_possible_truncation, reason = "rounded once")]
const CONTACT: f32 = cameras::CONTACT as f32;

pub(super) struct Kernel<'a> {
    pub(super) frame: FrameInput<'a>,
    pub(super) settings: CameraSettings,
}

/// Memory of a thread.
struct Scratch {
    field: Box<RayField>,
    beam: Beam,
    room: Room,
    met: Vec<Met>,
}

/// A cloud that a beam may meet, from where on its axis.
#[derive(Clone, Copy)]
struct Met {
    near: f32,
    cloud: usize,
}

/// What the nearest splat of a pixel shows.
#[derive(Clone, Copy)]
struct Shown {
    pixel: usize,
    surfel: u32,
    lambda: f32,
    /// Where it is seen.
    splat: [f32; 2],
}

/// What all beams share.
struct Shared {
    top: Top,
    places: Vec<Place>,
    /// Mirrors hide from that far on along a ray.
    clear: f32,
    detail: f32,
}

impl GatherKernel for Kernel<'_> {
    fn gather(&self, out: &mut Reflection, cx: &Context) -> Result<GatherTimes> {
        let size = self.frame.eye.size;
        let scene = self.frame.scene;
        let shared = Shared {
            top: Top::new(scene, self.frame.eye),
            places: scene.clouds.iter().map(|c| Place::new(&c.to_scene)).collect(),
            clear: scene.mirror_clearance(),
            #[expect(clippy::cast_possible_truncation, reason = "a small number")]
            detail: self.settings.detail as f32,
        };
        let describes = out.planes.is_some();
        let across = Picture::across(size);
        let count = across * size.height.div_ceil(TILE_PX) as usize;
        // Rayon's `map_init` would make one for each tile.
        let spare = Pool::<Option<Box<Scratch>>>::default();
        let done: Vec<Result<Done>> = (0..count)
            .into_par_iter()
            .with_max_len(1)
            .map(|tile| {
                cx.check()?;
                let at = |i: usize| u32::try_from(i).unwrap_or(u32::MAX) * TILE_PX;
                let origin = [at(tile % across), at(tile / across)];
                let work = Work { kernel: self, shared: &shared, origin, describes };
                let mut spare = spare.take();
                let scratch = spare.get_or_insert_with(Scratch::new);
                Ok(dispatch!(shared.top.level, simd => work.run(simd, scratch)))
            })
            .collect();
        let mut counts = GatherCounts::default();
        let (mut tiles, mut shown) = (Vec::with_capacity(count), Vec::new());
        for done in done {
            let Done { tile, shown: list, counts: more } = done?;
            counts = counts.plus(more);
            tiles.push(tile);
            shown.extend(list);
        }
        fill_in(Picture { size, tiles: &tiles }, out);
        if let Some(planes) = out.planes.as_deref_mut() {
            planes.coverage.copy_from_slice(&out.coverage);
            self.describe(&shown, planes);
        }
        Ok(GatherTimes { surfels: Some(counts), ..GatherTimes::default() })
    }
}

/// Closes gaps, and writes the reflection. Where nothing is seen the coverage is 0, and the radiance whatever it was.
fn fill_in(picture: Picture<'_>, out: &mut Reflection) {
    let size = picture.size;
    out.radiance.resize(size.pixels(), Vec3::ZERO);
    out.coverage.resize(size.pixels(), 0.0);
    let (width, across) = (size.width as usize, Picture::across(size));
    let rows = out.radiance.par_chunks_mut(width).zip(out.coverage.par_chunks_mut(width));
    rows.with_min_len(4).enumerate().for_each(|(y, (radiance, coverage))| {
        let tiles = &picture.tiles[y / TILE * across..][..across];
        let pixels = radiance.chunks_mut(TILE).zip(coverage.chunks_mut(TILE));
        for (i, (tile, (radiance, coverage))) in tiles.iter().zip(pixels).enumerate() {
            if tile.is_none() {
                coverage.fill(0.0);
                continue;
            }
            for (column, (radiance, coverage)) in radiance.iter_mut().zip(coverage).enumerate() {
                let value = picture.closed([i * TILE + column, y]);
                (*radiance, *coverage) = (value.truncate(), value.w);
            }
        }
    });
}

impl Scratch {
    fn new() -> Box<Self> {
        Box::new(Self {
            field: RayField::new(),
            beam: Beam::empty(),
            room: Room::default(),
            met: Vec::new(),
        })
    }
}

impl Kernel<'_> {
    /// Says what was seen.
    fn describe(&self, shown: &[Shown], planes: &mut Planes) {
        let scene = self.frame.scene;
        for &Shown { pixel, surfel, lambda, splat } in shown {
            let cloud = scene.cloud_of_surfel(surfel);
            let to_scene = &scene.objects[cloud].to_scene;
            let position = scene.surfels.position(surfel as usize).as_dvec3();
            let normal = scene.surfels.normals[surfel as usize].as_dvec3();
            let world = to_scene.point(position) + scene.origin;
            planes.position[pixel] = world.as_vec3().to_array();
            planes.normal[pixel] = to_scene.direction(normal).as_vec3().to_array();
            planes.lambda[pixel] = lambda;
            planes.splat[pixel] = splat;
            planes.object[pixel] = u32::try_from(cloud).expect("fewer than 2^32 objects");
            planes.surfel[pixel] = surfel;
            planes.reason[pixel] = Reason::Object as u32;
        }
    }
}

/// What one tile comes to.
struct Done {
    tile: Option<Box<Tile>>,
    shown: Vec<Shown>,
    counts: GatherCounts,
}

/// The work on one tile.
struct Work<'a> {
    kernel: &'a Kernel<'a>,
    shared: &'a Shared,
    /// Its first column and row.
    origin: [u32; 2],
    /// Whether it is wanted what each pixel shows.
    describes: bool,
}

impl Work<'_> {
    #[inline(always)]
    fn run<S: Simd>(&self, simd: S, scratch: &mut Scratch) -> Done {
        let mut done = Done { tile: None, shown: Vec::new(), counts: GatherCounts::default() };
        self.tile(simd, scratch, &mut done);
        done
    }

    #[inline(always)]
    fn tile<S: Simd>(&self, simd: S, scratch: &mut Scratch, out: &mut Done) {
        let FrameInput { scene, eye, visibility } = self.kernel.frame;
        let (shared, origin) = (self.shared, self.origin);
        let counts = &mut out.counts;
        let mut watch = Watch::new();
        let Scratch { field, beam, room, met } = scratch;
        let shown = field.enter(simd, eye, visibility, origin);
        if shown == [0; TILE] {
            return;
        }
        let top = &shared.top;
        if sees_nothing(simd, self.kernel.frame, top, origin, field, &shown, self.kernel.settings) {
            counts.cameras_ns += watch.lap();
            return;
        }
        field.fill(eye, scene, &shown);
        let nothing =
            || Box::new(Tile { value: [Vec4::ZERO; AREA], layer: [Layer::default(); AREA] });
        let tile = out.tile.get_or_insert_with(nothing);
        for y in (0..TILE).step_by(BLOCK) {
            for x in (0..TILE).step_by(BLOCK) {
                let mut block = Block::new(&shown, [x, y]);
                while let Some(at) = block.seed() {
                    let tangent = field.tangent(eye, scene, at);
                    beam.aim(simd, eye, field, &tangent, &block, at);
                    block.take(&beam.pixels);
                    counts.patches += 1;
                    self.meet(simd, top, beam, met);
                    let mut seen = None;
                    if !met.is_empty() {
                        counts.cameras_ns += watch.lap();
                        let mut all = Seen::new(simd, room, beam, shared.clear);
                        self.walk(simd, beam, met, &mut all, counts);
                        counts.walk_ns += watch.lap();
                        if !all.order.is_empty() {
                            all.sort();
                            seen = Some(all);
                        }
                    }
                    for (group, own) in beam.pixels.into_iter().enumerate() {
                        if own == 0 {
                            continue;
                        }
                        let corner = block.corner_of(group);
                        // Not by `map`: what a closure does may be compiled for no instruction set in particular.
                        let mut done = None;
                        if let Some(seen) = &seen {
                            done = Some(seen.blend(simd, beam, group, self.describes));
                        }
                        for lane in bits(own) {
                            let [column, row] =
                                [corner[0] + lane % GROUP, corner[1] + lane / GROUP];
                            let at = row * TILE + column;
                            let Some(done) = &done else {
                                tile.layer[at].open = 1.0;
                                continue;
                            };
                            tile.layer[at] = done.layer(lane);
                            if done.shown[lane] > 0.0 {
                                tile.value[at] = done.value(lane);
                            }
                        }
                        if let (true, Some(seen), Some(done)) = (self.describes, &seen, &done) {
                            for lane in bits(own).filter(|lane| done.shown[*lane] > 0.0) {
                                let px = [corner[0] + lane % GROUP, corner[1] + lane / GROUP];
                                let first = done.first[lane].to_bits() as usize;
                                out.shown.push(self.shown(field, beam, seen, px, first));
                            }
                        }
                    }
                    if seen.is_some() {
                        counts.splat_ns += watch.lap();
                    }
                }
            }
        }
        counts.cameras_ns += watch.lap();
    }

    /// What a pixel (column and row of the tile) shows first: a splat of a beam.
    fn shown(
        &self,
        field: &mut RayField,
        beam: &Beam,
        seen: &Seen<'_>,
        [column, row]: [usize; 2],
        splat: usize,
    ) -> Shown {
        let FrameInput { scene, eye, .. } = self.kernel.frame;
        let place = beam.place(seen.splats.place(splat));
        let tangent = field.tangent(eye, scene, [column, row]);
        let image = image_near(eye, field, &tangent, [column, row], place);
        let (off, lambda) = image.unwrap_or_default();
        let px = [self.origin[0] as usize + column, self.origin[1] as usize + row];
        Shown {
            pixel: px[1] * eye.size.width as usize + px[0],
            surfel: seen.splats.surfel(splat),
            #[expect(clippy::cast_possible_truncation, reason = "to be kept")]
            lambda: lambda as f32,
            splat: (DVec2::new(px[0] as f64 + 0.5, px[1] as f64 + 0.5) + off).as_vec2().to_array(),
        }
    }

    /// The objects that a beam may meet, from the nearest on.
    #[inline(always)]
    fn meet<S: Simd>(&self, simd: S, top: &Top, beam: &Beam, met: &mut Vec<Met>) {
        met.clear();
        let range = [beam.first - CONTACT * beam.length, f32::MAX];
        add_met(simd, beam, &top.objects, &top.reaches, range, 0, met);
        met.sort_unstable_by(|a, b| a.near.total_cmp(&b.near).then(a.cloud.cmp(&b.cloud)));
    }

    /// Walks the trees of the objects in `met`, then those of mirrors that may hide what was found.
    #[inline(always)]
    fn walk<S: Simd>(
        &self,
        simd: S,
        beam: &Beam,
        met: &mut Vec<Met>,
        seen: &mut Seen<'_>,
        counts: &mut GatherCounts,
    ) {
        let (scene, shared) = (self.kernel.frame.scene, self.shared);
        let objects = scene.objects.len();
        let first = beam.first - CONTACT * beam.length;
        for met in met.iter() {
            if met.near > seen.full_from {
                break;
            }
            self.walk_cloud(simd, beam, met.cloud, [first, f32::MAX], seen, counts);
        }
        if !self.kernel.settings.mirror_occlusion || seen.order.is_empty() {
            return;
        }
        met.clear();
        let top = &shared.top;
        let range = [beam.first + seen.clear, seen.farthest()];
        if range[0] < range[1] {
            let reaches = &top.reaches[top.objects.len()..];
            add_met(simd, beam, &top.mirrors, reaches, range, objects, met);
            for met in met.iter() {
                self.walk_cloud(simd, beam, met.cloud, range, seen, counts);
            }
        }
    }

    #[inline(always)]
    fn walk_cloud<S: Simd>(
        &self,
        simd: S,
        beam: &Beam,
        cloud: usize,
        [first, last]: [f32; 2],
        seen: &mut Seen<'_>,
        counts: &mut GatherCounts,
    ) {
        let (scene, shared) = (self.kernel.frame.scene, self.shared);
        let hides = cloud >= scene.objects.len();
        let frame = beam.frame(&shared.places[cloud]);
        let cloud = &scene.clouds[cloud];
        let k = frame.per_scene;
        let inside = cloud.tree.bounds().contains(Vec3::from_array(frame.origin));
        // Rays that leave a mirror's outside are hidden by what faces them of it.
        let leaves = hides && {
            let mirror = scene.mirror_triangle(beam.triangle);
            !mirror.is_seen_from_behind(self.kernel.frame.eye.position)
        };
        let mut walk = Walk {
            beam,
            frame,
            cloud,
            surfels: &scene.surfels,
            looks: &scene.looks,
            range: [first * k, last.min(seen.full_from) * k],
            detail: shared.detail,
            front_only: cloud.closed && (leaves || !inside),
            hides,
        };
        counts.cameras += 1;
        walk.run(simd, seen, counts);
    }
}

/// Adds the clouds of some groups that a beam may meet in a range of its axis. `first`: the first group's first cloud.
#[inline(always)]
fn add_met<S: Simd>(
    simd: S,
    beam: &Beam,
    groups: &[WideNode],
    reaches: &[[f32; CHILDREN]],
    range: [f32; 2],
    first: usize,
    met: &mut Vec<Met>,
) {
    for (g, (group, reach)) in groups.iter().zip(reaches).enumerate() {
        let (mut bits, near) = clouds_met(simd, beam, group, reach, range);
        while bits != 0 {
            let slot = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            met.push(Met { near: near[slot], cloud: first + g * CHILDREN + slot });
        }
    }
}

/// The numbers of the bits that are set.
fn bits(mut of: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let next = (of != 0).then_some(of.trailing_zeros() as usize);
        of &= of.wrapping_sub(1);
        next
    })
}

/// Time since the last lap.
struct Watch(Instant);

impl Watch {
    fn new() -> Self {
        Self(Instant::now())
    }

    fn lap(&mut self) -> u64 {
        let now = Instant::now();
        let lap = u64::try_from((now - self.0).as_nanos()).unwrap_or(u64::MAX);
        self.0 = now;
        lap
    }
}
