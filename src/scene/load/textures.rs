//! Pictures on surfaces, each decoded once.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::{ImageReader, Limits};

use crate::context::Context;
use crate::error::{Error, Result};
use crate::scene::materials::{Texture, Wrap};

/// Texels of a side, at most.
const MOST: u32 = 16_384;

/// Decodes pictures and remembers them by where they come from.
#[derive(Default)]
pub(super) struct Textures {
    known: Vec<(Key, Option<Arc<Texture>>)>,
    /// What could not be read, and why: surfaces are shown without.
    pub notes: Vec<String>,
}

/// Where a picture comes from, and how it goes on outside.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Key {
    File(PathBuf, [Wrap; 2]),
    /// The index of an image in the file.
    Image(usize, [Wrap; 2]),
}

impl Textures {
    /// The texture of that key, which `bytes` gives encoded. What cannot be decoded is noted, and there is none.
    ///
    /// # Errors
    /// There is no room for it, or cancelled.
    pub(super) fn get(
        &mut self,
        key: Key,
        name: &Path,
        bytes: impl FnOnce() -> Result<Vec<u8>>,
        cx: &Context,
    ) -> Result<Option<Arc<Texture>>> {
        if let Some((_, texture)) = self.known.iter().find(|(known, _)| *known == key) {
            return Ok(texture.clone());
        }
        cx.check()?;
        let (Key::File(_, wrap) | Key::Image(_, wrap)) = key;
        let texture = match bytes().and_then(|bytes| decoded(name, &bytes, wrap, cx)) {
            Ok(texture) => Some(Arc::new(texture)),
            Err(error @ Error::Input { .. }) if !is_refusal(&error) => {
                self.notes.push(format!("{error}: shown without this texture"));
                None
            }
            Err(error) => return Err(error),
        };
        self.known.push((key, texture.clone()));
        Ok(texture)
    }
}

/// Whether there was no room: going on would not be what the user wants.
fn is_refusal(error: &Error) -> bool {
    matches!(error, Error::Input { remedy, .. } if remedy.contains("--max-memory"))
}

fn decoded(name: &Path, bytes: &[u8], wrap: [Wrap; 2], cx: &Context) -> Result<Texture> {
    let damaged = |problem: String| {
        Error::file(name, "", problem, "give a whole PNG, JPEG, TGA or BMP picture")
    };
    let reader = || {
        let mut reader = ImageReader::new(Cursor::new(bytes));
        // Some formats cannot be told by their content.
        if let Ok(format) = image::ImageFormat::from_path(name) {
            reader.set_format(format);
        }
        reader.with_guessed_format().map_err(|e| damaged(e.to_string()))
    };
    let (width, height) = reader()?.into_dimensions().map_err(|e| damaged(e.to_string()))?;
    if width == 0 || height == 0 || width > MOST || height > MOST {
        let problem = format!("{width} x {height} texels are not between 1 and {MOST} a side");
        return Err(Error::file(name, "", problem, "give a smaller picture"));
    }
    let size = u64::from(width) * u64::from(height);
    // Four channels of 16 bits at worst, besides the texture itself.
    let decoding = 8 * size;
    let all = decoding + Texture::bytes(width, height);
    cx.room_for(&name.display().to_string(), &format!("{width} x {height} texels"), all)?;
    let mut reader = reader()?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MOST);
    limits.max_image_height = Some(MOST);
    limits.max_alloc = Some(2 * decoding + (1 << 20));
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| damaged(e.to_string()))?;
    let texels = picture.into_rgb8().pixels().map(|p| p.0).collect();
    Ok(Texture::new(width, height, texels, wrap))
}
