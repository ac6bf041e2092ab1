//! `catoptric bench`: timings as ratios within one run.

pub(crate) mod methods;

use std::path::PathBuf;

use catoptric::frame::{FrameReport, Renderer};
use catoptric::methods::{Method, Params};
use catoptric::{Context, Error};
use clap::{ArgMatches, Args, Subcommand};
use serde_json::json;

use super::render::{HowArgs, figures, where_it_ran};
use super::{Ready, SceneArgs, check_json, chosen_method, ms, say, write_json};

/// Measure, as ratios within one run
#[derive(Args, Debug)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    pub(crate) what: What,
}

/// What to measure.
#[derive(Subcommand, Debug)]
pub(crate) enum What {
    /// The reflected layer against ray tracing the same pixels, one ray each, interleaved A B A B
    ///
    /// The layer is everything from the list of visible triangles to resolved colours: patches, cameras,
    /// culling, projection, splatting, resolve and clear. The rays are traced by the best triangle BVH that we
    /// know of in Rust, in tile order on all cores. Neither side includes the id pre-pass, primary rays,
    /// environment or composite.
    Layer(LayerArgs),
    /// Every method that can draw the scene against many rays a pixel: contact sheet, table, error against time
    ///
    /// Writes a folder: the pictures beside the reference with maps of their errors (sheet.png), a table (methods.md,
    /// methods.json: time by stage, RMSE, PSNR, FLIP, missing share, displacement in pixels, flicker over an orbit) and
    /// the error over the time with each method's quality knobs turned (error-against-time.svg).
    Methods(methods::MethodsArgs),
}

/// See [`What::Layer`].
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

/// Pairs that warm caches and memory up and do not count.
const WARM_UP: u32 = 3;

pub(crate) fn layer(args: &LayerArgs, matches: &ArgMatches, cx: &Context) -> anyhow::Result<()> {
    check_json(args.json.as_ref())?;
    let (method, params, leaf) = chosen_method(&args.how, matches)?;
    if method.info().id == "raytrace" {
        let problem = "raytrace is what the layer is compared with";
        return Err(Error::input("--method", "", problem, "choose another method").into());
    }
    let rays = catoptric::methods::method("raytrace").expect("it is in the registry");
    let mut rays_params = Params::defaults(rays.info().params);
    // Both look for what mirrors hide, or neither.
    let info = rays.info().param("mirror-occlusion");
    rays_params.set(info, params.choice(info.id))?;
    let renderer = args.how.renderer(method)?;
    let ready = args.scene.ready(leaf, cx)?;
    let mut a = Side::new(&ready, renderer, method, params, cx)?;
    let mut b = Side::new(&ready, Renderer::new(), rays, rays_params, cx)?;
    let (mut layers, mut traced, mut ratios, mut reports) = (vec![], vec![], vec![], vec![]);
    for i in 0..args.repeat + WARM_UP {
        cx.step("measuring", f64::from(i) / f64::from(args.repeat + WARM_UP))?;
        let report = a.run(&ready)?;
        let layer_ms = report.layer_ms.or(report.rays_ms).unwrap_or(f64::NAN);
        if report.mirror_pixels == 0 {
            let remedy = "choose another --eye, --target or --size";
            return Err(Error::input("bench layer", "", "the eye sees no mirror", remedy).into());
        }
        let rays_ms = b.run(&ready)?.rays_ms.unwrap_or(f64::NAN);
        if i >= WARM_UP {
            layers.push(layer_ms);
            traced.push(rays_ms);
            ratios.push(layer_ms / rays_ms);
            reports.push(report);
        }
    }
    let report = FrameReport::median(&reports);
    let (layer_ms, rays_ms) = (quartiles(&mut layers), quartiles(&mut traced));
    let ratio = quartiles(&mut ratios);
    say!(
        "{} by {} on {}: layer {:.2} ms, rays {:.2} ms, ratio {:.3} (quartiles {:.3} to {:.3}, {} pairs)",
        ready.scene.name,
        report.method,
        where_it_ran(&report),
        layer_ms[1],
        rays_ms[1],
        ratio[1],
        ratio[0],
        ratio[2],
        args.repeat
    );
    let mut value = figures(&ready, &report);
    value["layer_ms"] = ms(Some(layer_ms[1]));
    value["rays_ms"] = ms(Some(rays_ms[1]));
    value["ratio"] = json!({ "q1": ratio[0], "median": ratio[1], "q3": ratio[2] });
    value["pairs"] = json!(args.repeat);
    write_json(args.json.as_ref(), &value)
}

/// One side of the comparison, with its own memory.
struct Side {
    renderer: Renderer,
    method: &'static dyn Method,
    params: Params,
    made: catoptric::methods::Made,
}

impl Side {
    fn new(
        ready: &Ready,
        mut renderer: Renderer,
        method: &'static dyn Method,
        params: Params,
        cx: &Context,
    ) -> anyhow::Result<Self> {
        method.qualify(&ready.scene, &params)?;
        let made = method.prepare(&ready.scene, &params, cx)?;
        renderer.see(&ready.scene, &ready.eye);
        Ok(Self { renderer, method, params, made })
    }

    fn run(&mut self, ready: &Ready) -> anyhow::Result<FrameReport> {
        let (report, _) = self.renderer.reflect(
            &ready.scene,
            &ready.eye,
            self.method,
            &self.made,
            &self.params,
            false,
        )?;
        Ok(report)
    }
}

/// First quartile, median, third quartile (nearest rank).
fn quartiles(values: &mut [f64]) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    let last = values.len() - 1;
    [last / 4, last / 2, last - last / 4].map(|i| values[i])
}
