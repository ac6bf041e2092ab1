//! How many images points have: over all cameras, and at most in one.

use glam::DVec3;

use super::{MirrorCameras, even};
use crate::context::Context;
use crate::error::Result;
use crate::paths::PathFinder;
use crate::scene::PreparedScene;

/// Points by their numbers of images, which may be hidden.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImageHistogram {
    /// Entry n: how many points have n images over all cameras of all mirrors. The last entry is not 0.
    pub over_all: Vec<u32>,
    /// Entry n: how many points have at most n images in one camera.
    pub in_one_camera: [u32; 4],
}

impl ImageHistogram {
    /// Number of points.
    pub fn points(&self) -> u32 {
        self.over_all.iter().sum()
    }

    /// Share of the points that have `images` images over all cameras; 0 without points.
    pub fn share(&self, images: usize) -> f64 {
        let of = self.over_all.get(images).copied().unwrap_or(0);
        f64::from(of) / f64::from(self.points().max(1))
    }
}

/// Points looked up between two reports of progress.
const CHUNK: usize = 1 << 12;

/// Counts the images of `points` (world space). Progress goes to `stage`.
///
/// # Errors
/// Cancelled.
pub fn image_histogram(
    finder: &PathFinder<'_>,
    points: &[DVec3],
    stage: &str,
    cx: &Context,
) -> Result<ImageHistogram> {
    let mut histogram = ImageHistogram::default();
    for (k, chunk) in points.chunks(CHUNK).enumerate() {
        cx.step(stage, (k * CHUNK) as f64 / points.len() as f64)?;
        let set = finder.find(chunk, cx)?;
        for paths in (0..set.points()).map(|i| set.of(i)) {
            if histogram.over_all.len() <= paths.len() {
                histogram.over_all.resize(paths.len() + 1, 0);
            }
            histogram.over_all[paths.len()] += 1;
            let cameras = paths.chunk_by(|a, b| (a.mirror, a.triangle) == (b.mirror, b.triangle));
            let most = cameras.map(<[_]>::len).max().unwrap_or(0);
            histogram.in_one_camera[most.min(3)] += 1;
        }
    }
    Ok(histogram)
}

/// About `most` of the objects' surfels (all, if there are fewer), evenly chosen: places in world space.
pub fn surfel_points(scene: &PreparedScene, most: usize) -> Vec<DVec3> {
    let objects = &scene.clouds[..scene.objects.len()];
    let total: usize = objects.iter().map(|cloud| cloud.surfels.len()).sum();
    let step = total.div_ceil(most.max(1)).max(1);
    let surfels = objects.iter().flat_map(|cloud| {
        cloud.surfels.clone().map(|i| {
            let (s, i) = (&scene.surfels, i as usize);
            let local = DVec3::new(s.x[i].into(), s.y[i].into(), s.z[i].into());
            cloud.to_scene.point(local) + scene.origin
        })
    });
    surfels.step_by(step).collect()
}

/// About `count` points on rays of the cameras, up to the distance of the scene's extent from the mirror: evenly over the
/// mirrors' area that faces the eye and over the distance. World space; none if no camera has an area.
pub fn ray_points(cameras: &MirrorCameras, count: u32) -> Vec<DVec3> {
    let list = &cameras.cameras;
    let mut up_to = Vec::with_capacity(list.len());
    let mut total = 0.0;
    for camera in list {
        let [a, b, c] = camera.rays.origins;
        total += (b - a).cross(c - a).length();
        up_to.push(total);
    }
    let point = |i: u32| {
        let (w, share) = even(i);
        let place = (f64::from(i) + 0.5) / f64::from(count) * total;
        let camera = list.get(up_to.partition_point(|end| *end < place))?;
        let (v, d) = camera.rays.at(w);
        let far = d.normalize_or_zero() * (share * cameras.extent);
        camera.faces(w).then(|| v + far + cameras.origin)
    };
    (0..count).filter_map(point).collect()
}
