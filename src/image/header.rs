//! What a picture file says of itself, before anything is decoded or allocated for it.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use ::image::ImageReader;

use super::io::picture_error;
use crate::error::{Error, Result};

/// Pixels that a byte of a file can stand for at most: deflate's 1032 bytes of eight pixels each. Runs and blocks of other
/// formats are shorter.
const MOST_PER_BYTE: u64 = 8 * 1032;
/// Files that are read at all: 1 GiB, twice the most that is decoded.
const MOST_BYTES: u64 = 1 << 30;

/// Width and height of a picture, in any format that [`read_picture`](super::io::read_picture) knows.
///
/// # Errors
/// The file cannot be read or is larger than 1 GiB, its header is damaged or of another format, or it claims more pixels
/// than a file of its size can hold.
pub fn picture_size(path: &Path) -> Result<[u32; 2]> {
    let unreadable = |error: std::io::Error| {
        let remedy = "check the name and its rights";
        Error::file(path, "", format!("cannot be read: {}", error.kind()), remedy)
    };
    let file = File::open(path).map_err(unreadable)?;
    let bytes = file.metadata().map_err(unreadable)?.len();
    if bytes > MOST_BYTES {
        let problem = format!("its {} MiB are more than a picture may have", bytes >> 20);
        return Err(Error::file(path, "", problem, "scale it down"));
    }
    let reader =
        ImageReader::new(BufReader::new(file)).with_guessed_format().map_err(unreadable)?;
    let (width, height) = reader.into_dimensions().map_err(|e| picture_error(path, &e))?;
    if u64::from(width) * u64::from(height) > MOST_PER_BYTE.saturating_mul(bytes) {
        let problem =
            format!("damaged or truncated: {bytes} bytes cannot hold {width}x{height} pixels");
        return Err(Error::file(path, "", problem, "write it again, or give another picture"));
    }
    Ok([width, height])
}
