//! Materials of OBJ files (MTL) through `tobj`.
//!
//! `tobj` is handed only the lines that count, checked: it panics where a colour has fewer than three numbers, and a number
//! that it cannot read ends everything.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::nearby::Nearby;
use super::textures::{Key, Textures};
use crate::context::Context;
use crate::error::Result;
use crate::scene::file::LIGHT_GREY;
use crate::scene::materials::{Material, Wrap};

/// `illum` of "reflection on, ray trace on".
const RAY_TRACED: u8 = 3;
/// What reflects at least so much and scatters at most the rest is a mirror, too.
const HIGH_SPECULAR: f32 = 0.9;

/// A material as an OBJ file names it.
pub(super) struct Named {
    pub name: String,
    pub material: Material,
    /// Texture coordinates become `scale · uv + offset`.
    pub scale: Vec2,
    pub offset: Vec2,
    /// Linear RGB of what it reflects, if it is a mirror.
    pub mirror: Option<Vec3>,
}

/// Reads a material file. Colours are taken as sRGB, as modellers show them.
pub(super) fn read(
    path: &Path,
    bytes: &[u8],
    outside: bool,
    textures: &mut Textures,
    cx: &Context,
) -> Result<Vec<Named>> {
    let text = tidied(&String::from_utf8_lossy(bytes));
    let Ok((list, _)) = tobj::load_mtl_buf(&mut text.as_bytes()) else {
        textures.notes.push(format!("{}: is no material file: shown without", path.display()));
        return Ok(Vec::new());
    };
    let nearby = Nearby::of(path, outside);
    let mut all = Vec::with_capacity(list.len());
    for found in list {
        let color = |given: Option<[f32; 3]>| given.map(|c| Vec3::from_array(c).map(linear));
        let (diffuse, specular) = (color(found.diffuse), color(found.specular));
        let shines = specular.is_some_and(|s| s.min_element() >= HIGH_SPECULAR)
            && diffuse.is_some_and(|d| d.max_element() <= 1.0 - HIGH_SPECULAR);
        let mirror = (shines || found.illumination_model == Some(RAY_TRACED))
            .then(|| specular.filter(|s| *s != Vec3::ZERO).unwrap_or(Vec3::ONE));
        let map = found.diffuse_texture.as_deref().map(Map::of);
        let mut texture = None;
        if let Some(map) = map.as_ref().filter(|_| mirror.is_none()) {
            match nearby.find_loosely(&map.file) {
                Ok(file) => {
                    let key = Key::File(file.clone(), [map.wrap; 2]);
                    texture = textures.get(key, &file, || super::bytes(&file), cx)?;
                }
                Err(why) => {
                    let error = why.error(&path.display().to_string(), "", &map.file);
                    textures.notes.push(format!("{error}: shown without this texture"));
                }
            }
        }
        // Many exporters write black beside a texture, and mean the texture.
        let plain = diffuse.unwrap_or(LIGHT_GREY);
        let factor = if texture.is_some() { diffuse.filter(|d| *d != Vec3::ZERO) } else { None };
        let color = if texture.is_some() { factor.unwrap_or(Vec3::ONE) } else { plain };
        let (scale, offset) = map.map_or((Vec2::ONE, Vec2::ZERO), |m| (m.scale, m.offset));
        let material = Material { color, texture };
        all.push(Named { name: found.name, material, scale, offset, mirror });
    }
    Ok(all)
}

fn linear(value: f32) -> f32 {
    crate::image::color::srgb_to_linear(value.clamp(0.0, 1.0))
}

/// The lines that say a name, a colour, the kind of shading or a texture, in a form that `tobj` cannot mistake.
fn tidied(text: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let (key, rest) = line.trim().split_once(char::is_whitespace).unwrap_or((line.trim(), ""));
        let rest = rest.trim();
        let line = match key {
            "newmtl" if !rest.is_empty() => format!("newmtl {rest}\n"),
            "Kd" | "Ks" => {
                let numbers: Vec<f32> =
                    rest.split_whitespace().take(3).filter_map(|w| w.parse().ok()).collect();
                match numbers[..] {
                    _ if !numbers.iter().all(|n| n.is_finite()) => continue,
                    // One number is a grey.
                    [grey] => format!("{key} {grey} {grey} {grey}\n"),
                    [r, g, b] => format!("{key} {r} {g} {b}\n"),
                    _ => continue,
                }
            }
            "illum" if rest.parse::<u8>().is_ok() => format!("illum {rest}\n"),
            "map_Kd" if !rest.is_empty() => format!("map_Kd {rest}\n"),
            _ => continue,
        };
        // What comes before the first name belongs to nothing.
        if !out.is_empty() || key == "newmtl" {
            out.push_str(&line);
        }
    }
    out
}

/// What follows `map_Kd`.
#[derive(Debug, PartialEq)]
struct Map {
    file: String,
    scale: Vec2,
    offset: Vec2,
    wrap: Wrap,
}

impl Map {
    /// Options with their numbers come first; the file's name is the rest and may have spaces.
    fn of(text: &str) -> Self {
        let (mut scale, mut offset, mut wrap) = (Vec2::ONE, Vec2::ZERO, Wrap::Repeat);
        let mut rest = text.trim();
        while let Some((option, after)) =
            rest.split_once(char::is_whitespace).filter(|(word, _)| word.starts_with('-'))
        {
            // How many words belong to it, at most and at least.
            let (most, least) = match option {
                "-s" | "-o" | "-t" => (3, 1),
                "-mm" => (2, 2),
                _ => (1, 1),
            };
            rest = after.trim_start();
            let mut numbers = Vec::new();
            for i in 0..most {
                let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
                let number = word.parse::<f32>();
                if i >= least && number.is_err() {
                    break;
                }
                if option == "-clamp" && word == "on" {
                    wrap = Wrap::Clamp;
                }
                numbers.push(number.ok().filter(|n| n.is_finite()).unwrap_or(0.0));
                rest = after.trim_start();
            }
            let pair = |or: f32| Vec2::new(numbers[0], numbers.get(1).copied().unwrap_or(or));
            match option {
                "-s" => scale = pair(1.0),
                "-o" => offset = pair(0.0),
                _ => {}
            }
        }
        Self { file: rest.to_owned(), scale, offset, wrap }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_come_before_the_name() {
        let map = Map::of("-s 2 3 1 -o 0.5 -clamp on -bm 0.3 my wood.png");
        let expected = Map {
            file: "my wood.png".into(),
            scale: Vec2::new(2.0, 3.0),
            offset: Vec2::new(0.5, 0.0),
            wrap: Wrap::Clamp,
        };
        assert_eq!(map, expected);
        assert_eq!(Map::of("a.png").file, "a.png");
        assert_eq!(Map::of("-s").file, "-s");
        assert_eq!(Map::of("-clamp on").file, "");
    }

    #[test]
    fn only_what_counts_and_can_be_read_is_kept() {
        let text = "Kd 1 1 1\nnewmtl a b\n Kd 0.5\nKs 1 x 3\nKs 0.1 0.2 0.3 0.4\nNs 10\nKe spectral a\nillum 3\nillum 999\nmap_Kd -s 1 1 1 b.png\nmap_Kd\nKd nan 1 1\nKd 1 2\n";
        let expected =
            "newmtl a b\nKd 0.5 0.5 0.5\nKs 0.1 0.2 0.3\nillum 3\nmap_Kd -s 1 1 1 b.png\n";
        assert_eq!(tidied(text), expected);
    }
}
