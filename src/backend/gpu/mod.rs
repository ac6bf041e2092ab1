//! The GPU backend: culled on the CPU, projected and splatted through wgpu. Surfels are uploaded once; per frame only
//! the plan crosses the bus, and the reflection comes back.
//!
//! What a vertex or compute shader does is in `shaders/`, in files of the same names as the Rust code that they are
//! twins of.

mod adapters;
mod buffers;
mod device;
mod environment;
mod look;
mod pipelines;
mod records;
mod reflected;
mod scene;
mod search;
mod shaders;
mod surfaces;
#[cfg(test)]
mod tests;
mod timing;

use std::cell::RefCell;
use std::sync::Arc;
use std::time::Instant;

use glam::{Vec3, Vec4};

pub use self::adapters::{Adapter, adapters, features, may_be_there};
use self::buffers::{ENTRY_BYTES, Grown, PictureBuffers};
use self::device::Gpu as Device;
pub use self::device::Limits;
use self::look::Composer;
use self::pipelines::{Groups, Pipelines};
use self::records::Records;
use self::scene::SceneBuffers;
use self::search::{OnDevice, Searcher};
use self::timing::Timing;
use super::cpu::finish::finish;
use super::cpu::lookup::{Asked, lookup};
use super::cpu::planes::{mark_mirrors, splat_planes};
use super::cpu::search::search;
use super::cpu::splat::{EMPTY, Landed};
use super::{Backend, ExecuteReport};
use crate::camera::Eye;
use crate::error::{Error, Result};
use crate::image::{Picture, Planes};
use crate::plan::{EnvironmentCube, Pass, Plan, Reflection, SplatPass, SplatShape};
use crate::scene::description::Paint;
use crate::scene::prepared::{PreparedScene, milliseconds};
use crate::visibility::Visibility;
/// What [`Gpu::on_device`] takes.
pub use wgpu;

/// How splats are projected and drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Path {
    /// In a vertex shader, as in the paper: points and quads, drawn by the rasteriser.
    Vertex,
    /// In a compute shader.
    #[default]
    Compute,
}

/// What a [`Gpu`] is made with.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Part of the adapter's name, or its number as listed; `None`: the first one.
    pub adapter: Option<String>,
    /// See [`Path`].
    pub path: Path,
    /// See [`Limits`].
    pub limits: Limits,
    /// Compose the picture on the adapter too; `None`: if it is no software.
    pub composes: Option<bool>,
    /// Count the points with an image, on the compute path; that costs time.
    pub stats: bool,
}

/// The backend; keeps everything on the device between frames.
pub struct Gpu {
    options: Options,
    name: String,
    ready: Option<Ready>,
}

/// Everything on one device; gone when that is lost.
struct Ready {
    gpu: Device,
    pipelines: Vec<(SplatShape, Pipelines)>,
    scene: Option<SceneBuffers>,
    plan: Grown,
    picture: Option<PictureBuffers>,
    /// Of these buffers and pipelines: made when there were so many buffers.
    groups: Option<(usize, usize, Groups)>,
    timing: Option<Timing>,
    composer: Option<Composer>,
    searcher: Option<Searcher>,
    /// The reflection of the last plan is on the device.
    is_here: bool,
    /// The device cannot compose this scene: its placement.
    composed_elsewhere: Option<u64>,
    records: Records,
    /// Entries of the pixels' lists that there is room for.
    capacity: u32,
}

/// Entries that lists begin with.
const FIRST_CAPACITY: u32 = 1 << 20;

impl Gpu {
    /// A backend on an adapter.
    ///
    /// # Errors
    /// There is no such adapter, or it does not give a device.
    pub fn new(options: Options) -> Result<Self> {
        let ready = Ready::new(&options)?;
        Ok(Self { name: ready.gpu.name.clone(), ready: Some(ready), options })
    }

    /// A backend on a device that is open already, a window's for example. It should have what [`features`] says, and the
    /// adapter's limits. Where it is lost, another one is opened as `options` say.
    pub fn on_device(
        adapter: &wgpu::Adapter,
        device: wgpu::Device,
        queue: wgpu::Queue,
        options: Options,
    ) -> Result<Self> {
        let ready = Ready::on(Device::of(adapter, device, queue))?;
        Ok(Self { name: ready.gpu.name.clone(), ready: Some(ready), options })
    }

    /// The adapter's name.
    pub fn adapter(&self) -> &str {
        &self.name
    }

    /// Buffers made on the device since it was opened.
    #[cfg(test)]
    fn allocations(&self) -> usize {
        self.ready.as_ref().map_or(0, |ready| ready.gpu.allocations.get())
    }

    /// Replaces something in all shaders.
    #[cfg(test)]
    fn mutate(&mut self, mutant: [&'static str; 2]) {
        if let Some(ready) = &mut self.ready {
            ready.gpu.mutant = Some(mutant);
        }
    }

    /// Loses the device, as a driver may at any time.
    #[cfg(test)]
    fn lose(&self) {
        if let Some(ready) = &self.ready {
            ready.gpu.device.destroy();
            ready.gpu.wait();
        }
    }
}

impl Ready {
    fn new(options: &Options) -> Result<Self> {
        Self::on(Device::open(options.adapter.as_deref(), options.limits)?)
    }

    fn on(gpu: Device) -> Result<Self> {
        Ok(Self {
            timing: Timing::new(&gpu)?,
            plan: Grown::new(
                "the lists of a frame",
                wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            ),
            gpu,
            pipelines: Vec::new(),
            scene: None,
            picture: None,
            groups: None,
            composer: None,
            searcher: None,
            is_here: false,
            composed_elsewhere: None,
            records: Records::default(),
            capacity: FIRST_CAPACITY,
        })
    }
}

impl Backend for Gpu {
    fn id(&self) -> &'static str {
        "gpu"
    }

    fn device(&self) -> Option<String> {
        let path = match self.options.path {
            Path::Vertex => "vertex",
            Path::Compute => "compute",
        };
        Some(format!("{}, {path} path", self.name))
    }

    fn gathers(&self) -> bool {
        false
    }

    fn execute(
        &mut self,
        plan: &Plan<'_>,
        scene: &PreparedScene,
        visibility: &Visibility,
        planes: bool,
        out: &mut Reflection,
    ) -> Result<ExecuteReport> {
        assert_eq!(plan.missing_resource(), None, "the plan's passes are out of order");
        for again in [true, false] {
            let ready = match &mut self.ready {
                Some(ready) => ready,
                none => none.insert(Ready::new(&self.options)?),
            };
            let done = ready.execute(plan, scene, visibility, planes, &self.options, out);
            let lost = ready.gpu.is_lost();
            if lost {
                // Everything on it is gone.
                self.ready = None;
            }
            if !(lost && again) {
                return done;
            }
        }
        unreachable!("the second try returns")
    }

    fn compose(
        &mut self,
        scene: &PreparedScene,
        eye: &Eye,
        visibility: &Visibility,
        reflection: &mut Reflection,
        white: f32,
        picture: &mut Picture,
    ) {
        let composes = self.options.composes;
        // The shaders know neither textures nor clouds of points yet.
        let knows =
            scene.objects.iter().all(|o| !o.is_cloud && !matches!(o.paint, Paint::Materials(_)));
        let composes = |r: &&mut Ready| knows && composes.unwrap_or(!r.gpu.software);
        let ready = self.ready.as_mut().filter(composes);
        let done = ready.map(|r| r.compose(scene, eye, visibility, reflection, white, picture));
        if !matches!(done, Some(Ok(()))) {
            // Too large for the device, or that is gone: the reflection is here.
            finish(scene, eye, visibility, reflection, white, picture);
        }
    }
}

/// What searches on the device, made when it is first needed.
fn searcher<'a>(own: &'a mut Option<Searcher>, gpu: &Device) -> Result<&'a mut Searcher> {
    Ok(match own {
        Some(searcher) => searcher,
        none => none.insert(Searcher::new(gpu)?),
    })
}

impl Ready {
    fn execute(
        &mut self,
        plan: &Plan<'_>,
        scene: &PreparedScene,
        visibility: &Visibility,
        planes: bool,
        options: &Options,
        out: &mut Reflection,
    ) -> Result<ExecuteReport> {
        let size = visibility.size;
        out.planes = planes.then(|| {
            let mut planes = Box::new(Planes::empty(size.width, size.height));
            mark_mirrors(scene, visibility, &mut planes);
            planes
        });
        out.environment_included = false;
        let mut report = ExecuteReport::default();
        for pass in &plan.passes {
            plan.cx.check()?;
            match pass {
                Pass::Splat(pass) => {
                    report = self.splat(pass, scene, visibility, planes, options, out)?;
                }
                // Splats are resolved where they are drawn.
                Pass::Resolve => {}
                Pass::Search(pass) => {
                    let start = Instant::now();
                    let searcher = searcher(&mut self.searcher, &self.gpu)?;
                    searcher.hold_maps(&self.gpu, &pass.parts)?;
                    let device = OnDevice::new(&self.gpu, searcher);
                    let done = search(pass, scene, visibility, &device, out)?;
                    report.passes_ms = Some(milliseconds(start));
                    done.enter(&mut report);
                    self.is_here = false;
                }
                Pass::Lookup(pass) => {
                    let start = Instant::now();
                    let searcher = RefCell::new(searcher(&mut self.searcher, &self.gpu)?);
                    let read = |cubes: &Arc<Vec<EnvironmentCube>>, asked: &[Asked]| {
                        searcher.borrow_mut().look_up(&self.gpu, cubes, asked)
                    };
                    lookup(pass, scene, visibility, &read, out)?;
                    report.passes_ms = Some(milliseconds(start));
                    self.is_here = false;
                }
                Pass::Gather(_) => {
                    return Err(Error::input(
                        "--backend gpu",
                        "",
                        "this method has no shaders",
                        "use --backend cpu, or auto",
                    ));
                }
            }
        }
        Ok(report)
    }

    fn splat(
        &mut self,
        pass: &SplatPass<'_>,
        scene: &PreparedScene,
        visibility: &Visibility,
        planes: bool,
        options: &Options,
        out: &mut Reflection,
    ) -> Result<ExecuteReport> {
        let version = scene.surfel_version;
        if self.scene.as_ref().is_none_or(|s| s.version != version) {
            // The old one's memory first.
            self.scene = None;
            self.scene = Some(SceneBuffers::new(&self.gpu, scene)?);
        }
        let start = Instant::now();
        let most = self.gpu.most_elements(size_of::<records::Row>());
        let Some(mut report) = self.records.fill(pass, visibility, most) else {
            return Err(Error::input(
                "--backend gpu",
                "",
                format!("there are more surfels to project than {} can be told of", self.gpu.name),
                "use --test slab, a --detail above 0 or a smaller --size, or --backend cpu",
            ));
        };
        let pipelines = match self.pipelines.iter().position(|(shape, _)| *shape == pass.shape) {
            Some(i) => i,
            None => {
                self.pipelines.push((pass.shape, Pipelines::new(&self.gpu, pass.shape)?));
                self.pipelines.len() - 1
            }
        };
        loop {
            let (needed, valid) = self.draw(pipelines, visibility, planes, options)?;
            if needed <= self.capacity {
                report.valid = valid.map(u64::from);
                break;
            }
            // More splats than there was room for: once more, with room.
            let most = self.gpu.most_elements(ENTRY_BYTES);
            if needed > most {
                return Err(Error::input(
                    "--backend gpu",
                    "",
                    format!(
                        "this picture needs {needed} entries for its splats, and {} holds {most}",
                        self.gpu.name
                    ),
                    "use a lower --detail or --size, or --backend cpu",
                ));
            }
            self.capacity = needed.saturating_add(needed / 4).min(most);
        }
        self.read(visibility, out)?;
        self.is_here = true;
        if let Some(timing) = &self.timing {
            let [project, resolve] = timing.milliseconds(&self.gpu)?;
            (report.project_ms, report.splat_ms) = (Some(project), Some(resolve));
        }
        report.passes_ms = Some(milliseconds(start));
        if let Some(list) = &mut out.planes {
            let landed = self.landed(visibility, out.coverage.as_slice())?;
            splat_planes(pass, scene, visibility, &[landed], list);
        }
        Ok(report)
    }

    /// Draws and resolves; returns how many entries lists would have needed, and how many points have an image if that is
    /// counted.
    fn draw(
        &mut self,
        index: usize,
        visibility: &Visibility,
        planes: bool,
        options: &Options,
    ) -> Result<(u32, Option<u32>)> {
        let gpu = &self.gpu;
        let size = visibility.size;
        let side = gpu.limits.max_texture_dimension_2d;
        if options.path == Path::Vertex && size.width.max(size.height) > side {
            return Err(Error::input(
                "--gpu-path vertex",
                "",
                format!("{} draws pictures of up to {side} pixels a side", gpu.name),
                "use --gpu-path compute, a smaller --size, or --backend cpu",
            ));
        }
        let chunks = self.records.chunks();
        if options.path == Path::Vertex && chunks.vertices().is_none() {
            return Err(Error::input(
                "--gpu-path vertex",
                "",
                "there are more surfels to project than one draw takes",
                "use --gpu-path compute, or --backend cpu",
            ));
        }
        let pipelines = &self.pipelines[index].1;
        let lists = pipelines.shape == SplatShape::Ellipse;
        let rows = self.records.rows();
        self.plan.hold(gpu, size_of_val(rows) as u64)?;
        if self.picture.as_ref().is_none_or(|p| !p.fits(size, self.capacity, lists)) {
            self.picture = None;
            self.picture = Some(PictureBuffers::new(gpu, size, self.capacity, lists)?);
        }
        let scene = self.scene.as_ref().expect("it was uploaded");
        let picture = self.picture.as_ref().expect("it was made");
        let made = (index, gpu.allocations.get());
        if self.groups.as_ref().is_none_or(|(index, count, _)| (*index, *count) != made) {
            let groups =
                gpu.checked(|| pipelines.groups(gpu, scene, self.plan.buffer(), picture))?;
            self.groups = Some((made.0, made.1, groups));
        }
        let counts = options.stats && options.path == Path::Compute;
        let path = options.path;
        let groups = &self.groups.as_ref().expect("they were made").2;
        gpu.checked(|| {
            gpu.queue.write_buffer(self.plan.buffer(), 0, bytemuck::cast_slice(rows));
            let frame = self.records.frame(self.capacity, counts);
            gpu.queue.write_buffer(&picture.frame, 0, bytemuck::bytes_of(&frame));
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.clear_buffer(&picture.heads, 0, None);
            if let Some(tails) = &picture.tails {
                encoder.clear_buffer(tails, 0, None);
            }
            pipelines.encode(&mut encoder, groups, picture, path, chunks, self.timing.as_ref());
            let pixels = size.pixels() as u64;
            let (from, at) = match &picture.tails {
                Some(tails) => (tails, pixels * 4),
                None => (&picture.heads, pixels * 4 + 4),
            };
            encoder.copy_buffer_to_buffer(&picture.heads, 0, &picture.count, 0, 4);
            encoder.copy_buffer_to_buffer(from, at, &picture.count, 4, 4);
            picture.copy_out(&mut encoder, planes);
            if let Some(timing) = &self.timing {
                timing.copy_out(&mut encoder);
            }
            gpu.queue.submit([encoder.finish()]);
        })?;
        let [count, valid] = gpu.read::<u32, _>(&picture.count, 8, |count| [count[0], count[1]])?;
        // The first entry is not used.
        let needed = if lists { count.saturating_add(1) } else { 0 };
        Ok((needed, counts.then_some(valid)))
    }

    fn compose(
        &mut self,
        scene: &PreparedScene,
        eye: &Eye,
        visibility: &Visibility,
        reflection: &mut Reflection,
        white: f32,
        picture: &mut Picture,
    ) -> Result<()> {
        let refused = || Error::input("--backend gpu", "", "this scene is too large", "");
        if !self.is_here {
            self.upload(visibility, reflection)?;
        }
        let gpu = &self.gpu;
        let own = self.picture.as_ref().filter(|p| p.size() == visibility.size);
        let own = own.ok_or_else(refused)?;
        if self.composed_elsewhere == Some(scene.placement_version) {
            return Err(refused());
        }
        let composer = match &mut self.composer {
            Some(composer) => composer,
            none => none.insert(Composer::new(gpu)?),
        };
        let mirrors = reflection.planes.is_some().then_some(&mut reflection.radiance);
        let done =
            composer.compose(gpu, scene, eye, visibility, &own.reflection, white, mirrors, picture);
        if done.is_err() {
            self.composed_elsewhere = Some(scene.placement_version);
        } else if let Some(planes) = &mut reflection.planes {
            planes.radiance = reflection.radiance.iter().map(|c| c.to_array()).collect();
        }
        done
    }

    /// A reflection that was made elsewhere, to the device.
    fn upload(&mut self, visibility: &Visibility, reflection: &Reflection) -> Result<()> {
        let size = visibility.size;
        if self.picture.as_ref().is_none_or(|p| p.size() != size) {
            self.picture = None;
            self.picture = Some(PictureBuffers::new(&self.gpu, size, self.capacity, false)?);
        }
        let color = |(c, &covered): (&Vec3, &f32)| c.extend(covered).to_array();
        let colors: Vec<[f32; 4]> =
            reflection.radiance.iter().zip(&reflection.coverage).map(color).collect();
        let picture = self.picture.as_ref().expect("it was made");
        self.gpu.queue.write_buffer(&picture.reflection, 0, bytemuck::cast_slice(&colors));
        Ok(())
    }

    /// The reflection back to the CPU.
    fn read(&self, visibility: &Visibility, out: &mut Reflection) -> Result<()> {
        let picture = self.picture.as_ref().expect("it was drawn");
        let pixels = visibility.size.pixels();
        out.radiance.resize(pixels, Vec3::ZERO);
        out.coverage.resize(pixels, 0.0);
        let bytes = pixels as u64 * 16;
        self.gpu.read::<[f32; 4], ()>(&picture.colors_out, bytes, |colors| {
            use rayon::prelude::*;
            let to = out.radiance.par_iter_mut().zip(&mut out.coverage);
            to.zip(colors).for_each(|((radiance, coverage), color)| {
                let color = Vec4::from_array(*color);
                *coverage = color.w;
                if color.w > 0.0 {
                    *radiance = color.truncate();
                }
            });
        })?;
        Ok(())
    }

    /// The nearest of every pixel, for what was seen.
    fn landed(&self, visibility: &Visibility, coverage: &[f32]) -> Result<Vec<Landed>> {
        let picture = self.picture.as_ref().expect("it was drawn");
        let bytes = visibility.size.pixels() as u64 * 8;
        self.gpu.read::<[u32; 2], _>(&picture.nearest_out, bytes, |keys| {
            let mut landed = Vec::new();
            for ((pixel, &[depth, surfel]), &coverage) in (0u32..).zip(keys).zip(coverage) {
                let key = u64::from(depth) << 32 | u64::from(surfel);
                if key != EMPTY {
                    landed.push(Landed { pixel, coverage, radiance: Vec3::ZERO, key });
                }
            }
            landed
        })
    }
}
