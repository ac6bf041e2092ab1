//! File dialogs: asked for on the window's thread, as some systems want it, waited for on another.

use std::path::PathBuf;
use std::sync::mpsc::Sender;

use eframe::egui;

use super::app::Chosen;
use crate::scene::load;

/// What is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    Open,
    Picture,
    Aov,
    Scene,
}

/// Asks; the answer comes through `to`, if there is one.
pub(super) fn ask(kind: Kind, to: Sender<Chosen>, context: &egui::Context) {
    let dialog = rfd::AsyncFileDialog::new();
    let context = context.clone();
    let path = |file: rfd::FileHandle| file.path().to_owned();
    match kind {
        Kind::Open => {
            let dialog = dialog
                .set_title("Open a scene or models")
                .add_filter("scenes and models", &[&["toml"], load::EXTENSIONS].concat());
            let waiting = dialog.pick_files();
            wait(context, to, async move {
                let files = waiting.await?;
                Some(Chosen::Open(files.iter().map(|f| f.path().to_owned()).collect()))
            });
        }
        Kind::Picture => {
            let dialog = dialog
                .set_title("Save the picture")
                .set_file_name("catoptric.png")
                .add_filter("pictures", &["png", "exr", "hdr"]);
            let waiting = dialog.save_file();
            wait(context, to, async move { waiting.await.map(path).map(Chosen::Picture) });
        }
        Kind::Aov => {
            let dialog = dialog
                .set_title("Save what mirrors show")
                .set_file_name("catoptric.exr")
                .add_filter("multi-layer EXR", &["exr"]);
            let waiting = dialog.save_file();
            wait(context, to, async move { waiting.await.map(path).map(Chosen::Aov) });
        }
        Kind::Scene => {
            let dialog = dialog
                .set_title("Save the scene")
                .set_file_name("scene.toml")
                .add_filter("scenes", &["toml"]);
            let waiting = dialog.save_file();
            wait(context, to, async move {
                let path: PathBuf = waiting.await.map(path)?;
                Some(Chosen::Scene(path))
            });
        }
    }
}

fn wait(
    context: egui::Context,
    to: Sender<Chosen>,
    answer: impl Future<Output = Option<Chosen>> + Send + 'static,
) {
    let run = move || {
        if let Some(chosen) = pollster::block_on(answer) {
            // Nobody listens any more once the window is closed.
            let _ = to.send(chosen);
            context.request_repaint();
        }
    };
    // Without a thread there is no dialog: as if it had been cancelled.
    let _ = std::thread::Builder::new().name("dialog".into()).spawn(run);
}
