//! The viewer as hands use it, without a window: pointer and keys go in, pictures come back from the renderer's thread.

mod hands;
mod random;
mod snapshots;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use eframe::egui::{self, Pos2, pos2};
use egui_kittest::Harness;

use super::Opening;
use super::app::Viewer;
use super::settings::Settings;
use crate::scene::arrange::Request;
use crate::scene::prepared::PrepareOptions;

/// Longer than anything takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A ball as mirror, a red ball and a checkered ground.
const SCENE: &str = r##"
name = "small"
[eye]
position = [0.0, 1.2, 3.0]
target = [0.0, 0.5, 0.0]
[[mirror]]
name = "silver"
shape = "sphere"
triangles = 800
scale = 0.6
translate = [0.0, 0.6, 0.0]
[[object]]
name = "red"
shape = "sphere"
color = "#d02020"
scale = 0.25
translate = [1.1, 0.25, 0.6]
[[object]]
name = "ground"
shape = "ground"
pattern = { kind = "checker", colors = ["#ffffff", "#405060"], period = 0.25 }
scale = 4.0
"##;

type Hands<'a> = Harness<'a, Option<Viewer>>;

fn opening(input: &str) -> Opening {
    Opening {
        request: Request { inputs: vec![input.to_owned()], ..Request::default() },
        prepare: PrepareOptions { surfels: 20_000, ..PrepareOptions::default() },
        side: None,
        size: None,
        frames: None,
        screenshot: None,
        started: Instant::now(),
        memory: None,
        on_failure: None,
    }
}

/// A folder with [`SCENE`] in it.
fn small() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("small.toml");
    std::fs::write(&path, SCENE).expect("it is written");
    (folder, path)
}

fn opened<'a>(path: &Path, size: [f32; 2], settings: Settings) -> Hands<'a> {
    let opening = opening(&path.to_string_lossy());
    let mut settings = Some(settings);
    // Hands that press everything save, too.
    let saved = tempfile::tempdir().expect("a folder");
    let show = move |ui: &mut egui::Ui, viewer: &mut Option<Viewer>| {
        let start = || {
            let mut viewer = Viewer::new(ui.ctx(), &opening, settings.take().unwrap_or_default());
            viewer.folder = saved.path().to_owned();
            viewer
        };
        viewer.get_or_insert_with(start).ui(ui);
    };
    Harness::builder().with_size(size).with_step_dt(0.05).build_ui_state(show, None)
}

fn viewer<'a>(hands: &'a Hands<'_>) -> &'a Viewer {
    hands.state().as_ref().expect("it was made by the first pass")
}

fn viewer_mut<'a>(hands: &'a mut Hands<'_>) -> &'a mut Viewer {
    hands.state_mut().as_mut().expect("it was made by the first pass")
}

/// Steps until it holds.
fn until(hands: &mut Hands<'_>, what: &str, holds: impl Fn(&Viewer) -> bool) {
    let start = Instant::now();
    while !holds(viewer(hands)) {
        let message = &viewer(hands).message;
        assert!(start.elapsed() < PATIENCE, "{what} never happened; message: {message:?}");
        std::thread::sleep(Duration::from_millis(5));
        hands.step();
    }
}

/// Steps until the picture is the one that is wished for, whole.
fn until_drawn(hands: &mut Hands<'_>) {
    until(hands, "a whole picture", |viewer| {
        viewer.display.as_ref().is_some_and(|d| {
            d.complete
                && d.view.rest
                && d.view.eye == viewer.eye
                && d.view.size == viewer.size
                && d.view.placements == viewer.placements
                && d.view.sides[0] == viewer.settings.sides[0].side()
                && d.view.sides.len() == 1 + usize::from(viewer.settings.compare)
        })
    });
}

/// Presses at `from`, moves to `to` in few steps, as on a slow machine, releases.
fn drag(hands: &mut Hands<'_>, button: egui::PointerButton, from: Pos2, to: Pos2) {
    let press = |pos, pressed| egui::Event::PointerButton {
        pos,
        button,
        pressed,
        modifiers: egui::Modifiers::NONE,
    };
    hands.event(egui::Event::PointerMoved(from));
    hands.step();
    hands.event(press(from, true));
    hands.step();
    for i in 1_u8..=3 {
        hands.event(egui::Event::PointerMoved(from.lerp(to, f32::from(i) / 3.0)));
        hands.step();
    }
    hands.event(press(to, false));
    hands.step();
}

fn click(hands: &mut Hands<'_>, at: Pos2) {
    drag(hands, egui::PointerButton::Primary, at, at);
}

fn without_panel() -> Settings {
    Settings { panel: false, ..Settings::default() }
}

/// A dropped file.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

fn drop_file(hands: &mut Hands<'_>, path: &Path) {
    hands.input_mut().dropped_files.push(Arc::new(Dropped(path.to_owned())));
    hands.step();
}

/// A place on the canvas, as shares.
fn on_canvas(hands: &Hands<'_>, x: f32, y: f32) -> Pos2 {
    let (size, [left, top]) = (viewer(hands).size, viewer(hands).canvas);
    pos2(left as f32 + x * size.width as f32, top as f32 + y * size.height as f32)
}
