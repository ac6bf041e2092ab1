//! From points to all their paths: neighbouring points are looked up together.

use std::ops::Range;

use fearless_simd::Level;
use glam::DVec3;
use rayon::prelude::*;

use super::cameras::{Camera, Image, cameras};
use super::hierarchy::Hierarchy;
use super::occlusion::occlude;
use super::packet::Packet;
use super::refine::{Refined, refine};
use super::surfaces::PathScene;
use super::{NEAR_CAUSTIC, Occluder, Path, Refinement};
use crate::camera::RayScale;
use crate::camera::mirror_ray::reflect;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::lanes::simd_level;

/// What is to be found out about paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathOptions {
    /// Length of the cameras' three rays.
    pub ray_scale: RayScale,
    /// Whether [`Path::eye_leg`] and [`Path::point_leg`] are looked up; else they are
    /// [`Occluder::None`](super::Occluder::None).
    pub occlusion: bool,
    /// Whether paths are moved to the smooth surface, see [`Refinement`](super::Refinement).
    pub refine: bool,
}

impl Default for PathOptions {
    fn default() -> Self {
        Self { ray_scale: RayScale::EyeDistance, occlusion: true, refine: false }
    }
}

/// How many images a point has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImageCount {
    /// Over all mirrors, hidden ones too.
    pub images: u32,
    /// Whether one of them is [near a caustic](Path::near_caustic).
    pub near_caustic: bool,
}

/// All paths of some points.
#[derive(Clone, Debug, Default)]
pub struct PathSet {
    /// By group of neighbours.
    lists: Vec<Vec<Path>>,
    /// Of each point: its group, and where in it.
    places: Vec<(u32, Range<u32>)>,
}

impl PathSet {
    /// Number of points.
    pub fn points(&self) -> usize {
        self.places.len()
    }

    /// The paths of a point, by mirror, triangle and rising λ.
    ///
    /// # Panics
    /// If there is no such point.
    pub fn of(&self, point: usize) -> &[Path] {
        let (list, range) = &self.places[point];
        &self.lists[*list as usize][range.start as usize..range.end as usize]
    }
}

/// Points looked up together: few enough to share cameras, enough to share the walk to them.
const GROUP: usize = 64;

/// Two images on edges that start nearer to each other than this, in longest edges, are one.
const SAME: f64 = 1e-7;

/// Finds the paths from one eye.
pub struct PathFinder<'a> {
    pub(super) scene: &'a PathScene,
    /// Relative to the scene's origin.
    pub(super) eye: DVec3,
    pub(super) options: PathOptions,
    pub(super) cameras: Vec<Camera>,
    hierarchy: Hierarchy,
    level: Level,
}

impl<'a> PathFinder<'a> {
    /// Makes the cameras of `eye` (world space).
    ///
    /// # Errors
    /// The eye is not finite, or beyond 1e15.
    pub fn new(scene: &'a PathScene, eye: DVec3, options: PathOptions) -> Result<Self> {
        if !eye.abs().cmple(DVec3::splat(1e15)).all() {
            let remedy = "give three numbers such as 0,1,3";
            return Err(Error::input("--eye", "", "is not finite, or beyond 1e15", remedy));
        }
        let eye = eye - scene.origin;
        let cameras = cameras(scene, eye, options.ray_scale);
        let hierarchy = Hierarchy::new(&cameras);
        Ok(Self { scene, eye, options, cameras, hierarchy, level: simd_level() })
    }

    /// Number of cameras: mirror triangles that face the eye in part.
    pub fn camera_count(&self) -> usize {
        self.cameras.len()
    }

    /// All paths to `points` (world space). A point that is not finite has none. Takes some hundred bytes a path.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    ///
    /// # Panics
    /// If there are 2³² points or more.
    pub fn find(&self, points: &[DVec3], cx: &Context) -> Result<PathSet> {
        let groups = self.groups(points, cx, |group, images| {
            let mut ends = vec![0; group.len()];
            let at = |slot: u32| points[group[slot as usize] as usize] - self.scene.origin;
            for (end, (slot, _)) in (1..).zip(images) {
                ends[*slot as usize] = end;
            }
            let mut list: Vec<Path> =
                images.iter().map(|(slot, image)| self.path(at(*slot), image)).collect();
            if self.options.occlusion {
                let points: Vec<DVec3> = images.iter().map(|(slot, _)| at(*slot)).collect();
                occlude(self.scene, self.eye, &points, &mut list);
            }
            (list, group.to_vec(), ends)
        })?;
        let mut set = PathSet { lists: Vec::new(), places: vec![(0, 0..0); points.len()] };
        for (list, group, ends) in groups {
            let mut start = 0;
            for (index, end) in group.iter().zip(ends) {
                // A point without images has no end.
                let end = start.max(end);
                set.places[*index as usize] = (narrow(set.lists.len()), start..end);
                start = end;
            }
            set.lists.push(list);
        }
        Ok(set)
    }

    /// How many images each of `points` (world space) has: the lengths of [`PathFinder::find`]'s lists.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    ///
    /// # Panics
    /// If there are 2³² points or more.
    pub fn count(&self, points: &[DVec3], cx: &Context) -> Result<Vec<ImageCount>> {
        let groups = self.groups(points, cx, |group, images| {
            let mut counts = vec![ImageCount::default(); group.len()];
            for (slot, image) in images {
                let count = &mut counts[*slot as usize];
                count.images += 1;
                count.near_caustic |= self.caustic(image).1 < NEAR_CAUSTIC;
            }
            (group.to_vec(), counts)
        })?;
        let mut all = vec![ImageCount::default(); points.len()];
        for (index, count) in groups.iter().flat_map(|(group, counts)| group.iter().zip(counts)) {
            all[*index as usize] = *count;
        }
        Ok(all)
    }

    /// Sorts points into groups of neighbours and gives `make` the indices of each group's points and their images (slot in
    /// the group, image), by slot.
    fn groups<T: Send>(
        &self,
        points: &[DVec3],
        cx: &Context,
        make: impl Fn(&[u32], &[(u32, Image)]) -> T + Sync,
    ) -> Result<Vec<T>> {
        let order = along_a_curve(points);
        order
            .par_chunks(GROUP)
            .map(|group| {
                cx.check()?;
                let here: Vec<DVec3> =
                    group.iter().map(|i| points[*i as usize] - self.scene.origin).collect();
                Ok(make(group, &self.images(&here)))
            })
            .collect()
    }

    /// The images of some points near to each other (relative to the origin), by point.
    fn images(&self, points: &[DVec3]) -> Vec<(u32, Image)> {
        let mut found = Vec::new();
        let finite = points.iter().filter(|p| p.is_finite());
        let (min, max) = finite.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
            (min.min(*p), max.max(*p))
        });
        if !min.is_finite() {
            return found;
        }
        let packet = Packet::new(points);
        self.hierarchy.visit(min, max, |index| {
            let camera = &self.cameras[index as usize];
            packet.visit(self.level, camera, &mut |slot, lambda| {
                let point = points[slot];
                let mut add = |image| found.push((narrow(slot), image));
                match lambda {
                    _ if !point.is_finite() => {}
                    Some(lambda) => camera.image_at(index, point, lambda).into_iter().for_each(add),
                    None => camera.images(index, point, &mut add),
                }
            });
        });
        found.sort_unstable_by(|(a, x), (b, y)| {
            (a, x.camera).cmp(&(b, y.camera)).then(x.lambda.total_cmp(&y.lambda))
        });
        self.drop_twins(&mut found);
        found
    }

    /// Of images on edges that are one, keeps that of the lowest triangle.
    fn drop_twins(&self, found: &mut Vec<(u32, Image)>) {
        if !found.iter().any(|(_, image)| image.on_edge) {
            return;
        }
        let mut kept: Vec<(u32, Image)> = Vec::with_capacity(found.len());
        for (slot, image) in found.drain(..) {
            let same = |(other_slot, other): &&(u32, Image)| {
                *other_slot == slot && self.twins(&image, other)
            };
            if !image.on_edge || !kept.iter().rev().any(|k| same(&k)) {
                kept.push((slot, image));
            }
        }
        *found = kept;
    }

    /// Whether two images of a point, by different cameras, are one path.
    fn twins(&self, a: &Image, b: &Image) -> bool {
        let (of_a, of_b) = (&self.cameras[a.camera as usize], &self.cameras[b.camera as usize]);
        let apart = || of_a.mirror_point(a.weights).distance(of_b.mirror_point(b.weights));
        a.on_edge
            && b.on_edge
            && a.camera != b.camera
            && of_a.mirror == of_b.mirror
            && apart() <= SAME * of_a.size.max(of_b.size)
    }

    /// det J and |N·d| / (|N| |d|) of an image.
    fn caustic(&self, image: &Image) -> (f64, f64) {
        let camera = &self.cameras[image.camera as usize];
        let normal = camera.normal(image.lambda);
        let (_, d) = camera.rays.at(DVec3::from_array(image.weights));
        let det = normal.dot(d);
        (det, det.abs() / (normal.length() * d.length()))
    }

    /// The path of an image of `point` (relative to the origin), as if nothing were in the way.
    fn path(&self, point: DVec3, image: &Image) -> Path {
        let camera = &self.cameras[image.camera as usize];
        let surface = &self.scene.mirrors[camera.mirror as usize];
        let refined =
            { self.options.refine }.then(|| refine(surface, camera, image, self.eye, point));
        let (refinement, at) = match refined {
            Some(Some(at)) => (Refinement::Surface, at),
            not => {
                let point = camera.mirror_point(image.weights);
                let normal = surface.normal(camera.triangle as usize, image.weights);
                let failed = if not.is_some() { Refinement::Failed } else { Refinement::Camera };
                (failed, Refined { point, normal })
            }
        };
        let (det_j, caustic_sine) = self.caustic(image);
        let (view, onward) = (at.point - self.eye, point - at.point);
        let away = reflect(view, at.normal).normalize_or_zero();
        Path {
            mirror: camera.mirror,
            triangle: camera.triangle,
            weights: image.weights,
            mirror_point: at.point + self.scene.origin,
            lambda: image.lambda,
            length: view.length() + onward.length(),
            det_j,
            caustic_sine,
            miss: (onward - away * onward.dot(away).max(0.0)).length(),
            eye_leg: Occluder::None,
            point_leg: Occluder::None,
            refinement,
        }
    }
}

fn narrow(n: usize) -> u32 {
    u32::try_from(n).expect("point indices have 32 bits")
}

/// The indices of points along a Morton curve through their box; those that are not finite come last.
fn along_a_curve(points: &[DVec3]) -> Vec<u32> {
    let finite = points.par_iter().filter(|p| p.is_finite());
    let (min, max) = finite
        .map(|p| (*p, *p))
        .reduce(|| (DVec3::INFINITY, DVec3::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    const CELLS: f64 = (1u64 << 20) as f64;
    let scale = CELLS / (max - min).max_element();
    let mut keys: Vec<(u64, u32)> = points
        .par_iter()
        .enumerate()
        .map(|(i, p)| {
            let cell = (*p - min) * scale;
            let code = if p.is_finite() { morton(cell) } else { u64::MAX };
            (code, narrow(i))
        })
        .collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|(_, i)| i).collect()
}

/// Interleaves the lowest 21 bits of three coordinates; NaN is 0.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped cells")]
fn morton(cell: DVec3) -> u64 {
    let spread = |x: f64| {
        let mut x = (x as u64).min((1 << 21) - 1);
        for (shift, mask) in [
            (32, 0x1f_0000_0000_ffff),
            (16, 0x1f_0000_ff00_00ff),
            (8, 0x100f_00f0_0f00_f00f),
            (4, 0x10c3_0c30_c30c_30c3),
            (2, 0x1249_2492_4924_9249),
        ] {
            x = (x | x << shift) & mask;
        }
        x
    };
    spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
}
