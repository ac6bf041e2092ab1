//! The tables and values of a scene file. Each value is checked where it is parsed, so that an error knows
//! its line.

use std::fmt;

use glam::{DVec3, Vec3};
use serde::de::{self, Deserialize, Deserializer, SeqAccess, Visitor};
use toml::Spanned;

use crate::scene::load::linear_from_srgb;

/// A whole scene file.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneTable {
    pub name: Option<Name>,
    pub eye: Spanned<EyeTable>,
    pub light: Option<LightTable>,
    pub environment: Option<Spanned<EnvironmentTable>>,
    #[serde(default)]
    pub mirror: Vec<Spanned<MirrorTable>>,
    #[serde(default)]
    pub object: Vec<Spanned<ObjectTable>>,
}

/// `[eye]`
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EyeTable {
    pub position: Point,
    pub target: Point,
    pub up: Option<Direction>,
    pub fov_y_deg: Option<FieldOfView>,
}

/// `[light]`
#[derive(Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LightTable {
    pub to_sun: Option<Direction>,
    pub sun: Option<Color>,
    pub ambient: Option<Color>,
}

/// `[environment]`; not a tagged enum, which would lose the lines.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EnvironmentTable {
    pub kind: EnvironmentName,
    pub zenith: Option<Color>,
    pub horizon: Option<Color>,
    pub ground: Option<Color>,
    pub color: Option<Color>,
    pub file: Option<Name>,
    pub rotate_deg: Option<Finite>,
    pub exposure: Option<Finite>,
}

/// Which environment.
#[derive(serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum EnvironmentName {
    Sky,
    Constant,
    Image,
}

/// `[[mirror]]`
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MirrorTable {
    pub name: Option<Name>,
    pub shape: Option<String>,
    pub file: Option<String>,
    pub part: Option<String>,
    pub triangles: Option<Triangles>,
    pub tint: Option<Color>,
    pub proxy: Option<String>,
    pub rotate_deg: Option<RotationTable>,
    pub scale: Option<Positive>,
    pub translate: Option<Point>,
    pub fit: Option<FitTable>,
}

/// `[[object]]`
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ObjectTable {
    pub name: Option<Name>,
    pub shape: Option<String>,
    pub file: Option<String>,
    pub part: Option<String>,
    pub triangles: Option<Triangles>,
    pub density: Option<Positive>,
    pub color: Option<Color>,
    pub pattern: Option<PatternTable>,
    pub rotate_deg: Option<RotationTable>,
    pub scale: Option<Positive>,
    pub translate: Option<Point>,
    pub fit: Option<FitTable>,
}

/// `pattern = { … }`
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PatternTable {
    pub kind: PatternName,
    pub colors: ColorPair,
    pub period: Positive,
}

/// Which pattern.
#[derive(serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum PatternName {
    Checker,
    Stripes,
    Rings,
}

/// `rotate_deg = { … }`
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RotationTable {
    pub axis: Direction,
    pub angle: Finite,
}

/// `fit = { … }`
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FitTable {
    pub diagonal: Positive,
    pub base: Point,
}

/// Lets a value be parsed as another type and checked by a function, whose error gets the line.
macro_rules! parsed {
    ($name:ident from $raw:ty: $check:expr) => {
        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let check: fn($raw) -> Result<Self, String> = $check;
                check(<$raw>::deserialize(deserializer)?).map_err(de::Error::custom)
            }
        }
    };
}

/// An array of the right length: TOML arrays may be longer than what is parsed from them.
fn exactly<T, const N: usize>(list: Vec<T>) -> Result<[T; N], String> {
    list.try_into().map_err(|list: Vec<T>| format!("has {} values instead of {N}", list.len()))
}

/// A name that is not empty.
#[derive(Clone)]
pub(super) struct Name(pub String);
parsed!(Name from String: |s| {
    if s.trim().is_empty() { Err("the name is empty".into()) } else { Ok(Self(s)) }
});

/// Any finite number.
#[derive(Clone, Copy)]
pub(super) struct Finite(pub f64);
parsed!(Finite from f64: |v| {
    if v.is_finite() { Ok(Self(v)) } else { Err(format!("{v} is not a finite number")) }
});

/// A finite number above zero, in f32 as well.
#[derive(Clone, Copy)]
pub(super) struct Positive(pub f64);
parsed!(Positive from f64: |v| {
    if (1e-30..=1e30).contains(&v) { Ok(Self(v)) } else { Err(format!("{v} is not a positive number")) }
});

/// Vertical field of view in degrees.
#[derive(Clone, Copy)]
pub(super) struct FieldOfView(pub f64);
parsed!(FieldOfView from f64: |v| {
    if v > 0.0 && v < 180.0 {
        Ok(Self(v))
    } else {
        Err(format!("a field of view of {v} degrees is not between 0 and 180"))
    }
});

/// A number of triangles.
#[derive(Clone, Copy)]
pub(super) struct Triangles(pub usize);
parsed!(Triangles from i64: |v| match usize::try_from(v) {
    Ok(count @ 1..=50_000_000) => Ok(Self(count)),
    _ => Err(format!("{v} triangles are not between 1 and 50000000")),
});

/// A place or a displacement.
#[derive(Clone, Copy)]
pub(super) struct Point(pub DVec3);
parsed!(Point from Vec<f64>: |v| {
    let v = exactly(v)?;
    let point = DVec3::from_array(v);
    // Beyond this a mesh could not be told from its place.
    if point.abs().cmple(DVec3::splat(1e15)).all() {
        Ok(Self(point))
    } else {
        Err(format!("{v:?} is not finite, or beyond 1e15"))
    }
});

/// A unit vector.
#[derive(Clone, Copy)]
pub(super) struct Direction(pub DVec3);
parsed!(Direction from Vec<f64>: |v| {
    let v = exactly(v)?;
    // Scaled first, so that no square over- or underflows.
    let largest = DVec3::from_array(v).abs().max_element();
    match (DVec3::from_array(v) / largest).try_normalize() {
        Some(direction) => Ok(Self(direction)),
        None => Err(format!("{v:?} has no direction")),
    }
});

/// A linear colour: `[r, g, b]`, or "#rrggbb" in sRGB.
#[derive(Clone, Copy)]
pub(super) struct Color(pub Vec3);

impl<'de> Deserialize<'de> for Color {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ColorVisitor)
    }
}

struct ColorVisitor;

impl<'de> Visitor<'de> for ColorVisitor {
    type Value = Color;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a colour: [r, g, b] in linear light or \"#rrggbb\" in sRGB")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Color, E> {
        let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii());
        let byte = |at: usize| {
            let pair = digits?.get(at..at + 2)?.chars();
            pair.into_iter().try_fold(0, |n, c| Some(16 * n + c.to_digit(16)?))
        };
        match (byte(0), byte(2), byte(4)) {
            (Some(r), Some(g), Some(b)) => {
                let linear = [r, g, b].map(|v| linear_from_srgb(v as f32 / 255.0));
                Ok(Color(Vec3::from_array(linear)))
            }
            _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
        }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<Color, A::Error> {
        let mut color = [0.0; 3];
        for (i, channel) in color.iter_mut().enumerate() {
            *channel = values.next_element()?.ok_or_else(|| de::Error::invalid_length(i, &self))?;
        }
        if values.next_element::<de::IgnoredAny>()?.is_some() {
            return Err(de::Error::invalid_length(4, &self));
        }
        let color = Vec3::from_array(color);
        if color.cmpge(Vec3::ZERO).all() && color.is_finite() {
            Ok(Color(color))
        } else {
            Err(de::Error::custom(format!("the colour {color} is negative or not finite")))
        }
    }
}

/// Two colours.
#[derive(Clone, Copy)]
pub(super) struct ColorPair(pub [Color; 2]);
parsed!(ColorPair from Vec<Color>: |v| exactly(v).map(Self));
