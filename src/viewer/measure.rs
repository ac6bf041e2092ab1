//! Frames of an orbit, drawn in the window one after the other and counted.

use std::f64::consts::TAU;
use std::time::Instant;

use super::app::Viewer;
use super::worker::Prepared;
use crate::camera::eye::ImageSize;
use crate::frame::FrameReport;
use crate::scene::description::EyeDescription;

/// What was measured. Times in milliseconds.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The scene.
    pub prepared: Prepared,
    /// Size of the pictures, pixels.
    pub size: ImageSize,
    /// Size of the window, pixels.
    pub window: ImageSize,
    /// Where the picture's top left lies in the window, pixels.
    pub canvas: [u32; 2],
    /// Medians of the frames' stages.
    pub report: FrameReport,
    /// Frames that were counted: each drawn anew, at full resolution, and shown.
    pub frames_rendered: usize,
    /// From one shown frame to the next, sorted.
    pub frame_ms: Vec<f64>,
    /// The longest that the window could not answer.
    pub ui_blocked_ms_max: f64,
    /// From the program's start to the first picture.
    pub first_picture_ms: f64,
}

impl Outcome {
    /// The value that a share of the frames does not exceed; nearest rank.
    pub fn percentile(&self, percent: usize) -> f64 {
        let rank = (self.frame_ms.len() * percent).div_ceil(100).max(1);
        self.frame_ms.get(rank - 1).copied().unwrap_or(f64::NAN)
    }
}

/// The course of a measurement.
pub(super) struct Course {
    frames: usize,
    started: Instant,
    first_picture_ms: Option<f64>,
    shots: u64,
    home: Option<EyeDescription>,
    last: Option<Instant>,
    frame_ms: Vec<f64>,
    reports: Vec<FrameReport>,
    blocked_ms: f64,
}

impl Course {
    pub(super) fn new(frames: u32, started: Instant) -> Self {
        Self {
            frames: frames as usize,
            started,
            first_picture_ms: None,
            shots: 0,
            home: None,
            last: None,
            frame_ms: Vec::new(),
            reports: Vec::new(),
            blocked_ms: 0.0,
        }
    }

    /// A pass over the window took so long.
    pub(super) fn blocked(&mut self, ms: f64) {
        self.blocked_ms = self.blocked_ms.max(ms);
    }

    /// After a pass: moves the eye if a new picture is shown. Returns whether all frames were drawn.
    pub(super) fn step(&mut self, viewer: &mut Viewer) -> bool {
        let Some(display) = viewer.display.as_ref().filter(|_| viewer.shots != self.shots) else {
            return false;
        };
        self.shots = viewer.shots;
        let now = Instant::now();
        self.first_picture_ms.get_or_insert_with(|| (now - self.started).as_secs_f64() * 1e3);
        if !display.complete || display.view.size != viewer.size {
            return false;
        }
        if self.frames == 0 {
            return display.view.rest;
        }
        let Some(home) = self.home else {
            self.home = Some(viewer.eye);
            viewer.steady = true;
            self.turn(viewer);
            return false;
        };
        // What was drawn before the orbit began does not count.
        if display.view.eye != home
            && let Some(last) = self.last.replace(now)
        {
            self.frame_ms.push((now - last).as_secs_f64() * 1e3);
            self.reports.extend(display.reports.first().cloned());
        }
        self.turn(viewer);
        self.frame_ms.len() >= self.frames
    }

    fn turn(&self, viewer: &mut Viewer) {
        if let Some(home) = self.home {
            let share = (self.frame_ms.len() + 1) as f64 / (self.frames + 1) as f64;
            // The frame before the first counted one has a place of its own.
            let early = if self.last.is_none() { 0.5 / (self.frames + 1) as f64 } else { 0.0 };
            viewer.eye = home.orbited(TAU * (share - early));
        }
    }

    /// What was measured; `None` if no picture was drawn.
    pub(super) fn outcome(&self, viewer: &Viewer, window: ImageSize) -> Option<Outcome> {
        let mut frame_ms = self.frame_ms.clone();
        frame_ms.sort_by(f64::total_cmp);
        let reports = if self.reports.is_empty() {
            viewer.display.as_ref()?.reports.clone()
        } else {
            self.reports.clone()
        };
        Some(Outcome {
            prepared: viewer.prepared.clone()?,
            size: viewer.display.as_ref()?.view.size,
            window,
            canvas: viewer.canvas,
            report: FrameReport::median(&reports),
            frames_rendered: frame_ms.len(),
            frame_ms,
            ui_blocked_ms_max: self.blocked_ms,
            first_picture_ms: self.first_picture_ms?,
        })
    }
}
