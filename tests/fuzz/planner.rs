//! Random eyes, mirrors, surfels, methods and parameters: every picture is made of numbers.

use std::sync::Arc;

use catoptric::Context;
use catoptric::camera::eye::ImageSize;
use catoptric::frame::Renderer;
use catoptric::geometry::surfel::PADDING;
use catoptric::geometry::{Mesh, Similarity, Surfels};
use catoptric::methods::{METHODS, ParamKind, Params};
use catoptric::scene::description::{
    Environment, EyeDescription, Light, Mirror, Object, Paint, Scene,
};
use catoptric::scene::scan::disks;
use catoptric::scene::{PrepareOptions, PreparedScene, builtin};
use glam::{DVec3, Vec3};

/// Deals bytes out; zeros when they are used up.
struct Dealer<'a>(&'a [u8]);

impl Dealer<'_> {
    fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    fn below(&mut self, count: usize) -> usize {
        usize::from(self.byte()) % count.max(1)
    }

    /// Mostly between -2 and 2, now and then as extreme as the library takes.
    fn number(&mut self) -> f32 {
        let kind = self.byte();
        let fine = f32::from(i16::from_le_bytes([self.byte(), self.byte()])) / 16_384.0;
        match kind {
            0..200 => fine,
            200..210 => 0.0,
            210..220 => fine * 1e-20,
            220..230 => fine * 1e6,
            230..240 => fine * 4e14,
            240..250 => fine * 1e-3,
            _ => 1.0,
        }
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.number(), self.number(), self.number())
    }

    fn vectors(&mut self, count: usize) -> Vec<Vec3> {
        (0..count).map(|_| self.vector()).collect()
    }

    fn mirror(&mut self) -> Option<Mesh> {
        const SHAPES: [&str; 5] = ["sphere", "torus", "plane", "bowl", "wave"];
        if self.byte() < 100 {
            let shape = SHAPES[self.below(SHAPES.len())];
            return builtin::shape(shape, Some(2 + self.below(200)));
        }
        let count = 3 + self.below(12);
        let positions = self.vectors(count);
        let normals = if self.byte() < 128 { self.vectors(count) } else { Vec::new() };
        let triangles = (0..1 + self.below(16))
            .map(|_| [0; 3].map(|_| u32::try_from(self.below(count)).expect("a byte")));
        let triangles = triangles.collect();
        Mesh::new(positions, normals, Vec::new(), triangles).ok()
    }
}

/// `None` if nothing was drawn.
///
/// # Panics
/// If a pixel is no number.
pub fn run(bytes: &[u8]) -> Option<()> {
    let mut dealer = Dealer(bytes);
    let mirror = dealer.mirror()?;
    let eye = EyeDescription {
        position: dealer.vector().as_dvec3(),
        target: dealer.vector().as_dvec3(),
        up: dealer.vector().as_dvec3(),
        fov_y: f64::from(dealer.number().abs()),
    };
    let method = METHODS[dealer.below(METHODS.len())];
    let infos = method.info().params;
    let mut params = Params::defaults(infos);
    for info in infos {
        let text = match info.kind {
            _ if dealer.byte() < 150 => continue,
            ParamKind::Choice(words) => words[dealer.below(words.len())].to_owned(),
            // Large ones only take longer.
            ParamKind::Integer(min, max) => {
                let span = usize::try_from((max - min).min(7)).expect("small") + 1;
                (min + u32::try_from(dealer.below(span)).expect("small")).to_string()
            }
            ParamKind::Number(min, max) => {
                (min + (max - min) * f32::from(dealer.byte()) / 255.0).to_string()
            }
        };
        // Some values do not go with others, which is said when the method is asked.
        let _ = params.set(info, &text);
    }
    let cx = Context::default();
    let count = 1 + dealer.below(64);
    let positions = dealer.vectors(count);
    let normals = dealer.vectors(count);
    let radiance: Vec<Vec3> =
        dealer.vectors(count).iter().map(|c| c.abs().min(Vec3::splat(1e6))).collect();
    let axis =
        |k: usize| -> Vec<f32> { positions.iter().map(|p| p[k]).chain([0.0; PADDING]).collect() };
    let points = Surfels {
        x: axis(0),
        y: axis(1),
        z: axis(2),
        normals: normals.iter().map(|n| n.as_dvec3().normalize_or(DVec3::Y).as_vec3()).collect(),
        albedo: radiance,
        radiance: vec![Vec3::ZERO; count],
        extent: (0..count).map(|_| dealer.number().abs().max(1e-20)).collect(),
    };
    let scene = Scene {
        name: String::new(),
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
            name: "points".into(),
            mesh: Arc::new(disks(&points, 20, false, &cx).ok()?),
            points: Some(Arc::new(points)),
            source: None,
            transform: Similarity::IDENTITY,
            paint: Paint::Vertex,
            density: 1.0,
        }],
        environment: Environment::Constant(Vec3::splat(0.25)),
        light: Light { to_sun: Vec3::Y, sun: Vec3::ONE, ambient: Vec3::ONE },
        notes: Vec::new(),
    };
    // Few, so that mirrors have few, too.
    let options = PrepareOptions { surfels: 200, ..PrepareOptions::default() };
    let scene = PreparedScene::new(&scene, &options, &cx).ok()?;
    let size = ImageSize { width: 24, height: 14 };
    let eye = scene.eye_for(size)?;
    let mut renderer = Renderer::new();
    renderer.render(&scene, &eye, method, &params, true, &cx).ok()?;
    let picture = &renderer.picture().rgb;
    let bad = picture.iter().position(|color| !color.iter().all(|v| v.is_finite()));
    assert!(bad.is_none(), "{}: pixel {bad:?} is no number", method.info().id);
    if let Some(planes) = renderer.planes() {
        let bad = planes.coverage.iter().position(|v| !(0.0..=1.001).contains(v));
        assert!(bad.is_none(), "{}: coverage of pixel {bad:?}", method.info().id);
    }
    Some(())
}
