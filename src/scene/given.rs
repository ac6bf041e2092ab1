//! A scene from surfels that the caller already has: no files, no sampling, no shading.

use std::sync::Arc;

use glam::Vec3;

use super::PreparedScene;
use super::description::{Environment, EyeDescription, Light, Mirror, Object, Paint, Scene};
use super::prepared::MAX_SURFELS;
use crate::accel::KdTreeLimits;
use crate::camera::Eye;
use crate::camera::eye::ImageSize;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::surfel::PADDING;
use crate::geometry::{Mesh, Similarity, Surfels};

/// Surfels as slices of one length, in any order, world space.
#[derive(Clone, Copy, Debug)]
pub struct GivenSurfels<'a> {
    /// Where they are.
    pub positions: &'a [Vec3],
    /// Outward, of any length but zero.
    pub normals: &'a [Vec3],
    /// Linear RGB, shaded as it is to be seen.
    pub radiance: &'a [Vec3],
}

/// In errors.
const NAME: &str = "surfels";
/// Coordinates beyond this cannot be squared and summed safely in f32: as in [`Mesh`].
const MAX_COORDINATE: f32 = 1e15;

impl PreparedScene {
    /// A scene of one mirror (world space, untinted) and one object, which is these surfels.
    ///
    /// The object has no triangles: only methods that project surfels show it. The direct view and the
    /// rays of `raytrace` do not see it, and it casts no shadows. Its surfels keep their radiance, also if
    /// the scene is shaded again. How far they lie apart is taken from their places.
    ///
    /// # Errors
    /// [`Error::Input`] if the slices are empty, too long or differ in length, an element is not finite
    /// (or a position is beyond 1e15), a normal is zero, a radiance negative, or `eye` makes no view.
    pub fn from_surfels(
        mirror: Mesh,
        given: GivenSurfels<'_>,
        eye: EyeDescription,
        environment: Environment,
    ) -> Result<Self> {
        let surfels = given.check()?;
        let scene = Scene {
            name: "given".into(),
            eye,
            mirrors: vec![Mirror {
                name: "mirror".into(),
                mesh: Arc::new(mirror),
                source: None,
                transform: Similarity::IDENTITY,
                tint: Vec3::ONE,
                proxy: None,
            }],
            objects: vec![Object {
                name: NAME.into(),
                mesh: Arc::new(Mesh::none()),
                points: None,
                source: None,
                transform: Similarity::IDENTITY,
                paint: Paint::Constant(Vec3::ONE),
                density: 1.0,
            }],
            environment,
            // Under it, shading changes nothing.
            light: Light { to_sun: Vec3::Y, sun: Vec3::ZERO, ambient: Vec3::ONE },
            notes: Vec::new(),
        };
        let limits = KdTreeLimits::default();
        let cx = Context::default();
        let mut sampled = vec![surfels];
        sampled.extend(super::prepared::sample_mirrors(&scene, MAX_SURFELS, 1, &cx)?);
        let prepared = Self::of_sampled(&scene, sampled, limits, &cx)?;
        let any_size = ImageSize { width: 1, height: 1 };
        if prepared.eye_for(any_size).is_none_or(|eye: Eye| !eye.position.is_finite()) {
            let remedy =
                "let eye and target differ, up not be parallel to the view, and 0 < fov_y < π";
            return Err(Error::input("eye", "", "makes no view", remedy));
        }
        Ok(prepared)
    }
}

impl GivenSurfels<'_> {
    /// Copies what is in order.
    fn check(&self) -> Result<Surfels> {
        let count = self.positions.len();
        let error = |place: String, problem: String, remedy: &str| {
            Err(Error::input(NAME, place, problem, remedy))
        };
        if count == 0 || count > MAX_SURFELS {
            let problem = format!("{count} of them");
            return error(String::new(), problem, &format!("give 1 to {MAX_SURFELS}"));
        }
        for (what, found) in [("normals", self.normals.len()), ("radiances", self.radiance.len())] {
            if found != count {
                let problem = format!("{found} {what} for {count} positions");
                return error(String::new(), problem, "give one for each");
            }
        }
        let mut surfels = Surfels {
            x: axis(self.positions, 0),
            y: axis(self.positions, 1),
            z: axis(self.positions, 2),
            normals: Vec::with_capacity(count),
            albedo: self.radiance.to_vec(),
            radiance: self.radiance.to_vec(),
            extent: vec![0.0; count],
        };
        for (i, position) in self.positions.iter().enumerate() {
            let place = || format!("surfel {i}");
            if !position.abs().cmple(Vec3::splat(MAX_COORDINATE)).all() {
                let problem = format!("the position {position} is not finite, or beyond 1e15");
                return error(place(), problem, "leave it out");
            }
            let Some(normal) = self.normals[i].as_dvec3().try_normalize() else {
                let problem = format!("the normal {} has no direction", self.normals[i]);
                return error(place(), problem, "give a vector that is not zero");
            };
            surfels.normals.push(normal.as_vec3());
            let radiance = self.radiance[i];
            if !(radiance.is_finite() && radiance.cmpge(Vec3::ZERO).all()) {
                let problem = format!("the radiance {radiance} is negative or not finite");
                return error(place(), problem, "give linear RGB");
            }
        }
        Ok(surfels)
    }
}

/// One coordinate of all, padded.
fn axis(positions: &[Vec3], k: usize) -> Vec<f32> {
    let mut list = Vec::with_capacity(positions.len() + PADDING);
    list.extend(positions.iter().map(|p| p[k]));
    list.resize(positions.len() + PADDING, 0.0);
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{FrameReport, Renderer};
    use crate::methods::{Params, method};
    use crate::scene::builtin;
    use glam::DVec3;

    const EYE: EyeDescription = EyeDescription {
        position: DVec3::new(0.0, 1.0, 3.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
        fov_y: 0.7,
    };

    fn scene(
        given: GivenSurfels<'_>,
        eye: EyeDescription,
    ) -> std::result::Result<PreparedScene, String> {
        let sphere = builtin::shape("sphere", Some(500)).unwrap();
        let sky = Environment::Constant(Vec3::ONE);
        PreparedScene::from_surfels(sphere, given, eye, sky).map_err(|e| e.to_string())
    }

    fn render(scene: &PreparedScene, id: &str) -> FrameReport {
        let eye = scene.eye_for(ImageSize { width: 160, height: 90 }).unwrap();
        let method = method(id).unwrap();
        let params = Params::defaults(method.info().params);
        let cx = Context::default();
        Renderer::new().render(scene, &eye, method, &params, true, &cx).unwrap()
    }

    #[test]
    fn only_projection_shows_given_surfels_and_shading_keeps_them() {
        let row = |k: u16| f32::from(k) * 0.02 - 1.0;
        let floor: Vec<Vec3> =
            (0..10_000).map(|i| Vec3::new(row(i % 100), -0.6, row(i / 100))).collect();
        let colors: Vec<Vec3> = floor.iter().map(|p| (*p + 1.0) * 7.3).collect();
        let normals = vec![Vec3::Y * 1e-30; floor.len()];
        let given = GivenSurfels { positions: &floor, normals: &normals, radiance: &colors };
        let mut scene = scene(given, EYE).unwrap();
        assert!(render(&scene, "c3rc").covered_pixels > 100);
        assert_eq!(render(&scene, "raytrace").covered_pixels, 0);
        assert!(scene.surfels.normals[..floor.len()].iter().all(|&n| n == Vec3::Y));
        let before = scene.surfels.radiance.clone();
        scene.shade(&Context::default()).unwrap();
        assert_eq!(scene.surfels.radiance, before);
    }

    #[test]
    fn a_single_surfel_will_do() {
        let at = [Vec3::new(0.3, 0.3, 2.0)];
        let given = GivenSurfels { positions: &at, normals: &[Vec3::X], radiance: &[Vec3::ONE] };
        let scene = scene(given, EYE).unwrap();
        let eye = scene.eye_for(ImageSize { width: 160, height: 90 }).unwrap();
        let c3rc = method("c3rc").unwrap();
        let mut params = Params::defaults(c3rc.info().params);
        let (mut renderer, cx) = (Renderer::new(), Context::default());
        renderer.render(&scene, &eye, c3rc, &params, true, &cx).unwrap();
        // Its disk is smaller than a pixel there.
        let seen = renderer.planes().unwrap().coverage.iter().filter(|c| **c > 0.0).count();
        assert!((1..=16).contains(&seen), "{seen}");
        params.set(c3rc.info().param("splat"), "square2").unwrap();
        let report = renderer.render(&scene, &eye, c3rc, &params, false, &cx).unwrap();
        assert!((1..=4).contains(&report.covered_pixels), "{report:?}");
    }

    #[test]
    fn what_is_wrong_is_named() {
        let (zero, one) = ([Vec3::ZERO; 2], [Vec3::ONE; 2]);
        let good = GivenSurfels { positions: &zero, normals: &one, radiance: &one };
        let bad_normals = [Vec3::Y, Vec3::ZERO];
        let bad_position = [Vec3::ZERO, Vec3::new(0.0, 1e16, 0.0)];
        let nan = [Vec3::ONE, Vec3::new(0.0, f32::NAN, 0.0)];
        let negative = [Vec3::ONE, -Vec3::ONE];
        assert!(scene(good, EYE).is_ok());
        for (given, expected) in [
            (GivenSurfels { positions: &[], ..good }, "surfels: 0 of them; give 1 to"),
            (GivenSurfels { normals: &one[..1], ..good }, "1 normals for 2 positions"),
            (GivenSurfels { radiance: &[], ..good }, "0 radiances for 2 positions"),
            (GivenSurfels { positions: &nan, ..good }, "surfel 1: the position"),
            (GivenSurfels { positions: &bad_position, ..good }, "surfel 1: the position"),
            (GivenSurfels { normals: &bad_normals, ..good }, "surfel 1: the normal"),
            (GivenSurfels { normals: &nan, ..good }, "surfel 1: the normal"),
            (GivenSurfels { radiance: &nan, ..good }, "surfel 1: the radiance"),
            (GivenSurfels { radiance: &negative, ..good }, "surfel 1: the radiance"),
        ] {
            let message = scene(given, EYE).err().unwrap_or_default();
            assert!(message.contains(expected), "{message:?} does not say {expected:?}");
        }
        for eye in [
            EyeDescription { target: EYE.position, ..EYE },
            EyeDescription { up: EYE.position, ..EYE },
            EyeDescription { fov_y: 4.0, ..EYE },
            EyeDescription { position: DVec3::splat(1e300), ..EYE },
        ] {
            let message = scene(good, eye).err().unwrap_or_default();
            assert!(message.contains("eye: makes no view"), "{message:?}");
        }
    }
}
