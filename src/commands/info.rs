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
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

pub(crate) fn run(args: &InfoArgs, cx: &Context) -> anyhow::Result<()> {
    check_json(args.json.as_ref())?;
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
        let triangles = object.mesh.triangles().len();
        let surfels = cloud.surfels.len();
        let tree = cloud.tree.statistics();
        let b = cloud.bounds;
        let (min, max) = (b.min.as_dvec3() + scene.origin, b.max.as_dvec3() + scene.origin);
        say!(
            "  object {}: {triangles} triangles, {surfels} surfels; tree: {} leaves of {:.1}, mean depth {:.1}",
            object.name,
            tree.leaves,
            tree.points_per_leaf,
            tree.mean_depth
        );
        objects.push(json!({
            "name": object.name,
            "triangles": triangles,
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
        let refusal = method.qualify(scene, &Params::defaults(info.params)).err();
        let verdict = refusal.as_ref().map_or("can draw it".to_owned(), ToString::to_string);
        say!("  method {}: {verdict}", info.id);
        methods.push(json!({ "id": info.id, "refusal": refusal.map(|e| e.to_string()) }));
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
