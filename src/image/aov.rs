//! The planes of a picture as one multi-layer EXR.
//!
//! One part with float channels `R`, `G`, `B` (the reflection), `P.X/Y/Z`, `N.X/Y/Z`, `lambda`, `splat.X/Y`,
//! `coverage` and UINT channels `mirror`, `mirror_triangle`, `object`, `surfel`, `images`, `steps` (0xFFFFFFFF = none),
//! `reason`. The dots make layers, as EXR tools understand them. The string vector [`NAMES`] holds the objects' names by index.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use exr::meta::MetaData;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Compression, Encoding, FlatSamples, Image, Layer,
    LayerAttributes, ReadChannels, ReadLayers, Text, WritableImage, read,
};

use super::io::{check_place, extension, not_finite, output_error, read_bytes};
use super::{Planes, io};
use crate::error::{Error, Result};

/// Attribute with the objects' names.
pub const NAMES: &str = "catoptric_objects";

const RADIANCE: [&str; 3] = ["R", "G", "B"];
const POSITION: [&str; 3] = ["P.X", "P.Y", "P.Z"];
const NORMAL: [&str; 3] = ["N.X", "N.Y", "N.Z"];
const SPLAT: [&str; 2] = ["splat.X", "splat.Y"];
const LAMBDA: &str = "lambda";
const COVERAGE: &str = "coverage";
const MIRROR: &str = "mirror";
const MIRROR_TRIANGLE: &str = "mirror_triangle";
const OBJECT: &str = "object";
const SURFEL: &str = "surfel";
const IMAGES: &str = "images";
const STEPS: &str = "steps";
const REASON: &str = "reason";

/// Lossless, and the same bytes for any thread count. Run lengths take a sixth of the time of deflate here, and
/// the sparse planes of a mirror are hardly longer (measured: 15.9 against 13.6 MB at 1280x720).
const ENCODING: Encoding = Encoding { compression: Compression::RLE, ..Encoding::SMALL_LOSSLESS };

/// Largest picture that is read: 8192x4096.
const MAX_PIXELS: usize = 1 << 25;
/// No stream of deflate or run lengths is longer than this times its compressed form: a larger claim is a lie.
const MAX_COMPRESSION: u64 = 1032;

/// Whether planes can be written to `path`: to be asked before any long work.
///
/// # Errors
/// The extension is not .exr; else as [`check_place`].
pub fn check_output(path: &Path) -> Result<()> {
    if extension(path) != "exr" {
        return Err(Error::file(
            path,
            "",
            "planes are written as EXR only",
            "name a file that ends in .exr",
        ));
    }
    check_place(path)
}

/// Writes all planes without loss; see the module for the channels. The bytes depend on the input only.
///
/// # Errors
/// [`Error::Output`].
///
/// # Panics
/// If a plane holds another number of elements than `width`·`height`.
pub fn write_aov(path: &Path, planes: &Planes, object_names: &[String]) -> Result<()> {
    let mut channels = Channels { pixels: planes.radiance.len(), list: Vec::new() };
    assert_eq!(channels.pixels, planes.width as usize * planes.height as usize);
    channels.floats(RADIANCE, &planes.radiance);
    channels.floats(POSITION, &planes.position);
    channels.floats(NORMAL, &planes.normal);
    channels.floats(SPLAT, &planes.splat);
    channels.add(LAMBDA, FlatSamples::F32(planes.lambda.clone()));
    channels.add(COVERAGE, FlatSamples::F32(planes.coverage.clone()));
    for (name, plane) in [
        (MIRROR, &planes.mirror),
        (MIRROR_TRIANGLE, &planes.mirror_triangle),
        (OBJECT, &planes.object),
        (SURFEL, &planes.surfel),
        (IMAGES, &planes.images),
        (STEPS, &planes.steps),
        (REASON, &planes.reason),
    ] {
        channels.add(name, FlatSamples::U32(plane.clone()));
    }
    let mut attributes = LayerAttributes::default();
    if !object_names.is_empty() {
        let names = object_names.iter().map(|name| Text::from_slice_unchecked(name.as_bytes()));
        attributes.other.insert(NAMES.into(), AttributeValue::TextVector(names.collect()));
    }
    let size = (planes.width as usize, planes.height as usize);
    let channels = AnyChannels::sort(channels.list.into());
    let image = Image::from_layer(Layer::new(size, attributes, ENCODING, channels));
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).map_err(|error| output_error(path, error))?;
    io::write_bytes(path, &bytes.into_inner())
}

/// Whether `path` is an EXR with planes. `false` also if it cannot be read.
pub fn is_aov(path: &Path) -> bool {
    MetaData::read_from_file(path, false).is_ok_and(|meta| {
        let has =
            |name| meta.headers[0].channels.find_index_of_channel(&Text::from(name)).is_some();
        meta.headers.len() == 1 && [OBJECT, MIRROR, REASON].into_iter().all(has)
    })
}

/// Reads what [`write_aov`] wrote, bit by bit: the planes and the names of the objects.
///
/// # Errors
/// Missing, empty, truncated, not such a file, larger than 2^25 pixels, or a float that is not finite.
pub fn read_aov(path: &Path) -> Result<(Planes, Vec<String>)> {
    let bytes = read_bytes(path)?;
    check_claims(path, &bytes)?;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| damaged(path, &error))?;
    let layer = image.layer_data;
    let names = match layer.attributes.other.get(&Text::from(NAMES)) {
        Some(AttributeValue::TextVector(names)) => {
            names.iter().map(|name| String::from_utf8_lossy(name.as_slice()).into_owned()).collect()
        }
        _ => Vec::new(),
    };
    let too_wide = |_| Error::file(path, "", "too many pixels", "render it smaller");
    let width = u32::try_from(layer.size.width()).map_err(too_wide)?;
    let height = u32::try_from(layer.size.height()).map_err(too_wide)?;
    let list = layer.channel_data.list.into_iter();
    let mut planes = Stored {
        path,
        width,
        pixels: layer.size.area(),
        channels: list.map(|channel| (channel.name.to_string(), channel.sample_data)).collect(),
    };
    let planes = Planes {
        width,
        height,
        radiance: planes.vectors(RADIANCE)?,
        position: planes.vectors(POSITION)?,
        normal: planes.vectors(NORMAL)?,
        lambda: planes.floats(LAMBDA)?,
        splat: planes.vectors(SPLAT)?,
        coverage: planes.floats(COVERAGE)?,
        mirror: planes.integers(MIRROR)?,
        mirror_triangle: planes.integers(MIRROR_TRIANGLE)?,
        object: planes.integers(OBJECT)?,
        surfel: planes.integers(SURFEL)?,
        images: planes.integers(IMAGES)?,
        steps: planes.integers(STEPS)?,
        reason: planes.integers(REASON)?,
    };
    Ok((planes, names))
}

/// Refuses sizes before anything is allocated for them.
fn check_claims(path: &Path, bytes: &[u8]) -> Result<()> {
    let meta = MetaData::read_from_buffered(bytes, false).map_err(|error| damaged(path, &error))?;
    for header in &meta.headers {
        let pixels = header.layer_size.area();
        if pixels > MAX_PIXELS {
            let problem = format!("{}x{} pixels", header.layer_size.0, header.layer_size.1);
            return Err(Error::file(path, "", problem, "render it with at most 8192x4096 pixels"));
        }
        let claimed = pixels as u64 * header.channels.bytes_per_pixel as u64;
        if claimed > MAX_COMPRESSION * bytes.len() as u64 {
            return Err(damaged(path, &"it claims more pixels than it can hold"));
        }
    }
    Ok(())
}

fn damaged(path: &Path, problem: &impl std::fmt::Display) -> Error {
    Error::file(
        path,
        "",
        format!("no complete EXR file: {problem}"),
        "give a file written with --aov",
    )
}

/// Channels to be written.
struct Channels {
    pixels: usize,
    list: Vec<AnyChannel<FlatSamples>>,
}

impl Channels {
    fn add(&mut self, name: &str, samples: FlatSamples) {
        assert_eq!(samples.len(), self.pixels, "plane {name}");
        self.list.push(AnyChannel::new(name, samples));
    }

    fn floats<const N: usize>(&mut self, names: [&str; N], plane: &[[f32; N]]) {
        for (k, name) in names.into_iter().enumerate() {
            self.add(name, FlatSamples::F32(plane.iter().map(|v| v[k]).collect()));
        }
    }
}

/// Channels of a file.
struct Stored<'a> {
    path: &'a Path,
    width: u32,
    pixels: usize,
    channels: BTreeMap<String, FlatSamples>,
}

impl Stored<'_> {
    fn integers(&mut self, name: &str) -> Result<Vec<u32>> {
        match self.channels.remove(name) {
            Some(FlatSamples::U32(values)) if values.len() == self.pixels => Ok(values),
            other => Err(self.unfit(name, other.is_some(), "UINT")),
        }
    }

    fn floats(&mut self, name: &str) -> Result<Vec<f32>> {
        match self.channels.remove(name) {
            Some(FlatSamples::F32(values)) if values.len() == self.pixels => {
                match values.iter().position(|v| !v.is_finite()) {
                    Some(i) => Err(not_finite(self.path, name, i, self.width)),
                    None => Ok(values),
                }
            }
            other => Err(self.unfit(name, other.is_some(), "FLOAT")),
        }
    }

    fn vectors<const N: usize>(&mut self, names: [&str; N]) -> Result<Vec<[f32; N]>> {
        let mut vectors = Vec::new();
        for (k, name) in names.into_iter().enumerate() {
            let values = self.floats(name)?;
            vectors.resize(values.len(), [0.0; N]);
            std::iter::zip(&mut vectors, values).for_each(|(vector, v)| vector[k] = v);
        }
        Ok(vectors)
    }

    fn unfit(&self, name: &str, exists: bool, kind: &str) -> Error {
        let problem = if exists { format!("not {kind} at every pixel") } else { "missing".into() };
        Error::file(self.path, format!("channel {name}"), problem, "give a file written with --aov")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::io::read_picture;
    use crate::image::{NONE, Picture};

    /// Planes whose every element differs, with the awkward bit patterns among them.
    fn planes(width: u32, height: u32) -> Planes {
        let mut planes = Planes::empty(width, height);
        let mut seed = 1_u32;
        let mut next = || {
            seed = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            seed
        };
        let mut float = || f32::from_bits(next() & 0xbfff_ffff); // finite, with denormals
        planes.radiance.iter_mut().flatten().for_each(|v| *v = float());
        planes.position.iter_mut().flatten().for_each(|v| *v = float());
        planes.normal.iter_mut().flatten().for_each(|v| *v = float());
        planes.splat.iter_mut().flatten().for_each(|v| *v = float());
        planes.lambda.iter_mut().for_each(|v| *v = float());
        planes.coverage.iter_mut().for_each(|v| *v = float());
        planes.lambda[0] = -0.0;
        planes.lambda[1] = f32::MAX;
        planes.lambda[2] = f32::from_bits(1);
        for plane in [
            &mut planes.mirror,
            &mut planes.mirror_triangle,
            &mut planes.object,
            &mut planes.surfel,
            &mut planes.images,
            &mut planes.steps,
            &mut planes.reason,
        ] {
            plane.iter_mut().for_each(|v| *v = next());
            plane[..3].copy_from_slice(&[NONE, NONE - 1, 0]);
        }
        planes
    }

    fn bits(planes: &Planes) -> Vec<u32> {
        let Planes { radiance, position, normal, splat, lambda, coverage, .. } = planes;
        let floats = radiance.iter().chain(position).chain(normal).flatten();
        floats
            .chain(splat.iter().flatten())
            .chain(lambda)
            .chain(coverage)
            .map(|v| v.to_bits())
            .collect()
    }

    #[test]
    fn every_bit_survives_and_the_bytes_are_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let names = ["bunny", "", "Teekännchen 茶", "two\nlines"].map(String::from);
        let planes = planes(37, 41); // no multiple of a block of 16 rows
        write_aov(&path, &planes, &names).unwrap();
        assert!(is_aov(&path));
        let (read, read_names) = read_aov(&path).unwrap();
        assert_eq!((&read, &read_names[..]), (&planes, &names[..]));
        assert_eq!(bits(&read), bits(&planes)); // -0 equals 0
        let first = std::fs::read(&path).unwrap();
        write_aov(&path, &planes, &names).unwrap();
        assert!(std::fs::read(&path).unwrap() == first);
        // Other programs see the reflection.
        assert_eq!(read_picture(&path).unwrap(), Picture::from(&planes));
        // Must fail: one bit of one plane.
        let mut other = planes.clone();
        other.surfel[1500] ^= 1;
        write_aov(&path, &other, &[]).unwrap();
        let (read, no_names) = read_aov(&path).unwrap();
        assert!(read != planes && read == other && no_names.is_empty());
    }

    #[test]
    fn broken_files_are_refused_with_their_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let refused = |expected: &str| {
            let error = read_aov(&path).unwrap_err().to_string();
            assert!(error.contains("a.exr") && error.contains(expected), "{error}");
        };
        refused("does not exist");
        std::fs::write(&path, "").unwrap();
        refused("the file is empty");
        std::fs::write(&path, "solid teapot").unwrap();
        refused("no complete EXR file");
        assert!(!is_aov(&path));
        io::write_picture(&path, &Picture::black(3, 2)).unwrap();
        refused("channel P.X: missing");
        assert!(!is_aov(&path));

        let mut planes = planes(20, 40);
        write_aov(&path, &planes, &[]).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for length in [whole.len() - 1, whole.len() / 2, 600, 9] {
            std::fs::write(&path, &whole[..length]).unwrap();
            refused("no complete EXR file");
        }
        // The data window claims 200,000 rows, then 2^24.
        let name = b"dataWindow\0box2i\0";
        let at = whole.windows(name.len()).position(|bytes| bytes == name).unwrap();
        let last_row = at + name.len() + 4 + 12;
        for (rows, expected) in
            [(200_000_u32, "claims more pixels than it can hold"), (1 << 24, "20x16777217 pixels")]
        {
            let mut bytes = whole.clone();
            bytes[last_row..last_row + 4].copy_from_slice(&rows.to_le_bytes());
            std::fs::write(&path, bytes).unwrap();
            refused(expected);
        }
        planes.position[45][1] = f32::NAN;
        write_aov(&path, &planes, &[]).unwrap();
        refused("channel P.Y, pixel (5, 2): the value is not a finite number");
    }

    #[test]
    fn outputs_are_checked_beforehand() {
        let folder = tempfile::tempdir().unwrap();
        assert!(check_output(&folder.path().join("a.EXR")).is_ok());
        let error = check_output(&folder.path().join("a.png")).unwrap_err().to_string();
        assert!(error.contains(".exr"), "{error}");
        assert!(check_output(&folder.path().join("missing/a.exr")).is_err());
    }
}
