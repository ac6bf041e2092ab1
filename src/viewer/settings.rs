//! What is remembered between sessions, and the two sides of the view.

use std::collections::BTreeMap;

use eframe::egui;
use serde::{Deserialize, Serialize};

use super::worker::{BackendChoice, Side};
use crate::methods::{METHODS, Method, Params, method};

/// How dark the window is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub(super) enum Theme {
    #[default]
    System,
    Dark,
    Light,
}

impl From<Theme> for egui::ThemePreference {
    fn from(theme: Theme) -> Self {
        match theme {
            Theme::System => Self::System,
            Theme::Dark => Self::Dark,
            Theme::Light => Self::Light,
        }
    }
}

/// What two sides are shown as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub(super) enum Shown {
    #[default]
    Divider,
    Difference,
    Flip,
}

/// What the mirrors show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub(super) enum MirrorColors {
    #[default]
    Reflection,
    /// What each triangle costs.
    Cost,
    /// How each triangle's rays run.
    Class,
}

/// See the module.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(default)]
pub(super) struct Settings {
    pub(super) sides: [SideSettings; 2],
    pub(super) compare: bool,
    pub(super) shown: Shown,
    /// Where the divider is, as a share of the view's width.
    pub(super) divider: f32,
    /// Fewer pixels and a draft while something moves, where that is needed to keep up.
    pub(super) adapt: bool,
    pub(super) panel: bool,
    pub(super) inspect: bool,
    pub(super) mirror: MirrorColors,
    /// The surface on which the mirrors focus what the eye sees.
    pub(super) caustic: bool,
    /// All paths of the point that was clicked.
    pub(super) paths: bool,
    pub(super) theme: Theme,
    pub(super) ui_scale: f32,
}

impl Default for Settings {
    fn default() -> Self {
        let reference = SideSettings { method: "raytrace".into(), ..SideSettings::default() };
        Self {
            sides: [SideSettings::default(), reference],
            compare: false,
            shown: Shown::default(),
            divider: 0.5,
            adapt: true,
            panel: true,
            inspect: false,
            mirror: MirrorColors::default(),
            caustic: false,
            paths: false,
            theme: Theme::default(),
            ui_scale: 1.0,
        }
    }
}

/// A [`Side`] as text, which outlives a version of the program. What is not known any more is the default.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(default)]
pub(super) struct SideSettings {
    pub(super) method: String,
    pub(super) backend: BackendChoice,
    /// Values that were chosen, by parameter id, for whatever method has it.
    pub(super) params: BTreeMap<String, String>,
}

impl Default for SideSettings {
    fn default() -> Self {
        let method = METHODS[0].info().id.to_owned();
        Self { method, backend: BackendChoice::Auto, params: BTreeMap::new() }
    }
}

impl SideSettings {
    /// As the command line gave it.
    pub(super) fn of(side: &Side) -> Self {
        let mut own =
            Self { method: side.method.to_owned(), backend: side.backend, ..Self::default() };
        for info in own.method().info().params {
            if side.params.get(info.id) != Some(info.default)
                && let Some(value) = side.params.get(info.id)
            {
                own.params.insert(info.id.to_owned(), value.to_string());
            }
        }
        own
    }

    pub(super) fn method(&self) -> &'static dyn Method {
        method(&self.method).unwrap_or(METHODS[0])
    }

    pub(super) fn side(&self) -> Side {
        let info = self.method().info();
        let mut params = Params::defaults(info.params);
        for param in info.params {
            if let Some(text) = self.params.get(param.id) {
                // From another version: the default it is.
                let _ = params.set(param, text);
            }
        }
        Side { method: info.id, backend: self.backend, params }
    }

    /// Sets a quality's values; those of the default take the others back.
    pub(super) fn set_quality(&mut self, quality: &str) {
        let info = self.method().info();
        for param in info.params.iter().filter(|p| p.is_quality_knob) {
            self.params.remove(param.id);
        }
        for preset in info.qualities.iter().chain(info.presets).filter(|q| q.id == quality) {
            for (id, value) in preset.params {
                self.params.insert((*id).to_owned(), (*value).to_owned());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_survive_as_text() {
        let mut settings = SideSettings::default();
        settings.set_quality("best");
        let side = settings.side();
        assert_eq!(side.params.integer("detail"), 4);
        let back = SideSettings::of(&side);
        assert_eq!(back.side(), side);
        let text = serde_json::to_string(&back).expect("it is text");
        let read: SideSettings = serde_json::from_str(&text).expect("it was written");
        assert_eq!(read.side(), side);
        settings.set_quality("default");
        assert_eq!(settings.side(), SideSettings::default().side());
    }

    #[test]
    fn what_another_version_wrote_is_no_obstacle() {
        let text = r#"{"method": "gone", "params": {"detail": "many", "old": "1"}, "new": 3}"#;
        let read: SideSettings = serde_json::from_str(text).expect("unknown keys are skipped");
        assert_eq!(read.side(), SideSettings::default().side());
    }
}
