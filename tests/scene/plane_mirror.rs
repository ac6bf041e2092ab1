//! In a flat mirror the three-ray camera is a pinhole, and its truth has a closed form: the mirrored eye.

use catoptric::geometry::Similarity;
use catoptric::image::{NONE, Planes};
use catoptric::scene::PreparedScene;
use catoptric::scene::description::{EyeDescription, Scene};
use glam::{DVec2, DVec3};

use super::{RED, looks, object, prepared, rendered, scene, shape, turned};

const SIZE: [u32; 2] = [1280, 720];
/// The bar, in pixels.
const BAR_PX: f64 = 1e-3;

/// A tilted flat mirror of so many triangles and a knot before it, all of it moved by `offset`.
fn knot_before_a_mirror(triangles: usize, offset: DVec3) -> Scene {
    let mirror = turned(DVec3::new(0.3, 1.0, 0.2), 20.0, DVec3::new(-0.2, -0.9, -0.1) + offset);
    let mirror = Similarity { scale: 2.5, ..mirror };
    let knot = turned(DVec3::new(1.0, 1.0, 0.0), 40.0, DVec3::new(0.4, 0.5, 1.1) + offset);
    let objects = vec![object("knot", shape("knot", 4000), knot, RED)];
    let eye = looks(DVec3::new(-0.3, 0.7, 3.1) + offset, DVec3::new(0.0, 0.3, 0.0) + offset);
    scene((shape("plane", triangles), mirror), objects, eye)
}

/// A pinhole in world space, f64.
struct Pinhole {
    position: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    focal_px: f64,
}

impl Pinhole {
    fn new(eye: &EyeDescription) -> Self {
        let forward = (eye.target - eye.position).try_normalize().unwrap();
        let right = forward.cross(eye.up).try_normalize().unwrap();
        let focal_px = 0.5 * f64::from(SIZE[1]) / (0.5 * eye.fov_y).tan();
        Self { position: eye.position, right, up: right.cross(forward), forward, focal_px }
    }

    /// The eye behind the mirror that sees directly what this one sees reflected, `off` beside its place.
    fn mirrored(&self, mirror: &Similarity, off: f64) -> Self {
        // The shape `plane` lies in z = 0 and faces +z.
        let normal = mirror.direction(DVec3::Z);
        let flip = |d: DVec3| d - 2.0 * d.dot(normal) * normal;
        let position = mirror.translation + flip(self.position - mirror.translation);
        Self {
            position: position + off * normal,
            right: flip(self.right),
            up: flip(self.up),
            forward: flip(self.forward),
            focal_px: self.focal_px,
        }
    }

    fn project_px(&self, point: DVec3) -> DVec2 {
        let p = point - self.position;
        let px =
            DVec2::new(p.dot(self.right), -p.dot(self.up)) * (self.focal_px / p.dot(self.forward));
        px + 0.5 * DVec2::new(f64::from(SIZE[0]), f64::from(SIZE[1]))
    }
}

/// Largest distance of a splat from where `pinhole` sees its surfel, and how many splats there are.
fn largest_error(
    scene: &Scene,
    ready: &PreparedScene,
    planes: &Planes,
    pinhole: &Pinhole,
) -> (f64, usize) {
    let (mut worst, mut splats) = (0.0_f64, 0);
    for (&surfel, &[x, y]) in planes.surfel.iter().zip(&planes.splat) {
        if surfel != NONE {
            let local = ready.surfels.position(surfel as usize).as_dvec3();
            let wanted = pinhole.project_px(scene.objects[0].transform.point(local));
            worst = worst.max((DVec2::new(x.into(), y.into()) - wanted).length());
            splats += 1;
        }
    }
    (worst, splats)
}

#[test]
fn splats_lie_where_the_mirrored_eye_sees_the_surfels() {
    for offset in [DVec3::ZERO, DVec3::new(61.3, -47.7, 62.9), DVec3::new(-99.99, 0.37, -0.61)] {
        for triangles in [2, 200] {
            let scene = knot_before_a_mirror(triangles, offset);
            let ready = prepared(&scene, 100_000);
            let (_, planes) = rendered(&ready, "c3rc", SIZE[0], SIZE[1]);
            let mirrored =
                |off| Pinhole::new(&scene.eye).mirrored(&scene.mirrors[0].transform, off);
            let (worst, splats) = largest_error(&scene, &ready, &planes, &mirrored(0.0));
            let what = format!("{triangles} triangles, {offset} off");
            assert!(splats > 3_000, "{what}: {splats}");
            assert!(worst <= BAR_PX, "{what}: a splat lies {worst} px off");
            // The control: an eye a hundredth of a unit off is found out.
            let (wrong, _) = largest_error(&scene, &ready, &planes, &mirrored(0.01));
            assert!(wrong > 100.0 * BAR_PX, "{what}: {wrong} px");
        }
    }
}
