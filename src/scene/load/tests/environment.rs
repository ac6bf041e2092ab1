//! Panoramas from files.

use std::path::Path;

use ::image::codecs::jpeg::JpegEncoder;
use ::image::{ExtendedColorType, ImageEncoder, RgbImage};

use super::super::environment;
use super::*;
use crate::image::Picture;
use crate::image::color::{linear_to_srgb8, srgb8_to_linear};
use crate::image::io::write_picture;
use crate::scene::description::{Environment, Light};
use crate::scene::environment::image::Mounting;

const LIGHT: Light = Light { to_sun: Vec3::Y, sun: Vec3::ONE, ambient: Vec3::ZERO };

/// Left half red, right half blue; towards the top as bright as `top`.
fn panorama(top: f32) -> Picture {
    let mut picture = Picture::black(128, 64);
    for (i, pixel) in picture.rgb.iter_mut().enumerate() {
        let (x, y) = (i % 128, i / 128);
        let bright = 0.1 + (top - 0.1) * (1.0 - y as f32 / 63.0);
        *pixel = if x < 64 { [bright, 0.05, 0.0] } else { [0.0, 0.05, bright] };
    }
    picture
}

fn bytes_of(folder: &Path, name: &str, picture: &Picture) -> Vec<u8> {
    let path = folder.join(name);
    if !name.ends_with("jpg") {
        write_picture(&path, picture).unwrap();
        return fs::read(path).unwrap();
    }
    let codes: Vec<u8> = picture.rgb.iter().flatten().map(|&v| linear_to_srgb8(v)).collect();
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 100)
        .write_image(&codes, picture.width, picture.height, ExtendedColorType::Rgb8)
        .unwrap();
    bytes
}

fn read(path: &Path) -> Result<Environment> {
    environment(path, Mounting::default(), &Context::default())
}

#[test]
fn every_format_gives_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    // How far each may be off, of the largest value that it can hold.
    for (name, top, off) in
        [("a.hdr", 40.0, 0.01), ("a.exr", 40.0, 1e-4), ("a.png", 1.0, 0.01), ("a.jpg", 1.0, 0.04)]
    {
        let picture = panorama(top);
        let bytes = bytes_of(folder.path(), name, &picture);
        // The content tells the format, not the name.
        for path in [folder.path().join(name), folder.path().join("other.hdr")] {
            fs::write(&path, &bytes).unwrap();
            let found = read(&path).unwrap();
            let Environment::Image(image) = &found else { panic!() };
            assert_eq!(image.source.as_deref(), Some(&*path.canonicalize().unwrap()));
            for row in [0.5_f32, 15.5, 47.5] {
                let north = std::f32::consts::PI * (0.5 - (row + 0.5) / 64.0);
                let bright = 0.1 + (top - 0.1) * (1.0 - row / 63.0);
                let [left, right] = [-1.0_f32, 1.0]
                    .map(|x| found.radiance(Vec3::new(x * north.cos(), north.sin(), 0.0), &LIGHT));
                let apart = (left - Vec3::new(bright, 0.05, 0.0)).abs().max_element();
                assert!(apart < off * top, "{name} {north}: {left} instead of {bright}");
                let apart = (right - Vec3::new(0.0, 0.05, bright)).abs().max_element();
                assert!(apart < off * top, "{name} {north}: {right} instead of {bright}");
            }
        }
    }
    // Grey with 16 bits: sRGB, too.
    let path = folder.path().join("grey.png");
    ::image::ImageBuffer::from_pixel(64, 32, ::image::Luma([188_u16 * 257])).save(&path).unwrap();
    let grey = read(&path).unwrap().radiance(Vec3::Y, &LIGHT);
    assert!((grey - srgb8_to_linear(188)).abs().max_element() < 1e-5, "{grey}");
}

#[test]
fn mounted_as_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    write_picture(&path, &panorama(2.0)).unwrap();
    let turned = Mounting { rotate_deg: 180.0, exposure: 3.0 };
    let found = environment(&path, turned, &Context::default()).unwrap();
    let left = found.radiance(Vec3::NEG_X, &LIGHT);
    assert!(left.x < 0.01 && (left.y - 0.4).abs() < 0.01 && left.z > 1.0, "{left}");
    let wrong = Mounting { exposure: f64::NAN, ..turned };
    let error = environment(&path, wrong, &Context::default()).unwrap_err().to_string();
    assert!(error.contains("a.exr: an exposure of NaN stops"), "{error}");
    let cx = Context::default();
    cx.cancel_flag().store(true, Ordering::Relaxed);
    assert!(matches!(environment(&path, turned, &cx), Err(Error::Cancelled)));
}

#[test]
fn bad_panoramas_are_refused_with_their_name() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, bytes: &[u8], expected: &str| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let error = read(&path).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(expected), "{expected}: {error}");
        assert!(!error.contains('\n') && error.contains("; "), "{error}");
    };
    for name in ["cut.png", "cut.exr", "cut.hdr", "cut.jpg"] {
        let whole = bytes_of(folder.path(), name, &panorama(1.0));
        refused(name, &whole[..whole.len() - 20], "damaged or truncated");
        refused(name, &whole[..whole.len() / 2], "damaged or truncated");
        refused(name, &whole[..20], "damaged or truncated");
        refused(name, b"", "is empty");
        refused(name, b"a text that is no picture", "not a picture in a format that can be read");
    }
    // Headers that promise what cannot be there, or more than is read.
    let mut claims = RgbImage::new(2, 1);
    claims.put_pixel(0, 0, ::image::Rgb([1, 2, 3]));
    let path = folder.path().join("claims.png");
    claims.save(&path).unwrap();
    let sized = |width: u32, height: u32| {
        let mut bytes = fs::read(&path).unwrap();
        bytes[16..20].copy_from_slice(&width.to_be_bytes());
        bytes[20..24].copy_from_slice(&height.to_be_bytes());
        let sum = crc32fast::hash(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&sum.to_be_bytes());
        bytes
    };
    refused("a.png", &sized(8192, 4096), "bytes cannot hold 8192x4096 pixels");
    refused("a.png", &sized(0, 0), "damaged or truncated");
    refused("a.png", &sized(600, 300), "damaged or truncated");
    let mut large = sized(60_000, 30_000);
    large.resize(1 << 20, 0);
    refused("a.png", &large, "60000x30000 pixels are more than an environment may have");
    let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 500000 +X 1000000\n";
    refused("a.hdr", header, "cannot hold 1000000x500000 pixels");
    let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100 +X 200\n";
    refused("a.hdr", header, "damaged or truncated");
    let square = bytes_of(folder.path(), "square.png", &Picture::black(64, 64));
    refused("square.png", &square, "64x64 pixels are no panorama, which is twice as wide as high");
    let mut holed = panorama(1.0);
    holed.rgb[130][2] = f32::NAN;
    let holed = bytes_of(folder.path(), "nan.exr", &holed);
    refused("nan.exr", &holed, "pixel (2, 1): the value is not a finite number");
    for (name, expected) in [("none.hdr", "does not exist"), (".", "is a folder")] {
        let error = read(&folder.path().join(name)).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn any_byte_may_be_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let mut small = Picture::black(16, 8);
    for (i, pixel) in (0u8..).zip(&mut small.rgb) {
        *pixel = [f32::from(i) / 128.0, 0.5, 0.1];
    }
    for name in ["a.png", "a.exr", "a.hdr", "a.jpg"] {
        let whole = bytes_of(folder.path(), name, &small);
        let path = folder.path().join(name);
        for at in 0..whole.len() {
            for change in [0x01, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] ^= change;
                fs::write(&path, bytes).unwrap();
                // A picture of other colours, or a clear refusal.
                match read(&path) {
                    Ok(Environment::Image(image)) => {
                        assert!(image.nodes().iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
                    }
                    Err(Error::Input { name: named, .. }) => assert!(named.ends_with(name)),
                    other => panic!("{name}, byte {at}: {other:?}"),
                }
            }
        }
    }
}
