//! Bytes of a glTF file: in it, in data URIs, in files beside it.

use std::borrow::Cow;
use std::path::Path;

use base64::Engine as _;
use gltf::Gltf;
use gltf::buffer::Source;

use super::super::nearby::Nearby;
use super::super::{GET_IT_AGAIN, REPAIR, bytes};
use crate::context::Context;
use crate::error::{Error, Result};

/// The bytes of all buffers, each at least as long as the file says.
pub(super) fn read(
    path: &Path,
    file: &mut Gltf,
    nearby: Nearby<'_>,
    cx: &Context,
) -> Result<Vec<Vec<u8>>> {
    let mut blob = file.blob.take();
    let mut all = Vec::new();
    for buffer in file.buffers() {
        cx.check()?;
        let place = format!("buffer {}", buffer.index());
        let data = match buffer.source() {
            Source::Bin => blob.take().ok_or_else(|| {
                Error::file(path, place.as_str(), "has no binary chunk", GET_IT_AGAIN)
            })?,
            Source::Uri(uri) => resource(path, &place, uri, nearby, cx)?,
        };
        if data.len() < buffer.length() {
            let problem =
                format!("has {} bytes, but the file promises {}", data.len(), buffer.length());
            return Err(Error::file(path, place, problem, GET_IT_AGAIN));
        }
        all.push(data);
    }
    Ok(all)
}

/// What a URI names: data in itself, or a file.
pub(super) fn resource(
    path: &Path,
    place: &str,
    uri: &str,
    nearby: Nearby<'_>,
    cx: &Context,
) -> Result<Vec<u8>> {
    if let Some(data) = uri.strip_prefix("data:") {
        let bad = |problem: &str| Error::file(path, place, problem, REPAIR);
        let (kind, data) = data.split_once(',').ok_or_else(|| bad("has data without a comma"))?;
        return if kind.ends_with(";base64") {
            base64::engine::general_purpose::STANDARD
                .decode(data.trim())
                .map_err(|_| bad("has data that is not base64"))
        } else {
            Ok(percent_encoding::percent_decode_str(data).collect())
        };
    }
    let name: Cow<'_, str> = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
    let file =
        nearby.find(&name).map_err(|why| why.error(&path.display().to_string(), place, &name))?;
    let size = std::fs::metadata(&file).map_or(0, |data| data.len());
    cx.room_for(&file.display().to_string(), "its contents", size)?;
    bytes(&file)
}
