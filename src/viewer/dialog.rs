//! File dialogs: asked for on the window's thread, as some systems want it, waited for on another.

use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

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

impl Kind {
    /// What is proposed as the name of a file.
    fn file_name(self) -> &'static str {
        match self {
            Self::Open => "",
            Self::Picture => "catoptric.png",
            Self::Aov => "catoptric.exr",
            Self::Scene => "scene.toml",
        }
    }

    /// Where to save if there is no dialog to ask with: a name in `folder` that no file has yet. `None` if nothing is saved.
    pub(super) fn instead(self, folder: &Path) -> Option<PathBuf> {
        let (stem, extension) = self.file_name().split_once('.')?;
        let numbered = |n: u32| match n {
            1 => folder.join(self.file_name()),
            _ => folder.join(format!("{stem}-{n}.{extension}")),
        };
        (1..=9999).map(numbered).find(|path| !path.exists())
    }
}

/// No hand cancels a dialog sooner: then the system had none to show.
const SOONEST: Duration = Duration::from_millis(250);

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
            wait(kind, context, to, async move {
                let files = waiting.await?;
                Some(Chosen::Open(files.iter().map(|f| f.path().to_owned()).collect()))
            });
        }
        Kind::Picture => {
            let dialog = dialog
                .set_title("Save the picture")
                .set_file_name(kind.file_name())
                .add_filter("pictures", &["png", "exr", "hdr"]);
            let waiting = dialog.save_file();
            wait(kind, context, to, async move { waiting.await.map(path).map(Chosen::Picture) });
        }
        Kind::Aov => {
            let dialog = dialog
                .set_title("Save what mirrors show")
                .set_file_name(kind.file_name())
                .add_filter("multi-layer EXR", &["exr"]);
            let waiting = dialog.save_file();
            wait(kind, context, to, async move { waiting.await.map(path).map(Chosen::Aov) });
        }
        Kind::Scene => {
            let dialog = dialog
                .set_title("Save the scene")
                .set_file_name(kind.file_name())
                .add_filter("scenes", &["toml"]);
            let waiting = dialog.save_file();
            wait(kind, context, to, async move {
                let path: PathBuf = waiting.await.map(path)?;
                Some(Chosen::Scene(path))
            });
        }
    }
}

fn wait(
    kind: Kind,
    context: egui::Context,
    to: Sender<Chosen>,
    answer: impl Future<Output = Option<Chosen>> + Send + 'static,
) {
    let run = move || {
        let start = Instant::now();
        let answer = pollster::block_on(answer);
        let none = || (start.elapsed() < SOONEST).then_some(Chosen::NoDialog(kind));
        if let Some(chosen) = answer.or_else(none) {
            // Nobody listens any more once the window is closed.
            let _ = to.send(chosen);
            context.request_repaint();
        }
    };
    // Without a thread there is no dialog: as if it had been cancelled.
    let _ = std::thread::Builder::new().name("dialog".into()).spawn(run);
}
