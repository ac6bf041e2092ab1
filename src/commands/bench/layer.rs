//! `catoptric bench layer`: the reflected layer against reflected rays.

use std::path::PathBuf;

use catoptric::analysis::measure::{Quantity, Ratio, Rounds, Side, Stage, Timed, against};
use catoptric::backend::Backend;
use catoptric::backend::cpu::Cpu;
use catoptric::camera::Eye;
use catoptric::methods::{Method, Params, method};
use catoptric::scene::arrange::{self, Request};
use catoptric::scene::description::Scene;
use catoptric::scene::prepared::DEFAULT_SURFELS;
use catoptric::scene::prepared::PrepareOptions;
use catoptric::scene::{PreparedScene, builtin};
use catoptric::{Context, Error};
use clap::{ArgMatches, Args};
use serde_json::json;

use super::super::render::{HowArgs, figures, where_it_ran};
use super::super::{SceneArgs, check_json, chosen_method, ms, say, write_json};
use super::report::{self, Block, Section, Table};
use super::run::{Bench, c3rc, params};
use super::tables::frame_figures;

/// See [`super::What::Layer`].
#[derive(Args, Debug)]
pub(crate) struct LayerArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    how: HowArgs,
    /// Pairs of measurements
    #[arg(long, value_name = "N", default_value_t = 25, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeat: u32,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Rounds that warm caches and memory up and do not count.
const WARM_UP: u32 = 3;

pub(super) fn run(args: &LayerArgs, matches: &ArgMatches, cx: &Context) -> anyhow::Result<()> {
    check_json(args.json.as_ref())?;
    let (method, params, leaf) = chosen_method(&args.how, matches)?;
    if method.info().id == "raytrace" {
        let problem = "raytrace is what the layer is compared with";
        return Err(Error::input("--method", "", problem, "choose another method").into());
    }
    let backend = args.how.backend(method)?;
    let ready = args.scene.ready(leaf, cx)?;
    let rounds = Rounds {
        repeat: args.repeat,
        warm_up: WARM_UP,
        least_ms: 0.0,
        least_frames: 1,
        most_ms: f64::INFINITY,
    };
    let step = |done| cx.step("measuring", done);
    let pair =
        against_rays(&ready.scene, &ready.eye, backend, method, params, rounds, (cx, &step))?;
    let report = pair.layer.report();
    if report.mirror_pixels == 0 {
        let remedy = "choose another --eye, --target or --size";
        return Err(Error::input("bench layer", "", "the eye sees no mirror", remedy).into());
    }
    say!(
        "{} by {} on {}: layer {:.2} ms, rays {:.2} ms, ratio {:.3} (quartiles {:.3} to {:.3}, {} pairs{})",
        ready.scene.name,
        report.method,
        where_it_ran(&report),
        pair.layer_ms.median,
        pair.rays_ms.median,
        pair.ratio.of.median,
        pair.ratio.of.q1,
        pair.ratio.of.q3,
        args.repeat,
        if pair.ratio.noisy { ", noisy" } else { "" }
    );
    let mut value = figures(&ready, &report);
    value["layer_ms"] = ms(Some(pair.layer_ms.median));
    value["rays_ms"] = ms(Some(pair.rays_ms.median));
    value["ratio"] = report::ratio(Some(pair.ratio));
    value["pairs"] = json!(args.repeat);
    write_json(args.json.as_ref(), &value)
}

/// A layer beside the rays of the same pixels.
pub(super) struct Pair {
    pub(super) layer: Timed,
    pub(super) layer_ms: Quantity,
    pub(super) rays_ms: Quantity,
    /// The layer's time by the rays'.
    pub(super) ratio: Ratio,
}

/// What long work is given here: the context, and where to say how far it is.
pub(super) type Watch<'a> = (&'a Context, &'a dyn Fn(f64) -> catoptric::Result<()>);

/// Measures the layer and one ray a pixel in turn.
pub(super) fn against_rays(
    scene: &PreparedScene,
    eye: &Eye,
    backend: Box<dyn Backend>,
    layer: &'static dyn Method,
    params: Params,
    rounds: Rounds,
    (cx, step): Watch<'_>,
) -> anyhow::Result<Pair> {
    let rays = method("raytrace").expect("it is in the registry");
    let mut rays_params = Params::defaults(rays.info().params);
    // Both look for what mirrors hide, or neither.
    let info = rays.info().param("mirror-occlusion");
    if params.get(info.id).is_some() {
        rays_params.set(info, params.choice(info.id))?;
    }
    let on_cpu = Box::new(Cpu::default());
    let mut stages = [Stage::new(scene, eye, backend), Stage::new(scene, eye, on_cpu)];
    let layer = Side::new(&stages, 0, layer, params, cx)?;
    let rays = Side::new(&stages, 1, rays, rays_params, cx)?;
    let (rays, mut timed) = against(&mut stages, &rays, &[layer], rounds, step)?;
    let (layer, all) = (timed.swap_remove(0), "there is a round");
    Ok(Pair {
        layer_ms: layer.total().expect(all),
        rays_ms: rays.total().expect(all),
        ratio: layer.ratio().expect(all),
        layer,
    })
}

/// What the layer is drawn with, from fast to exact.
const QUALITIES: [&str; 3] = ["draft", "default", "best"];

/// The layer by every quality against one ray a pixel, on the built-in scenes or the given one.
pub(super) fn section(bench: Bench<'_>) -> anyhow::Result<Section> {
    let place = &bench.args.place;
    let given = !(place.inputs.is_empty() && place.mirror.is_empty() && place.object.is_empty());
    let scenes: Vec<(Scene, usize)> = if given {
        vec![(
            arrange::scene(&place.request(DEFAULT_SURFELS), &bench.silent())?,
            bench.pick(3_000_000, 300_000),
        )]
    } else {
        let counts = bench.pick([3_000_000, 3_000_000, 437_000], [300_000, 300_000, 147_000]);
        let named = |(name, count): (&&str, usize)| {
            let request =
                Request { inputs: vec![(*name).to_owned()], ..place.request(DEFAULT_SURFELS) };
            Ok((arrange::scene(&request, &bench.silent())?, count))
        };
        builtin::SCENES.iter().zip(counts).map(named).collect::<catoptric::Result<_>>()?
    };
    let head = [
        "scene",
        "surfels",
        "quality",
        "layer ms",
        "1 ray, ms",
        "layer by rays",
        "projections",
        "valid %",
    ];
    let mut table = Table::new("The reflected layer against one ray a pixel", &head);
    let mut list = Vec::new();
    for (i, (described, count)) in scenes.iter().enumerate() {
        let part = bench.turn(i, scenes.len());
        part.step(0.0)?;
        let leaf = PrepareOptions::default().tree.leaf_points;
        let scene = part.prepared(described, part.surfels(*count), leaf)?;
        let eye = place.eye(&scene)?;
        let rays = method("raytrace").expect("it is in the registry");
        let mut stages = [
            Stage::new(&scene, &eye, part.backend()?),
            Stage::new(&scene, &eye, Box::new(Cpu::default())),
        ];
        let cx = part.silent();
        let one = Side::new(&stages, 1, rays, params(rays, "", &[]), &cx)?;
        let own = |quality| Side::new(&stages, 0, c3rc(), params(c3rc(), quality, &[]), &cx);
        let sides: catoptric::Result<Vec<Side>> = QUALITIES.into_iter().map(own).collect();
        let sides = sides?;
        let measuring = part.part(0.3, 1.0);
        let step = |done| measuring.step(done);
        let (one, timed) = against(&mut stages, &one, &sides, part.rounds(), step)?;
        for (quality, timed) in QUALITIES.iter().zip(&timed) {
            let report = timed.report();
            table.row(vec![
                described.name.clone(),
                scene.surfel_count().to_string(),
                (*quality).to_owned(),
                report::median(timed.total()),
                report::median(one.total()),
                report::times(timed.ratio()),
                report.projections.map_or("–".into(), |n| n.to_string()),
                report.valid_share().map_or("–".into(), |v| report::number(100.0 * v)),
            ]);
            let mut value = frame_figures(timed);
            value["scene"] = json!(described.name);
            value["surfels"] = json!(scene.surfel_count());
            value["quality"] = json!(quality);
            value["rays_ms"] = report::quantity(one.total());
            value["ratio"] = report::ratio(timed.ratio());
            list.push(value);
        }
    }
    let note = "The layer of c3rc is everything from the list of visible triangles to resolved colours; the rays are those of the \
                same pixels. Neither includes visibility, environment or composition. Below 1 the layer is faster.";
    Ok(Section {
        id: "layer",
        title: format!("The layer against rays ({} x {})", place.size.width, place.size.height),
        blocks: vec![Block::Text(note.to_owned()), Block::Table(table)],
        figures: json!({ "size": [place.size.width, place.size.height], "rows": list }),
    })
}
