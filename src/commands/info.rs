//! `catoptric info`: what a scene holds, before anything is rendered.

use std::path::PathBuf;

use catoptric::Context;
use catoptric::methods::{METHODS, Params};
use clap::Args;
use serde_json::json;

use super::{SceneArgs, check_json, ms, say, write_json};

/// Show what a scene holds: mirrors, objects, surfels, trees
#[derive(Args, Debug)]
pub(crate) struct InfoArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// List this machine's graphics adapters instead: names, limits and features
    #[arg(long)]
    adapters: bool,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

pub(crate) fn run(args: &InfoArgs, cx: &Context) -> anyhow::Result<()> {
    check_json(args.json.as_ref())?;
    if args.adapters {
        return adapters(args);
    }
    let ready = args.scene.ready(None, cx)?;
    let scene = &ready.scene;
    say!("{}: {} surfels", scene.name, scene.surfel_count());
    let mut mirrors = Vec::new();
    for mirror in &scene.mirrors {
        let triangles = mirror.mesh.triangles().len();
        say!("  mirror {}: {triangles} triangles", mirror.name);
        mirrors.push(json!({ "name": mirror.name, "triangles": triangles }));
    }
    let mut objects = Vec::new();
    for (object, cloud) in scene.objects.iter().zip(&scene.clouds) {
        let triangles = if object.is_cloud { 0 } else { object.mesh.triangles().len() };
        let surfels = cloud.surfels.len();
        let what = if object.is_cloud { "points".into() } else { format!("{triangles} triangles") };
        let tree = cloud.tree.statistics();
        let b = cloud.bounds;
        let (min, max) = (b.min.as_dvec3() + scene.origin, b.max.as_dvec3() + scene.origin);
        say!(
            "  object {}: {what}, {surfels} surfels; tree: {} leaves of {:.1}, mean depth {:.1}",
            object.name,
            tree.leaves,
            tree.points_per_leaf,
            tree.mean_depth
        );
        objects.push(json!({
            "name": object.name,
            "triangles": triangles,
            "is_cloud": object.is_cloud,
            "surfels": surfels,
            "box": { "min": min.to_array(), "max": max.to_array() },
            "tree": {
                "leaves": tree.leaves,
                "points_per_leaf": tree.points_per_leaf,
                "mean_depth": tree.mean_depth,
            },
        }));
    }
    let mut methods = Vec::new();
    for method in METHODS {
        let info = method.info();
        let (facts, refusal) = match method.qualify(scene, &Params::defaults(info.params)) {
            Ok(facts) => (facts, None),
            Err(error) => (Vec::new(), Some(error.to_string())),
        };
        say!("  method {}: {}", info.id, refusal.as_deref().unwrap_or("can draw it"));
        facts.iter().for_each(|fact| say!("    {fact}"));
        methods.push(json!({ "id": info.id, "refusal": refusal, "facts": facts }));
    }
    let times = scene.times;
    say!(
        "  ms: load {:.0}, sampling {:.0}, trees {:.0}, shading {:.0}",
        ready.load_ms,
        times.sample_ms,
        times.tree_ms,
        times.shade_ms
    );
    let value = json!({
        "scene": scene.name,
        "notes": ready.described.notes,
        "surfels": scene.surfel_count(),
        "mirrors": mirrors,
        "objects": objects,
        "methods": methods,
        "ms": {
            "load": ms(Some(ready.load_ms)),
            "sample": ms(Some(times.sample_ms)),
            "tree": ms(Some(times.tree_ms)),
            "shade": ms(Some(times.shade_ms)),
        },
    });
    write_json(args.json.as_ref(), &value)
}

#[cfg(feature = "gpu")]
fn adapters(args: &InfoArgs) -> anyhow::Result<()> {
    let list = catoptric::backend::gpu::adapters();
    if list.is_empty() {
        say!("no graphics adapter was found: --backend cpu draws everything");
    }
    for (i, a) in list.iter().enumerate() {
        say!("{i} {} ({}{})", a.name, a.api, if a.software { ", software" } else { "" });
        say!("  driver {}", a.driver);
        say!(
            "  storage binding {} MB, {} storage buffers a stage, pictures up to {} pixels a side",
            a.binding_bytes / 1_000_000,
            a.storage_buffers,
            a.picture_px
        );
        say!("  timestamps: {}, 64-bit atomics: {}", yes(a.timestamps), yes(a.atomics_64));
    }
    write_json(args.json.as_ref(), &json!({ "adapters": adapter_figures(&list) }))
}

/// What the README documents of each adapter.
#[cfg(feature = "gpu")]
pub(crate) fn adapter_figures(list: &[catoptric::backend::gpu::Adapter]) -> serde_json::Value {
    list.iter()
        .map(|a| {
            json!({
                "name": a.name,
                "api": a.api,
                "driver": a.driver,
                "software": a.software,
                "binding_bytes": a.binding_bytes,
                "storage_buffers": a.storage_buffers,
                "picture_px": a.picture_px,
                "timestamps": a.timestamps,
                "atomics_64": a.atomics_64,
            })
        })
        .collect()
}

#[cfg(feature = "gpu")]
fn yes(is: bool) -> &'static str {
    if is { "yes" } else { "no" }
}

#[cfg(not(feature = "gpu"))]
fn adapters(_args: &InfoArgs) -> anyhow::Result<()> {
    let problem = "this program was built without the feature gpu";
    let remedy = "build it with --features gpu";
    Err(catoptric::Error::input("--adapters", "", problem, remedy).into())
}
