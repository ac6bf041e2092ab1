//! Multiple images and caustics of a scene's mirrors, as one eye sees them: in each camera, and across all of them.

mod caustic_surface;
mod image_counts;
mod pictures;
mod slice;
#[cfg(test)]
mod tests;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

pub use caustic_surface::{CausticStrip, CausticSurface};
pub use image_counts::{ImageHistogram, image_histogram, ray_points, surfel_points};
pub use pictures::{COUNT_COLORS, class_color, class_picture, count_color, double_image_picture};
pub use slice::{Slice, camera_slice, mirror_slice};

use crate::camera::RayScale;
use crate::camera::three_ray::multiplicity::{Class, Jacobian};
use crate::camera::three_ray::{Image, Rays, ThreeRay, project};
use crate::scene::PreparedScene;

/// The camera of a mirror triangle whose rays leave its front, at least in part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontCamera {
    /// Index of the triangle over all mirrors.
    pub triangle: u32,
    /// Scene space.
    pub rays: Rays,
    /// Σ w_i of these is positive where rays leave the front of the smooth surface.
    pub facing: [f64; 3],
    /// The λ up to which it is looked at: there its shortest ray is as long as the scene is wide.
    pub reach: f64,
}

/// All cameras through which an eye sees a scene's mirrors, those included that something hides.
#[derive(Clone, Debug)]
pub struct MirrorCameras {
    /// By triangle.
    pub cameras: Vec<FrontCamera>,
    /// How many triangles the mirrors have together.
    pub triangles: usize,
    /// Diagonal of the box about all mirrors and objects, scene units.
    pub extent: f64,
    /// World position of scene space's zero.
    pub origin: DVec3,
}

/// Sampled points of one camera, or of several, by their number of images in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SampledImages {
    /// Points with one, two and three images.
    pub points: [u32; 3],
}

impl SampledImages {
    /// Of both together.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self { points: [0, 1, 2].map(|i| self.points[i] + other.points[i]) }
    }

    /// Share of the points that have several images; 0 if there are no points.
    pub fn several_share(&self) -> f64 {
        let [one, two, three] = self.points.map(f64::from);
        if one + two + three > 0.0 { (two + three) / (one + two + three) } else { 0.0 }
    }
}

impl MirrorCameras {
    /// The cameras of an eye at `eye` (scene space).
    pub fn new(scene: &PreparedScene, eye: Vec3, scale: RayScale) -> Self {
        let all = scene.mirror_triangles.bounds().union(scene.triangles.bounds());
        let extent = f64::from(all.diagonal());
        let triangles = scene.mirror_triangle_count();
        let of = |triangle: u32| {
            let surface = scene.mirror_triangle(triangle);
            let rays = Rays {
                origins: surface.corners.map(|v| v.as_dvec3()),
                directions: surface.corner_directions(eye, scale),
            };
            let lengths = rays.directions.iter().map(|d| d.length());
            let reach = extent / lengths.fold(f64::INFINITY, f64::min);
            let facing = surface.facing(eye);
            let faces = facing.iter().any(|f| *f > 0.0) && reach.is_finite();
            faces.then_some(FrontCamera { triangle, rays, facing, reach })
        };
        let count = u32::try_from(triangles).expect("indices of triangles are 32 bits");
        let cameras = (0..count).into_par_iter().filter_map(of).collect();
        Self { cameras, triangles, extent, origin: scene.origin }
    }

    /// How the rays of each triangle's camera run up to its reach; `None` for triangles that turn away from the eye.
    pub fn classes(&self) -> Vec<Option<Class>> {
        let own: Vec<Class> = self.cameras.par_iter().map(FrontCamera::class).collect();
        let mut classes = vec![None; self.triangles];
        for (camera, class) in self.cameras.iter().zip(own) {
            classes[camera.triangle as usize] = Some(class);
        }
        classes
    }

    /// Images of `points` points on rays of each camera, by camera: evenly over its triangle and over λ up to its reach. Of
    /// a camera that is not mixed no point is looked at: by the theorem (see
    /// [`multiplicity`](crate::camera::three_ray::multiplicity)) each has one image.
    pub fn sampled_images(&self, points: u32) -> Vec<SampledImages> {
        self.cameras.par_iter().map(|camera| camera.sampled_images(points)).collect()
    }
}

impl FrontCamera {
    /// The triangle, or the one or two triangles from whose points rays leave the front.
    pub fn parts(&self) -> impl Iterator<Item = Rays> + use<> {
        let rays = self.rays;
        front_parts(self.facing).map(move |part| part.map_or(rays, |corners| rays.part(corners)))
    }

    /// How its rays run up to its reach; of two parts the one that folds more counts.
    pub fn class(&self) -> Class {
        let classes = self.parts().map(|part| Jacobian::of(&part).class(0.0, self.reach));
        classes.max().unwrap_or(Class::Divergent)
    }

    /// The intervals of λ in which it is mixed, up to its reach; those of its parts one after the other.
    pub fn mixed_intervals(&self) -> Vec<[f64; 2]> {
        let of = |part: Rays| Jacobian::of(&part).mixed_intervals(0.0, self.reach);
        self.parts().flat_map(|part| of(part).as_slice().to_vec()).collect()
    }

    /// How many images it has of a point of scene space, up to its reach.
    pub fn images_of(&self, point: DVec3) -> usize {
        self.images(&ThreeRay::new(&self.rays, &self.rays), point)
    }

    fn images(&self, camera: &ThreeRay<f64>, point: DVec3) -> usize {
        let q = (point - self.rays.origins[0]).to_array();
        let images = project(camera, q, 0.0, self.reach);
        let valid = |image: &&Image<f64>| {
            image.within([0.0; 3]) && self.faces(DVec3::new(image.b1(), image.b2, image.b3))
        };
        images.as_slice().iter().filter(valid).count()
    }

    fn faces(&self, w: DVec3) -> bool {
        w.dot(DVec3::from_array(self.facing)) >= 0.0
    }

    fn sampled_images(&self, points: u32) -> SampledImages {
        let mut sampled = SampledImages::default();
        if self.class() != Class::Mixed {
            sampled.points[0] = points;
            return sampled;
        }
        let camera = ThreeRay::new(&self.rays, &self.rays);
        for (w, share) in (0..points).map(even).filter(|(w, _)| self.faces(*w)) {
            let (v, d) = self.rays.at(w);
            // Rounding may lose a point on the rim.
            let images = self.images(&camera, v + d * (share * self.reach)).clamp(1, 3);
            sampled.points[images - 1] += 1;
        }
        sampled
    }
}

/// Weights in a triangle and a number from 0 to 1, the `i`-th of a sequence that fills them evenly: the R3 sequence of
/// Roberts (2018), folded into the triangle.
fn even(i: u32) -> (DVec3, f64) {
    /// Powers of the inverse of the root of x⁴ = x + 1.
    const STEPS: [f64; 3] =
        [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
    let [mut b, mut c, share] = STEPS.map(|step| (0.5 + step * f64::from(i + 1)).fract());
    if b + c > 1.0 {
        (b, c) = (1.0 - b, 1.0 - c);
    }
    (DVec3::new(1.0 - b - c, b, c), share)
}

/// The parts of a triangle in which Σ w_i facing_i ≥ 0, as weights of their corners in the triangle's sense of rotation;
/// `None` stands for all of it.
fn front_parts(facing: [f64; 3]) -> impl Iterator<Item = Option<[DVec3; 3]>> {
    let front = facing.map(|f| f >= 0.0);
    let corner = [DVec3::X, DVec3::Y, DVec3::Z];
    // Where the silhouette meets the edge ij.
    let cut = |i: usize, j: usize| corner[i].lerp(corner[j], facing[i] / (facing[i] - facing[j]));
    let parts = match front.iter().filter(|f| **f).count() {
        3 => [Some(None), None],
        0 => [None, None],
        in_front => {
            // The corner that is alone on its side, and the others behind it.
            let alone = (0..3).find(|&i| front[i] == (in_front == 1)).unwrap_or(0);
            let [a, b, c] = [alone, (alone + 1) % 3, (alone + 2) % 3];
            let (ab, ac) = (cut(a, b), cut(a, c));
            match in_front {
                1 => [Some(Some([corner[a], ab, ac])), None],
                _ => [Some(Some([ab, corner[b], corner[c]])), Some(Some([ab, corner[c], ac]))],
            }
        }
    };
    parts.into_iter().flatten()
}
