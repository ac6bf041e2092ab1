//! `catoptric bench crossover`: cameras against rays at equal error, over the mirror's triangles and the picture's pixels.

mod show;

use catoptric::accel::KdTreeLimits;
use catoptric::analysis::break_even::BreakEven;
use catoptric::analysis::measure::{Side, Stage, Timed, against};
use catoptric::analysis::methods::{Reference, reference};
use catoptric::backend::cpu::Cpu;
use catoptric::camera::Eye;
use catoptric::camera::eye::ImageSize;
use catoptric::frame::Renderer;
use catoptric::image::Picture;
use catoptric::image::compare::{self, Set};
use catoptric::methods::{Method, Params, method};
use catoptric::scene::PreparedScene;
use catoptric::scene::arrange::{self, Request};
use catoptric::scene::description::Scene;
use catoptric::scene::prepared::DEFAULT_SURFELS;
use catoptric::visibility::NONE_ID;
use serde_json::json;

use super::growth::scaled;
use super::report::{Block, Section};
use super::run::{Bench, NOT_BUILT_IN, c3rc, params, with_mirror_triangles};

/// A way to draw the reflections with cameras, from fast to exact.
struct Setting {
    name: &'static str,
    quality: &'static str,
    values: &'static [(&'static str, &'static str)],
}

const SETTINGS: [Setting; 4] = [
    Setting {
        name: "triangles",
        quality: "",
        values: &[("cameras", "triangles"), ("splat", "square2"), ("detail", "1")],
    },
    Setting { name: "draft", quality: "draft", values: &[] },
    Setting { name: "default", quality: "", values: &[] },
    Setting { name: "best", quality: "best", values: &[] },
];

/// Rays a pixel. Each side is measured in turn with the first.
const SPP: [u32; 3] = [1, 4, 16];

/// An error within this factor of another is no larger: references are not exact either.
const EQUAL: f64 = 1.05;

/// One way at one place of the map.
struct Entry {
    timed: Timed,
    /// Against many rays, where objects are reflected.
    rmse: f64,
}

/// One place of the map.
struct Cell {
    triangles: usize,
    size: ImageSize,
    /// Pixels that show a mirror by the number of triangles that they show.
    pixels_a_triangle: f64,
    /// By [`SETTINGS`].
    cameras: Vec<Entry>,
    /// By [`SPP`].
    rays: Vec<Entry>,
}

impl Cell {
    /// Time by that of one ray a pixel, measured in turn.
    fn to_one_ray(entry: &Entry) -> f64 {
        entry.timed.ratio().map_or(1.0, |r| r.of.median)
    }

    /// The fastest setting whose error is not larger than that of [`SPP`]`[k]` rays, and its time by theirs.
    fn at_equal_error(&self, k: usize) -> Option<(&'static str, f64)> {
        let rays = &self.rays[k];
        let good = SETTINGS.iter().zip(&self.cameras).filter(|(_, e)| e.rmse <= EQUAL * rays.rmse);
        let ratio = |(setting, entry): (&Setting, &Entry)| {
            (setting.name, Self::to_one_ray(entry) / Self::to_one_ray(rays))
        };
        good.map(ratio).min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// A camera a triangle as the paper has it, by one ray a pixel.
    fn triangles(&self) -> f64 {
        Self::to_one_ray(&self.cameras[0])
    }
}

/// One scene's map.
struct Map {
    scene: String,
    surfels: usize,
    triangles: Vec<usize>,
    sizes: Vec<ImageSize>,
    /// By triangles, then by size.
    cells: Vec<Cell>,
}

impl Map {
    /// Break-even in pixels a mirror triangle of what `ratio` gives.
    fn break_even(&self, ratio: impl Fn(&Cell) -> Option<f64>) -> Option<BreakEven> {
        let points = self.cells.iter().filter_map(|c| Some([c.pixels_a_triangle, ratio(c)?]));
        BreakEven::of(&points.collect::<Vec<_>>())
    }
}

pub(super) fn section(bench: Bench<'_>) -> anyhow::Result<Section> {
    let place = &bench.args.place;
    let given = !(place.inputs.is_empty() && place.mirror.is_empty() && place.object.is_empty());
    let built_in = |name: &str| {
        let request = Request { inputs: vec![name.to_owned()], ..place.request(DEFAULT_SURFELS) };
        arrange::scene(&request, &bench.silent())
    };
    let scenes = if given {
        vec![(bench.described()?, bench.pick(437_000, 147_000))]
    } else {
        vec![
            (built_in("knot")?, bench.pick(437_000, 147_000)),
            (built_in("room")?, bench.pick(1_000_000, 300_000)),
        ]
    };
    let (mut maps, mut blocks) = (Vec::new(), vec![Block::Text(show::NOTE.to_owned())]);
    for (i, (described, surfels)) in scenes.iter().enumerate() {
        let part = bench.turn(i, scenes.len());
        match map(part, described, part.surfels(*surfels))? {
            Some(map) => maps.push(map),
            None => blocks.push(Block::Text(format!("{}: {NOT_BUILT_IN}", described.name))),
        }
    }
    show::maps(&maps, &mut blocks)?;
    Ok(Section {
        id: "crossover",
        title: "Cameras against rays at equal error".to_owned(),
        blocks,
        figures: json!({ "scenes": maps.iter().map(show::figures).collect::<Vec<_>>() }),
    })
}

fn map(bench: Bench<'_>, described: &Scene, surfels: usize) -> anyhow::Result<Option<Map>> {
    let wanted = bench.pick(&[2_000, 8_000, 32_000, 128_000][..], &[2_000, 32_000]);
    let shares = bench.pick(&[0.25, 0.5, 1.0][..], &[0.25, 1.0]);
    let sizes: Vec<ImageSize> =
        shares.iter().map(|&share| scaled(bench.args.place.size, share)).collect();
    let (mut triangles, mut cells) = (Vec::new(), Vec::new());
    for (i, &count) in wanted.iter().enumerate() {
        let part = bench.turn(i, wanted.len());
        part.step(0.0)?;
        let Some(scene) = with_mirror_triangles(described, count) else { return Ok(None) };
        let scene = part.prepared(&scene, surfels, KdTreeLimits::default().leaf_points)?;
        triangles.push(scene.mirror_triangle_count());
        // Time goes with the pixels, nearly.
        let all: f64 = shares.iter().map(|share| share * share).sum();
        let mut done = 0.0;
        for (&size, share) in sizes.iter().zip(shares) {
            let from = 0.1 + 0.9 * done / all;
            done += share * share;
            cells.push(cell(part.part(from, 0.1 + 0.9 * done / all), &scene, size)?);
        }
    }
    Ok(Some(Map { scene: described.name.clone(), surfels, triangles, sizes, cells }))
}

fn cell(bench: Bench<'_>, scene: &PreparedScene, size: ImageSize) -> anyhow::Result<Cell> {
    let eye = bench.args.place.eye_at(scene, size)?;
    let rays = method("raytrace").expect("it is in the registry");
    let spp = SPP.map(|spp| params(rays, "", &[("spp", &spp.to_string())]));
    let cameras = SETTINGS.map(|s| params(c3rc(), s.quality, s.values));
    let mut truth = reference(scene, &eye, bench.pick(64, 32), &bench.silent())?;
    truth.picture = clipped(truth.picture);
    let judge = Judge { bench, scene, eye, truth };
    let mut stages = [
        Stage::new(scene, &eye, Box::new(Cpu::default())),
        Stage::new(scene, &eye, bench.backend()?),
    ];
    let side = |stages: &[Stage<'_>], stage, method, params: &Params| {
        Side::new(stages, stage, method, params.clone(), &bench.silent())
    };
    let one = side(&stages, 0, rays, &spp[0])?;
    let mut sides = Vec::new();
    for params in &spp[1..] {
        sides.push(side(&stages, 0, rays, params)?);
    }
    for params in &cameras {
        sides.push(side(&stages, 1, c3rc(), params)?);
    }
    let measuring = bench.part(0.3, 1.0);
    let (one, timed) =
        against(&mut stages, &one, &sides, bench.rounds(), |done| measuring.step(done))?;
    let ids = stages[0].renderer().visibility().mirror_ids.iter().filter(|&&id| id != NONE_ID);
    let mut seen = vec![false; scene.mirror_triangle_count()];
    let pixels = ids.map(|&id| seen[id as usize] = true).count();
    let seen = seen.into_iter().filter(|&seen| seen).count();
    let mut timed = std::iter::once(one).chain(timed);
    let mut entries =
        |method: &'static dyn Method, list: &[Params]| -> anyhow::Result<Vec<Entry>> {
            let entry = |(timed, params): (Timed, &Params)| {
                Ok(Entry { timed, rmse: judge.rmse(method, params)? })
            };
            timed.by_ref().take(list.len()).zip(list).map(entry).collect()
        };
    let (rays, cameras) = (entries(rays, &spp)?, entries(c3rc(), &cameras)?);
    Ok(Cell {
        triangles: scene.mirror_triangle_count(),
        size,
        pixels_a_triangle: pixels as f64 / seen.max(1) as f64,
        cameras,
        rays,
    })
}

/// As a display shows it: a few pixels with the sun in them would be all that an error tells.
fn clipped(mut picture: Picture) -> Picture {
    picture.rgb.iter_mut().flatten().for_each(|value| *value = value.min(1.0));
    picture
}

/// Tells how far pictures are from the truth.
struct Judge<'a> {
    bench: Bench<'a>,
    scene: &'a PreparedScene,
    eye: Eye,
    truth: Reference,
}

impl Judge<'_> {
    fn rmse(&self, method: &dyn Method, params: &Params) -> anyhow::Result<f64> {
        let mut renderer = Renderer::new();
        renderer.render(self.scene, &self.eye, method, params, false, &self.bench.silent())?;
        let picture = clipped(renderer.picture().clone());
        let own = compare::Side { picture: &picture, planes: None };
        let truth =
            compare::Side { picture: &self.truth.picture, planes: Some(&self.truth.planes) };
        Ok(compare::rmse(own, truth, &Set::Objects)?)
    }
}
