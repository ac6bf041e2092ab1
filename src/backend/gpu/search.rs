//! Searches on reflectors, and cube maps read, on the device: lists of points go up, what was found comes back. Then
//! `reflected` draws.

use std::cell::RefCell;
use std::sync::Arc;

use glam::Vec3;

use super::buffers::Grown;
use super::device::Gpu;
use super::pipelines::{compute, dispatch, group};
use super::reflected::Rasteriser;
use super::shaders;
use crate::backend::cpu::lookup::Asked;
use crate::backend::cpu::search::raster::rasterise;
use crate::backend::cpu::search::raster::{Drawing, Hit};
use crate::backend::cpu::search::{Job, SearchBackend};
use crate::camera::reflector::Found;
use crate::error::Result;
use crate::plan::EnvironmentCube;
use crate::plan::search::{ReflectorPart, Search};

/// As `Task` in `shaders/passes/search.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Task {
    pub(super) eye: [f32; 3],
    pub(super) side: u32,
    pub(super) inward: u32,
    pub(super) iterations: u32,
    pub(super) count: u32,
    pub(super) limit: f32,
}

/// Points a submission: what every device's bindings hold.
const MOST_POINTS: usize = 1 << 21;

/// A reflector's maps.
struct Maps {
    radial: wgpu::Buffer,
    surface: wgpu::Buffer,
}

/// Everything for it on one device.
pub(super) struct Searcher {
    estalella: wgpu::ComputePipeline,
    roger: wgpu::ComputePipeline,
    look_up: wgpu::ComputePipeline,
    task: wgpu::Buffer,
    points: Grown,
    found: Grown,
    out: Grown,
    /// Of these parts.
    maps: Option<(Arc<Vec<ReflectorPart>>, Vec<Maps>)>,
    /// Of these cubes.
    cubes: Option<(Arc<Vec<EnvironmentCube>>, Vec<wgpu::Buffer>)>,
    /// Made when it is first needed.
    rasteriser: Option<Rasteriser>,
}

impl Searcher {
    pub(super) fn new(gpu: &Gpu) -> Result<Self> {
        use wgpu::BufferUsages as U;
        let text = shaders::search();
        let made = |entry| gpu.checked(|| compute(gpu, &text, entry, None));
        Ok(Self {
            estalella: made("search_estalella")?,
            roger: made("search_roger")?,
            look_up: made("look_up")?,
            task: gpu.buffer("task", size_of::<Task>() as u64, U::UNIFORM | U::COPY_DST)?,
            points: Grown::new("points to search for", U::STORAGE | U::COPY_DST),
            found: Grown::new("reflection points", U::STORAGE | U::COPY_SRC),
            out: Grown::new("reflection points", U::MAP_READ | U::COPY_DST),
            maps: None,
            cubes: None,
            rasteriser: None,
        })
    }

    /// Uploads the maps, unless they are there.
    pub(super) fn hold_maps(&mut self, gpu: &Gpu, parts: &Arc<Vec<ReflectorPart>>) -> Result<()> {
        if self.maps.as_ref().is_some_and(|(held, _)| Arc::ptr_eq(held, parts)) {
            return Ok(());
        }
        self.maps = None;
        let maps: Result<Vec<Maps>> = parts
            .iter()
            .map(|part| {
                let radial = uploaded(gpu, bytemuck::cast_slice(&part.map.radial.texels))?;
                let surface = uploaded(gpu, bytemuck::cast_slice(&part.map.surface.texels))?;
                Ok(Maps { radial, surface })
            })
            .collect();
        self.maps = Some((Arc::clone(parts), maps?));
        Ok(())
    }

    /// Finds the reflection points of a job on one of the parts whose maps are held.
    pub(super) fn find(&mut self, gpu: &Gpu, job: &Job<'_>) -> Result<Vec<Found>> {
        let (iterations, limit, is_roger) = match job.search {
            Search::Estalella(ends) => (ends.iterations, ends.epsilon, false),
            Search::Roger { iterations, px } => (iterations, px * job.px, true),
        };
        let task = Task {
            eye: job.eye.to_array(),
            side: job.part.map.radial.side(),
            inward: u32::from(job.part.map.inward),
            iterations,
            count: 0,
            limit,
        };
        let mut list = Vec::with_capacity(job.points.len());
        for points in job.points.chunks(MOST_POINTS) {
            let task = Task { count: count(points.len()), ..task };
            self.hold(gpu, points, 2)?;
            let (parts, maps) = self.maps.as_ref().expect("they are held");
            let own = parts.iter().position(|part| std::ptr::eq(part, job.part));
            let Maps { radial, surface } = &maps[own.expect("the job is of these parts")];
            let pipeline = if is_roger { &self.roger } else { &self.estalella };
            self.run(gpu, pipeline, &task, &[(1, radial), (2, surface)], 2)?;
            let bytes = points.len() as u64 * 32;
            gpu.read::<[[f32; 4]; 2], _>(self.out.buffer(), bytes, |rows| {
                list.extend(rows.iter().map(|&[[x, y, z, steps], [a, b, c, hidden]]| Found {
                    point: Vec3::new(x, y, z),
                    normal: Vec3::new(a, b, c),
                    hidden: hidden != 0.0,
                    #[expect(
                        clippy::cast_possible_truncation,
                        clippy::cast_sign_loss,
                        reason = "small"
                    )]
                    steps: steps as u32,
                }));
            })?;
        }
        Ok(list)
    }

    /// Which triangle each pixel shows.
    fn rasterise(&mut self, gpu: &Gpu, drawing: &Drawing<'_>) -> Result<Option<Vec<Hit>>> {
        let rasteriser = match &mut self.rasteriser {
            Some(rasteriser) => rasteriser,
            none => none.insert(Rasteriser::new(gpu)?),
        };
        rasteriser.draw(gpu, drawing)
    }

    /// What cubes hold in the directions that are asked for.
    pub(super) fn look_up(
        &mut self,
        gpu: &Gpu,
        cubes: &Arc<Vec<EnvironmentCube>>,
        asked: &[Asked],
    ) -> Result<Vec<[f32; 4]>> {
        if !self.cubes.as_ref().is_some_and(|(held, _)| Arc::ptr_eq(held, cubes)) {
            self.cubes = None;
            let texels =
                |cube: &EnvironmentCube| uploaded(gpu, bytemuck::cast_slice(&cube.radiance.texels));
            let made: Result<Vec<_>> = cubes.iter().map(texels).collect();
            self.cubes = Some((Arc::clone(cubes), made?));
        }
        let mut colors = vec![[0.0; 4]; asked.len()];
        for (mirror, cube) in cubes.iter().enumerate() {
            let own: Vec<usize> = (0..asked.len()).filter(|&i| asked[i].mirror == mirror).collect();
            for own in own.chunks(MOST_POINTS) {
                let directions: Vec<Vec3> = own.iter().map(|&i| asked[i].direction).collect();
                let side = cube.radiance.side();
                let task = Task { side, count: count(own.len()), ..Task::default() };
                self.hold(gpu, &directions, 1)?;
                let texels = &self.cubes.as_ref().expect("they are held").1[mirror];
                self.run(gpu, &self.look_up, &task, &[(1, texels)], 1)?;
                let bytes = own.len() as u64 * 16;
                gpu.read::<[f32; 4], _>(self.out.buffer(), bytes, |rows| {
                    own.iter().zip(rows).for_each(|(&i, row)| colors[i] = *row);
                })?;
            }
        }
        Ok(colors)
    }

    /// Uploads points and makes room for `rows` rows for each.
    fn hold(&mut self, gpu: &Gpu, points: &[Vec3], rows: u64) -> Result<()> {
        let bytes = points.len() as u64 * 16 * rows;
        self.points.hold(gpu, size_of_val(points) as u64)?;
        self.found.hold(gpu, bytes)?;
        self.out.hold(gpu, bytes)?;
        let flat: Vec<[f32; 3]> = points.iter().map(|p| p.to_array()).collect();
        gpu.queue.write_buffer(self.points.buffer(), 0, bytemuck::cast_slice(&flat));
        Ok(())
    }

    fn run(
        &self,
        gpu: &Gpu,
        pipeline: &wgpu::ComputePipeline,
        task: &Task,
        maps: &[(u32, &wgpu::Buffer)],
        rows: u64,
    ) -> Result<()> {
        let common = [(0, &self.task), (3, self.points.buffer()), (4, self.found.buffer())];
        gpu.checked(|| {
            gpu.queue.write_buffer(&self.task, 0, bytemuck::bytes_of(task));
            let layout = pipeline.get_bind_group_layout(0);
            let group = group(gpu, &layout, common.iter().chain(maps));
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &group, &[]);
                dispatch(&mut pass, task.count.div_ceil(64));
            }
            let bytes = u64::from(task.count) * 16 * rows;
            encoder.copy_buffer_to_buffer(self.found.buffer(), 0, self.out.buffer(), 0, bytes);
            gpu.queue.submit([encoder.finish()]);
        })
    }
}

/// A device's side of search passes.
pub(super) struct OnDevice<'a> {
    gpu: &'a Gpu,
    searcher: RefCell<&'a mut Searcher>,
}

impl<'a> OnDevice<'a> {
    /// With a searcher that holds the pass's maps.
    pub(super) fn new(gpu: &'a Gpu, searcher: &'a mut Searcher) -> Self {
        Self { gpu, searcher: RefCell::new(searcher) }
    }
}

impl SearchBackend for OnDevice<'_> {
    fn find(&self, job: &Job<'_>) -> Result<Vec<Found>> {
        self.searcher.borrow_mut().find(self.gpu, job)
    }

    fn rasterise(&self, drawing: &Drawing<'_>) -> Result<Vec<Hit>> {
        let drawn = self.searcher.borrow_mut().rasterise(self.gpu, drawing)?;
        // Pictures larger than the device's textures are drawn here.
        Ok(drawn.unwrap_or_else(|| rasterise(drawing)))
    }
}

fn count(points: usize) -> u32 {
    u32::try_from(points).expect("at most MOST_POINTS")
}

fn uploaded(gpu: &Gpu, bytes: &[u8]) -> Result<wgpu::Buffer> {
    use wgpu::BufferUsages as U;
    let buffer = gpu.buffer("a reflector's maps", bytes.len() as u64, U::STORAGE | U::COPY_DST)?;
    gpu.queue.write_buffer(&buffer, 0, bytes);
    Ok(buffer)
}
