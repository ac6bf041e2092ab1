//! The command that renders what is seen.

use std::fmt::Write as _;

use super::app::Viewer;
use crate::scene::description::{Scene, Source};
use crate::scene::load::UpAxis;
use crate::scene::prepared::PrepareOptions;

/// The command line, and what else is to be done for it to draw the same.
pub(super) fn equivalent(viewer: &Viewer) -> (String, Option<&'static str>) {
    let moved = viewer.is_changed();
    let mut line = String::from("catoptric render");
    if moved {
        line += " scene.toml";
    } else {
        let request = &viewer.request;
        for input in &request.inputs {
            word(&mut line, input);
        }
        let lists = [
            ("--mirror", &request.mirrors),
            ("--object", &request.objects),
            ("--proxy", &request.proxies),
        ];
        for (flag, names) in lists {
            for name in names {
                line += " ";
                line += flag;
                word(&mut line, name);
            }
        }
        if let Some(up) = request.read.up {
            let _ = write!(line, " --up {}", if up == UpAxis::Z { "z" } else { "y" });
        }
        if let Some(panorama) = &request.environment {
            line += " --environment";
            word(&mut line, &panorama.to_string_lossy());
        }
        let eye = viewer.eye;
        for (flag, p) in [("--eye", eye.position), ("--target", eye.target)] {
            let [x, y, z] = p.to_array().map(short);
            let _ = write!(line, " {flag} {x},{y},{z}");
        }
        let _ = write!(line, " --fov {}", short(eye.fov_y.to_degrees()));
    }
    // A saved scene names files wherever they are.
    let named = |s: &Option<Source>| matches!(s, Some(Source::File { .. }));
    let sources = |s: &Scene| {
        s.mirrors.iter().any(|m| named(&m.source)) || s.objects.iter().any(|o| named(&o.source))
    };
    if viewer.request.read.outside || (moved && viewer.scene.as_deref().is_some_and(sources)) {
        line += " --allow-outside";
    }
    let _ = write!(line, " --size {}x{}", viewer.size.width, viewer.size.height);
    let standard = PrepareOptions::default();
    let now = viewer.prepare;
    if now.surfels != standard.surfels {
        let _ = write!(line, " --surfels {}", now.surfels);
    }
    if now.tree.leaf_points != standard.tree.leaf_points {
        let _ = write!(line, " --leaf {}", now.tree.leaf_points);
    }
    if now.tree.leaf_size != standard.tree.leaf_size {
        let _ = write!(line, " --leaf-size {}", now.tree.leaf_size);
    }
    if now.seed != standard.seed {
        let _ = write!(line, " --seed {}", now.seed);
    }
    let side = viewer.settings.sides[0].side();
    let _ = write!(line, " --method {} --backend {}", side.method, side.backend.word());
    for info in viewer.settings.sides[0].method().info().params {
        if let Some(value) = side.params.get(info.id).filter(|v| *v != info.default) {
            let _ = write!(line, " --{} {value}", info.id);
        }
    }
    line += " -o picture.png";
    (line, moved.then_some("save the scene as scene.toml first"))
}

/// Without the last digits, which rounding left: what nobody sees in a picture.
fn short(value: f64) -> f64 {
    let rounded = (value * 1e9).round() * 1e-9;
    // Once more as text: the product has such digits itself.
    format!("{rounded:.9}").parse().unwrap_or(value)
}

/// Appends a word as a shell takes it.
fn word(line: &mut String, text: &str) {
    let plain = |c: char| c.is_alphanumeric() || "-_./:=+,".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        let _ = write!(line, " {text}");
    } else {
        let _ = write!(line, " '{}'", text.replace('\'', r"'\''"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let shown = |v: f64| short(v).to_string();
        assert_eq!(shown(-0.600_000_000_000_000_1), "-0.6");
        assert_eq!(shown(45.0_f64.to_radians().to_degrees()), "45");
        assert_eq!(shown(123.456_789_012_345), "123.456789012");
        assert_eq!(shown(1e22), "10000000000000000000000");
    }

    #[test]
    fn words_reach_the_program_as_they_are() {
        let mut line = String::new();
        for text in ["a/b-1.toml", "my file.ply", "it's", ""] {
            word(&mut line, text);
        }
        assert_eq!(line, r" a/b-1.toml 'my file.ply' 'it'\''s' ''");
    }
}
