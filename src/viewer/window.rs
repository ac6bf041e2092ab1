//! The system's window around the viewer.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use eframe::egui::{self, ColorImage, ScreenshotCallback, ViewportCommand};

use super::app::Viewer;
use super::measure::{Course, Outcome};
use super::settings::{Settings, SideSettings};
use super::{Opening, blit};
use crate::camera::eye::ImageSize;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::image::io::write_bytes;

/// Key of the settings in the system's folder for them.
const SETTINGS: &str = "settings";
/// Where that is.
const APP: &str = "catoptric";

/// How often interrupts are looked for.
const LOOK: Duration = Duration::from_millis(100);

/// What an opened window leaves.
type Left = Arc<Mutex<Option<Result<Outcome>>>>;

/// Opens the window and returns once it is closed; with what was measured, if that was asked for.
///
/// # Errors
/// There is no display or nothing that can draw on it; the screenshot cannot be written; or cancelled.
pub fn run(opening: &Opening, cx: &Context) -> Result<Option<Outcome>> {
    let size = opening.size.unwrap_or(ImageSize { width: 1280, height: 720 });
    let mut builder = egui::ViewportBuilder::default()
        .with_title("Catoptric")
        .with_app_id(APP)
        .with_min_inner_size([160.0, 120.0])
        .with_drag_and_drop(true);
    builder = builder.with_inner_size([size.width as f32, size.height as f32]);
    let options = eframe::NativeOptions {
        viewport: builder,
        persist_window: !opening.is_measurement() && opening.size.is_none(),
        // Pictures are shown as they were made.
        dithering: false,
        ..eframe::NativeOptions::default()
    };
    let left = Left::default();
    let own = Arc::clone(&left);
    let watched = Watch::default();
    let watch = watched.clone();
    let interrupt = cx.clone();
    let create: eframe::AppCreator<'_> = Box::new(move |cc| {
        watch.start(interrupt, cc.egui_ctx.clone());
        Ok(Box::new(Window::new(cc, opening, own)))
    });
    let closed = eframe::run_native(APP, options, create);
    watched.0.store(true, Ordering::Relaxed);
    closed.map_err(|error| {
        let problem = match error {
            eframe::Error::WinitEventLoop(_) => "cannot be opened: there is no display".into(),
            error => format!("cannot be opened: {error}"),
        };
        let remedy = "use a machine with a display (over ssh: ssh -X, or a remote desktop), or `catoptric render`";
        Error::input("the window", "", problem, remedy)
    })?;
    cx.check()?;
    let mut left = left.lock().unwrap_or_else(PoisonError::into_inner);
    left.take().transpose()
}

/// Closes the window when the program is interrupted; until this says that it is closed.
#[derive(Clone, Default)]
struct Watch(Arc<AtomicBool>);

impl Watch {
    fn start(self, cx: Context, window: egui::Context) {
        let run = move || {
            while !self.0.load(Ordering::Relaxed) {
                if cx.check().is_err() {
                    window.send_viewport_cmd(ViewportCommand::Close);
                    window.request_repaint();
                    return;
                }
                std::thread::sleep(LOOK);
            }
        };
        // Without it, a second interrupt ends the program.
        let _ = std::thread::Builder::new().name("interrupt".into()).spawn(run);
    }
}

struct Window {
    viewer: Viewer,
    course: Option<Course>,
    /// Where a picture of the window is to be written; gone once it was asked for.
    screenshot: Option<PathBuf>,
    /// Everything is measured: it closes soon.
    closing: bool,
    remembers: bool,
    left: Left,
    scale: f32,
    /// Whom failures are told to, and when the last one was.
    on_failure: Option<fn(&str)>,
    failed: Option<Instant>,
}

impl Window {
    fn new(cc: &eframe::CreationContext<'_>, opening: &Opening, left: Left) -> Self {
        let remembers = !opening.is_measurement();
        let stored = cc.storage.filter(|_| remembers);
        let mut settings: Settings =
            stored.and_then(|s| eframe::get_value(s, SETTINGS)).unwrap_or_default();
        if let Some(side) = &opening.side {
            settings.sides[0] = SideSettings::of(side);
        }
        let frames = opening.is_measurement().then_some(opening.frames.unwrap_or(0));
        cc.egui_ctx.set_zoom_factor(settings.ui_scale);
        let scale = settings.ui_scale;
        let mut viewer = Viewer::new(&cc.egui_ctx, opening, settings);
        viewer.is_cleared = true;
        viewer.blits = cc.wgpu_render_state.as_ref().map_or(0, blit::install);
        Self {
            scale,
            viewer,
            course: frames.map(|frames| Course::new(frames, opening.started)),
            screenshot: opening.screenshot.clone(),
            closing: false,
            remembers,
            left,
            on_failure: opening.on_failure.filter(|_| remembers),
            failed: None,
        }
    }

    /// The size of text is set by the menu and by egui's own shortcuts.
    fn rescale(&mut self, context: &egui::Context) {
        let settings = &mut self.viewer.settings;
        if settings.ui_scale != self.scale {
            context.set_zoom_factor(settings.ui_scale);
        } else {
            settings.ui_scale = context.zoom_factor();
        }
        self.scale = settings.ui_scale;
    }

    fn measure(&mut self, context: &egui::Context) {
        if self.closing {
            // The picture of the window comes with one of the next passes.
            context.request_repaint();
        }
        let Some(course) = &mut self.course else { return };
        let done = course.step(&mut self.viewer);
        // No more passes than pictures: painting the window takes time from what is measured.
        self.viewer.wish(context);
        if let Some((what, true, _)) = &self.viewer.message {
            let error = Error::input("view", "", what.clone(), "see `catoptric view --help`");
            self.leave(Err(error));
            self.course = None;
            context.send_viewport_cmd(ViewportCommand::Close);
            return;
        }
        if !done {
            return;
        }
        let pixels = context.content_rect().size() * context.pixels_per_point();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a window's size"
        )]
        let window = ImageSize { width: pixels.x as u32, height: pixels.y as u32 };
        let outcome = course.outcome(&self.viewer, window);
        self.course = None;
        if let Some(outcome) = outcome {
            self.leave(Ok(outcome));
        }
        self.closing = true;
        match self.screenshot.take() {
            Some(path) => shoot(context, path, Arc::clone(&self.left)),
            None => context.send_viewport_cmd(ViewportCommand::Close),
        }
    }

    fn leave(&self, what: Result<Outcome>) {
        *self.left.lock().unwrap_or_else(PoisonError::into_inner) = Some(what);
    }
}

/// Asks for a picture of the window, writes it, and closes.
fn shoot(context: &egui::Context, path: PathBuf, left: Left) {
    let own = context.clone();
    let callback = ScreenshotCallback::new(move |picture: Arc<ColorImage>| {
        if let Err(error) = write_png(&path, &picture) {
            *left.lock().unwrap_or_else(PoisonError::into_inner) = Some(Err(error));
        }
        own.send_viewport_cmd(ViewportCommand::Close);
        own.request_repaint();
    });
    context.send_viewport_cmd(ViewportCommand::Screenshot(callback));
    context.request_repaint();
}

fn write_png(path: &std::path::Path, picture: &ColorImage) -> Result<()> {
    let rgb: Vec<u8> = picture.pixels.iter().flat_map(|p| [p.r(), p.g(), p.b()]).collect();
    let [width, height] = picture.size.map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
    image::ImageEncoder::write_image(encoder, &rgb, width, height, image::ExtendedColorType::Rgb8)
        .map_err(|e| Error::file(path, "", e.to_string(), "take another screenshot"))?;
    write_bytes(path, &bytes)
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let start = Instant::now();
        let context = ui.ctx().clone();
        context.set_theme(egui::ThemePreference::from(self.viewer.settings.theme));
        self.rescale(&context);
        self.viewer.ui(ui);
        if let (Some(on_failure), Some((what, true, at))) = (self.on_failure, &self.viewer.message)
            && self.failed != Some(*at)
        {
            self.failed = Some(*at);
            on_failure(what);
        }
        if let Some(course) = &mut self.course {
            // Of the pass before: with painting.
            let before = f64::from(frame.info().cpu_usage.unwrap_or(0.0)) * 1e3;
            course.blocked(before.max(start.elapsed().as_secs_f64() * 1e3));
        }
        self.measure(&context);
    }

    /// The panels' colour, so that they need not be filled.
    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        if self.remembers {
            eframe::set_value(storage, SETTINGS, &self.viewer.settings);
        }
    }

    fn persist_egui_memory(&self) -> bool {
        self.remembers
    }
}
