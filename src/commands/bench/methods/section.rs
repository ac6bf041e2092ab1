//! The methods as a section of a report.

use catoptric::analysis::methods::{Candidate, Effort, compare_methods};
use catoptric::image::io::png;
use serde_json::Value;

use super::super::super::render::HowArgs;
use super::super::super::{Ready, SceneArgs};
use super::super::report::{Block, Image, Plot, Section, Table, number, ratios, times};
use super::super::run::Bench;
use super::{MethodsArgs, figures, plot, sheet};

/// All methods on the built-in scene, or the given one.
pub(crate) fn section(bench: Bench<'_>) -> anyhow::Result<Section> {
    let args = args(bench);
    let cx = bench.silent();
    let ready = args.scene.ready(None, &cx)?;
    let effort = Effort {
        spp: args.spp,
        repeat: args.repeat,
        frames: args.frames,
        orbit: args.orbit.to_radians(),
    };
    bench.step(0.2)?;
    let backend = |_, method: &dyn catoptric::methods::Method| {
        let backend = if method.info().has_shaders { args.backend.clone() } else { "cpu".into() };
        HowArgs { backend, ..HowArgs::standard() }.backend(method)
    };
    let Ready { scene, eye, described, .. } = &ready;
    let candidates = Candidate::all(!args.defaults);
    let (reference, entries) =
        compare_methods(described, scene, eye, candidates, effort, &backend, &cx)?;
    bench.step(0.9)?;
    let figures = figures(&ready, &args, &entries);
    let size = eye.size;
    let blocks = vec![
        Block::Text(format!(
            "Every method that can draw the scene, held against {} rays a pixel where objects are reflected. Reflection is \
             everything but visibility and the direct view; times are medians of {} turns, each the fastest of three frames that \
             alternate with one ray a pixel.",
            args.spp, args.repeat
        )),
        Block::Plot(Plot {
            name: "methods-sheet".into(),
            caption:
                "The mirrors by each method over maps of FLIP: black is equal to the reference."
                    .into(),
            image: Image::Png(png(&sheet::sheet(&reference, &entries, false))?),
        }),
        Block::Table(table(&figures)),
        Block::Plot(Plot {
            name: "methods-error-against-time".into(),
            caption:
                "FLIP over the time of a frame's reflections, each method's quality knobs turned."
                    .into(),
            image: Image::Svg(plot::errors(&described.name, &entries)?),
        }),
    ];
    Ok(Section {
        id: "methods",
        title: format!("All methods on {} ({} x {})", described.name, size.width, size.height),
        blocks,
        figures,
    })
}

fn args(bench: Bench<'_>) -> MethodsArgs {
    let mut place = bench.args.place.clone();
    if bench.args.quick {
        place.size = super::super::growth::scaled(place.size, 0.5);
    }
    MethodsArgs {
        scene: SceneArgs {
            place,
            surfels: bench.surfels(bench.pick(1_000_000, 200_000)),
            leaf: None,
            leaf_size: 0.0,
        },
        output: "".into(),
        backend: if bench.args.backend == "gpu" { "gpu".into() } else { "cpu".into() },
        adapter: None,
        spp: bench.pick(256, 32),
        repeat: bench.args.repeat.unwrap_or(bench.pick(5, 3)),
        frames: bench.pick(12, 3),
        orbit: 3.0,
        with: Vec::new(),
        steps: false,
        defaults: bench.args.quick,
        json: None,
    }
}

/// The figures of each method.
fn table(figures: &Value) -> Table {
    let mut table = Table::new(
        "Methods with their defaults",
        &[
            "method",
            "runs on",
            "reflection ms",
            "to 1 ray",
            "RMSE",
            "FLIP",
            "missing %",
            "displacement px, median",
            "95 %",
            "flicker",
        ],
    );
    for method in figures["methods"].as_array().into_iter().flatten() {
        let name = method["method"].as_str().unwrap_or_default().to_owned();
        if let Some(refused) = method["refused"].as_str() {
            let mut cells = vec![name, refused.to_owned()];
            cells.resize(table.head.len(), "–".into());
            table.row(cells);
            continue;
        }
        let at = |value: &Value, factor: f64| {
            value.as_f64().map_or("–".into(), |x| number(factor * x))
        };
        table.row(vec![
            name,
            method["backend"].as_str().unwrap_or_default().to_owned(),
            at(&method["ms"]["reflection"], 1.0),
            times(ratios(&method["ratio_to_1_ray"]).first().map(|found| found.1)),
            method["rmse"].as_f64().map_or("–".into(), |x| format!("{x:.4}")),
            method["flip"].as_f64().map_or("–".into(), |x| format!("{x:.4}")),
            at(&method["missing"], 100.0),
            at(&method["displacement_px"]["median"], 1.0),
            at(&method["displacement_px"]["p95"], 1.0),
            method["flicker"].as_f64().map_or("–".into(), |x| format!("{x:.4}")),
        ]);
    }
    table
}
