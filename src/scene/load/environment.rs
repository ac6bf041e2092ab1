//! Environments from picture files: equirectangular HDR, EXR, PNG and JPEG.

use std::path::Path;
use std::sync::Arc;

use super::check_readable;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::image::header::picture_size;
use crate::image::io::read_picture;
use crate::scene::description::Environment;
use crate::scene::environment::image::{EnvironmentImage, Mounting, misshapen};

/// Peak bytes a texel: the file, what it is decoded to, and what that is resampled to.
const TEXEL_BYTES: u64 = 48;

/// Reads a panorama. PNG and JPEG are taken as sRGB. Its shape is checked before it is decoded.
///
/// # Errors
/// [`Error::Input`] names the file: it cannot be read, is no picture or a damaged one, holds a value that is not finite, or is
/// no panorama (twice as wide as high, at most 44.7 million pixels); or `mounting` is out of range. [`Error::Cancelled`].
pub fn environment(path: &Path, mounting: Mounting, cx: &Context) -> Result<Environment> {
    check_readable(path)?;
    let [width, height] = picture_size(path)?;
    if let Some((problem, remedy)) = misshapen(width, height) {
        return Err(Error::file(path, "", problem, remedy));
    }
    if let Some(problem) = mounting.defect() {
        return Err(Error::file(path, "", problem, "choose another one"));
    }
    let texels = u64::from(width) * u64::from(height);
    let what = format!("{width} x {height} texels");
    cx.room_for(&path.display().to_string(), &what, TEXEL_BYTES * texels)?;
    cx.step("reading the environment", 0.0)?;
    let panorama = read_picture(path)?;
    cx.step("reading the environment", 1.0)?;
    let mut image = EnvironmentImage::new(&panorama, mounting, cx)?;
    image.source = Some(path.canonicalize().unwrap_or_else(|_| path.to_owned()));
    Ok(Environment::Image(Arc::new(image)))
}
