//! The panels as they look. Snapshots are drawn by a software adapter; where there is none they are not compared.

use egui_kittest::SnapshotOptions;

use super::super::settings::MirrorColors;

use super::*;

fn has_adapter() -> bool {
    let found = crate::backend::gpu::adapters().iter().any(|adapter| adapter.software);
    if !found {
        assert!(
            std::env::var_os("CATOPTRIC_REQUIRE_GPU").is_none(),
            "CATOPTRIC_REQUIRE_GPU is set, but there is no software adapter"
        );
        println!("GPU: not tested (no adapter)");
    }
    found
}

#[test]
fn panels_look_as_reviewed() {
    if !has_adapter() {
        return;
    }
    let (_folder, path) = small();
    let opening = opening(&path.to_string_lossy());
    let show = move |ui: &mut egui::Ui, viewer: &mut Option<Viewer>| {
        viewer.get_or_insert_with(|| Viewer::new(ui.ctx(), &opening, Settings::default())).ui(ui);
    };
    let mut hands: Hands<'_> =
        Harness::builder().with_size([900.0, 640.0]).wgpu().build_ui_state(show, None);
    hands.step();
    until_drawn(&mut hands);
    // Times differ from run to run.
    viewer_mut(&mut hands).history.clear();
    if let Some(display) = &mut viewer_mut(&mut hands).display {
        display.reports.clear();
    }
    hands.step();
    // Of the picture itself a few pixels may lie on the other side of an edge.
    let options = SnapshotOptions::new().max_failed_pixels(60);
    hands.snapshot_options("viewer", &options);
    viewer_mut(&mut hands).help = true;
    for _ in 0..8 {
        hands.step();
    }
    hands.snapshot_options("viewer-help", &options);
}

/// The README's pictures of the window. `CATOPTRIC_BLESS=readme` writes them.
#[test]
fn screenshots_of_the_readme() {
    if !has_adapter() {
        return;
    }
    let bless = std::env::var("CATOPTRIC_BLESS").as_deref() == Ok("readme");
    let opening = Opening {
        prepare: PrepareOptions {
            surfels: if bless { 3_000_000 } else { 300_000 },
            ..PrepareOptions::default()
        },
        request: Request::default(),
        ..opening("")
    };
    let show = move |ui: &mut egui::Ui, viewer: &mut Option<Viewer>| {
        viewer.get_or_insert_with(|| Viewer::new(ui.ctx(), &opening, Settings::default())).ui(ui);
    };
    let mut hands: Hands<'_> = Harness::builder()
        .with_step_dt(0.05)
        .with_size([1280.0, 760.0])
        .wgpu()
        .build_ui_state(show, None);
    hands.step();
    until_drawn(&mut hands);
    let take = |hands: &mut Hands<'_>, name: &str| {
        hands.step();
        let picture = hands.render().expect("it is drawn");
        let colors: std::collections::HashSet<_> = picture.pixels().map(|p| p.0).collect();
        assert!(colors.len() > 5000, "{name}: a picture of the scene is in it");
        if bless {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(name);
            picture.save(path).expect("it is written");
        }
    };
    take(&mut hands, "viewer.png");
    viewer_mut(&mut hands).settings.compare = true;
    hands.step();
    until_drawn(&mut hands);
    until(&mut hands, "figures", |v| v.display.as_ref().is_some_and(|d| d.errors.is_some()));
    take(&mut hands, "viewer-compare.png");
    let settings = &mut viewer_mut(&mut hands).settings;
    (settings.compare, settings.inspect) = (false, true);
    hands.step();
    until(&mut hands, "planes", |v| v.display.as_ref().is_some_and(|d| d.view.planes));
    let at = on_canvas(&hands, 0.445, 0.635);
    click(&mut hands, at);
    until(&mut hands, "a kept camera", |v| v.pinned.as_ref().is_some_and(|p| p.trace.is_some()));
    viewer_mut(&mut hands).selected = None;
    take(&mut hands, "viewer-inside.png");
    let settings = &mut viewer_mut(&mut hands).settings;
    (settings.inspect, settings.paths, settings.caustic) = (false, true, true);
    settings.mirror = MirrorColors::Class;
    viewer_mut(&mut hands).pinned = None;
    hands.step();
    until(&mut hands, "the caustic", |v| {
        v.display.as_ref().is_some_and(|d| d.map.is_some() && !d.caustic.is_empty())
    });
    // A point of the ground, which the belly shows, too.
    let at = on_canvas(&hands, 0.47, 0.93);
    click(&mut hands, at);
    until(&mut hands, "paths", |v| v.pinned.as_ref().is_some_and(|p| !p.paths.is_empty()));
    viewer_mut(&mut hands).selected = None;
    take(&mut hands, "viewer-paths.png");
}
