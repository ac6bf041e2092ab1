//! Picture files: PNG, OpenEXR and Radiance HDR; JPEG in only.
//!
//! Files are encoded in memory and come to their place whole or not at all.

use std::io::{Cursor, Write};
use std::path::Path;

use ::image::codecs::hdr::HdrEncoder;
use ::image::codecs::png::{CompressionType, FilterType, PngEncoder};
use ::image::error::ImageError;
use ::image::{DynamicImage, ExtendedColorType, ImageEncoder, ImageReader, Limits, Rgb};
use exr::prelude::{
    Encoding, Image, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage,
};

use super::Picture;
use super::color::{linear_to_srgb8, srgb_to_linear, srgb8_to_linear};
use crate::error::{Error, Result};

#[derive(Clone, Copy)]
enum Format {
    Png,
    Exr,
    Hdr,
}

impl Format {
    fn of(path: &Path) -> Result<Self> {
        match extension(path).as_str() {
            "png" => Ok(Self::Png),
            "exr" => Ok(Self::Exr),
            "hdr" => Ok(Self::Hdr),
            _ => Err(Error::file(
                path,
                "",
                "not a picture format that can be written",
                "name a file that ends in .png, .exr or .hdr",
            )),
        }
    }
}

/// In lower case; empty if there is none.
pub(super) fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// Whether a picture can be written to `path`: to be asked before any long work.
///
/// # Errors
/// The extension is none of .png, .exr, .hdr; else as [`check_place`].
pub fn check_output(path: &Path) -> Result<()> {
    Format::of(path)?;
    check_place(path)
}

/// Whether a file of any kind can be written to `path`. Leaves no trace.
///
/// # Errors
/// `path` is a folder, or its folder does not exist or cannot be written.
pub fn check_place(path: &Path) -> Result<()> {
    if path.is_dir() || path.file_name().is_none() {
        return Err(output_error(path, "it names a folder"));
    }
    if replaceable(path) {
        write_aside(path).map_err(|error| output_error(path, plain(&error)))?;
    }
    Ok(())
}

/// Writes a file whole or not at all: beside its place first, then renamed. What is no plain file (a pipe, a
/// device, a link) is written through instead of being replaced.
///
/// # Errors
/// [`Error::Output`] with what the system said.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    let write = || {
        if !replaceable(path) {
            return std::fs::write(path, bytes);
        }
        let mut file = write_aside(path)?;
        file.write_all(bytes)?;
        file.persist(path)?;
        Ok(())
    };
    write().map_err(|error| output_error(path, plain(&error)))
}

/// Writes a picture in the format of its extension: .png (8-bit sRGB, clamped), .exr (linear, 32-bit float,
/// exact) or .hdr (linear, 8 bits a channel with a common exponent, negative values as 0).
/// The bytes depend on the picture only.
///
/// # Errors
/// Unknown extension, or [`Error::Output`].
///
/// # Panics
/// If the picture holds another number of pixels than it says.
pub fn write_picture(path: &Path, picture: &Picture) -> Result<()> {
    let &Picture { width, height, ref rgb } = picture;
    assert_eq!(rgb.len(), width as usize * height as usize, "pixels of a {width}x{height} picture");
    let bytes = match Format::of(path)? {
        Format::Png => encode_png(picture).map_err(|error| output_error(path, error))?,
        Format::Exr => encode_exr(picture).map_err(|error| output_error(path, error))?,
        Format::Hdr => encode_hdr(picture).map_err(|error| output_error(path, error))?,
    };
    write_bytes(path, &bytes)
}

/// A picture as the bytes of a PNG file.
///
/// # Errors
/// It could not be encoded.
pub fn png(picture: &Picture) -> Result<Vec<u8>> {
    encode_png(picture).map_err(|error| output_error(Path::new("a picture"), error))
}

/// Reads a picture: PNG and JPEG (sRGB, decoded to linear; alpha and colour profiles are ignored), EXR (channels R, G, B
/// of its first layer that has them) or HDR. The format is told by the content.
///
/// # Errors
/// Missing, empty, truncated, of another format, more than 512 MiB decoded, or a value that is not finite.
pub fn read_picture(path: &Path) -> Result<Picture> {
    let bytes = read_bytes(path)?;
    if is_cut_jpeg(&bytes) {
        let problem = "damaged or truncated: the picture ends in the middle";
        return Err(Error::file(path, "", problem, "write it again, or give another picture"));
    }
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| picture_error(path, &error.into()))?;
    reader.limits(Limits::default());
    let decoded = reader.decode().map_err(|error| picture_error(path, &error))?;
    let (width, height) = (decoded.width(), decoded.height());
    let rgb: Vec<[f32; 3]> = match decoded {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            decoded.into_rgb32f().pixels().map(|pixel| pixel.0).collect()
        }
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let linear = |code: u16| srgb_to_linear(f32::from(code) / f32::from(u16::MAX));
            decoded.into_rgb16().pixels().map(|pixel| pixel.0.map(linear)).collect()
        }
        _ => decoded.into_rgb8().pixels().map(|pixel| pixel.0.map(srgb8_to_linear)).collect(),
    };
    if let Some(i) = rgb.iter().position(|color| !color.iter().all(|v| v.is_finite())) {
        return Err(not_finite(path, "", i, width));
    }
    Ok(Picture { width, height, rgb })
}

/// The decoder fills up with grey what is missing. In a scan every byte 0xff is marked as data: what looks like a picture's end
/// is one.
fn is_cut_jpeg(bytes: &[u8]) -> bool {
    let last = |mark: [u8; 2]| bytes.windows(2).rposition(|pair| pair == mark);
    bytes.starts_with(&[0xff, 0xd8]) && last([0xff, 0xda]) > last([0xff, 0xd9])
}

/// The whole file.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    let bytes = std::fs::read(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => {
            Error::file(path, "", "does not exist", "check the name and the folder")
        }
        kind => Error::file(
            path,
            "",
            format!("cannot be read: {kind}"),
            "check the name and its rights",
        ),
    })?;
    if bytes.is_empty() {
        return Err(Error::file(path, "", "the file is empty", "write it again"));
    }
    Ok(bytes)
}

/// That pixel `i` holds a NaN or an infinity; `channel` may be empty.
pub(super) fn not_finite(path: &Path, channel: &str, i: usize, width: u32) -> Error {
    let (x, y) = (i % width as usize, i / width as usize);
    let channel = if channel.is_empty() { String::new() } else { format!("channel {channel}, ") };
    Error::file(
        path,
        format!("{channel}pixel ({x}, {y})"),
        "the value is not a finite number",
        "render the picture again or mend it in an editor",
    )
}

pub(super) fn output_error(path: &Path, problem: impl ToString) -> Error {
    Error::Output { name: path.display().to_string(), problem: problem.to_string() }
}

/// What the system said, without the name of the file aside.
pub(super) fn plain(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "its folder does not exist".into(),
        kind => kind.to_string(),
    }
}

pub(super) fn picture_error(path: &Path, error: &ImageError) -> Error {
    let (problem, remedy) = match error {
        ImageError::Limits(_) => ("more than 512 MiB decoded".into(), "give a smaller picture"),
        ImageError::Unsupported(_) => (
            "not a picture in a format that can be read".into(),
            "give a PNG, EXR, HDR or JPEG file",
        ),
        error => {
            let said = error.to_string().trim().replace('\n', " ");
            (format!("damaged or truncated: {said}"), "write it again, or give another picture")
        }
    };
    Error::file(path, "", problem, remedy)
}

/// Whether `path` is free or a plain file, so that a rename onto it does what was meant.
pub(super) fn replaceable(path: &Path) -> bool {
    path.symlink_metadata().map_or(true, |there| there.is_file())
}

/// An empty file in the folder of `path` that vanishes unless it is persisted.
pub(super) fn write_aside(path: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".catoptric-");
    // As for any new file: the user's mask decides, not the privacy of temporary files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

fn encode_png(picture: &Picture) -> Result<Vec<u8>, ImageError> {
    let codes: Vec<u8> = picture.rgb.iter().flatten().map(|&v| linear_to_srgb8(v)).collect();
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive)
        .write_image(&codes, picture.width, picture.height, ExtendedColorType::Rgb8)?;
    Ok(bytes)
}

fn encode_hdr(picture: &Picture) -> Result<Vec<u8>, ImageError> {
    let pixels: Vec<Rgb<f32>> =
        picture.rgb.iter().map(|color| Rgb(color.map(|v| v.max(0.0)))).collect();
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes).encode(&pixels, picture.width as usize, picture.height as usize)?;
    Ok(bytes)
}

/// The `image` crate's own EXR encoder leaves the order of the blocks to the threads.
fn encode_exr(picture: &Picture) -> Result<Vec<u8>, exr::error::Error> {
    let width = picture.width as usize;
    let channels = SpecificChannels::rgb(|Vec2(x, y)| {
        let [r, g, b] = picture.rgb[y * width + x];
        (r, g, b)
    });
    let size = (width, picture.height as usize);
    let layer = Layer::new(size, LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp with values below 0 and above 1.
    fn ramp(width: u32, height: u32) -> Picture {
        let mut picture = Picture::black(width, height);
        let n = picture.rgb.len() as f32;
        for (i, color) in (0_u16..).zip(&mut picture.rgb) {
            let t = f32::from(i) / n;
            *color = [t, 3.0 * t * t, 0.5 - t];
        }
        picture
    }

    fn largest_difference(a: &Picture, b: &Picture, of: impl Fn(f32) -> f32) -> f32 {
        assert_eq!((a.width, a.height), (b.width, b.height));
        let pairs = a.rgb.iter().flatten().zip(b.rgb.iter().flatten());
        pairs.map(|(&a, &b)| (of(a) - of(b)).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn each_format_keeps_what_it_can_hold() {
        let folder = tempfile::tempdir().unwrap();
        let picture = ramp(33, 17);
        let read_back = |name: &str| {
            let path = folder.path().join(name);
            write_picture(&path, &picture).unwrap();
            let first = std::fs::read(&path).unwrap();
            write_picture(&path, &picture).unwrap();
            assert!(std::fs::read(&path).unwrap() == first, "{name}: other bytes");
            read_picture(&path).unwrap()
        };
        assert_eq!(read_back("a.exr"), picture);
        // Half a code of 255 in sRGB, after clamping.
        let encoded = |v: f32| crate::image::color::linear_to_srgb(v.clamp(0.0, 1.0));
        let png = read_back("a.PNG");
        assert!(largest_difference(&png, &picture, encoded) < 0.5001 / 255.0);
        assert!(largest_difference(&png, &picture, |v| v) > 1.0, "PNG cannot hold 3");
        // 8 bits below the largest channel of a pixel: at most 1/128 of 3.
        let hdr = read_back("a.hdr");
        assert!(largest_difference(&hdr, &picture, |v| v.max(0.0)) < 3.0 / 128.0);
        assert_ne!(hdr, picture);
    }

    #[test]
    fn png_of_16_bits_and_of_grey_is_decoded() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let deep = ::image::ImageBuffer::from_pixel(1, 1, ::image::Luma([0x8000_u16]));
        deep.save(&path).unwrap();
        let [r, g, b] = read_picture(&path).unwrap().rgb[0];
        // 32768/65535 decodes to 0.214050.
        assert!((r - 0.214_05).abs() < 1e-5 && r == g && g == b, "{r} {g} {b}");
        ::image::ImageBuffer::from_pixel(1, 1, ::image::Luma([188_u8])).save(&path).unwrap();
        assert_eq!(read_picture(&path).unwrap().rgb[0], [srgb8_to_linear(188); 3]);
    }

    #[test]
    fn broken_pictures_are_refused_with_their_name() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |name: &str, bytes: Option<&[u8]>, expected: &str| {
            let path = folder.path().join(name);
            if let Some(bytes) = bytes {
                std::fs::write(&path, bytes).unwrap();
            }
            let error = read_picture(&path).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains(expected), "{error}");
        };
        refused("missing.png", None, "does not exist");
        refused("empty.png", Some(b""), "empty");
        refused("text.png", Some(b"no picture at all"), "not a picture");
        for name in ["cut.png", "cut.exr", "cut.hdr"] {
            write_picture(&folder.path().join(name), &ramp(40, 30)).unwrap();
            let whole = std::fs::read(folder.path().join(name)).unwrap();
            refused(name, Some(&whole[..whole.len() - 20]), "damaged or truncated");
            refused(name, Some(&whole[..24]), "damaged or truncated");
        }
        refused(
            "huge.hdr",
            Some(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 1000000\n"),
            "more than 512 MiB",
        );
        let mut picture = ramp(40, 30);
        picture.rgb[85][2] = f32::INFINITY;
        write_picture(&folder.path().join("infinite.exr"), &picture).unwrap();
        refused("infinite.exr", None, "pixel (5, 2): the value is not a finite number");
    }

    #[test]
    fn outputs_are_checked_beforehand_and_leave_no_trace() {
        let folder = tempfile::tempdir().unwrap();
        let inside = |name: &str| folder.path().join(name);
        for name in ["a.png", "a.Exr", "a.hdr"] {
            check_output(&inside(name)).unwrap();
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        std::fs::write(inside("file"), "").unwrap();
        std::fs::create_dir(inside("folder.png")).unwrap();
        for (name, expected) in [
            ("a.jpg", ".png, .exr or .hdr"),
            ("a", ".png, .exr or .hdr"),
            ("missing/a.png", "cannot be written: its folder does not exist;"),
            ("file/a.png", "cannot be written: not a directory;"),
            ("folder.png", "it names a folder"),
        ] {
            let picture = ramp(4, 4);
            let checked = check_output(&inside(name)).unwrap_err().to_string();
            assert!(checked.contains(expected), "{checked}");
            assert!(write_picture(&inside(name), &picture).is_err(), "{name}");
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
        check_place(&inside("a.json")).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn files_are_replaced_and_links_are_written_through() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        let plain = folder.path().join("plain");
        std::fs::write(&plain, "").unwrap();
        write_bytes(&file, b"first").unwrap();
        write_bytes(&file, b"second").unwrap();
        assert_eq!(std::fs::read(&file).unwrap(), b"second");
        let mode = |path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&file), mode(&plain), "no private file");
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_bytes(&link, b"third").unwrap();
        assert!(link.is_symlink());
        assert_eq!(std::fs::read(&file).unwrap(), b"third");
        assert!(!replaceable(Path::new("/dev/null")));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
    }
}
