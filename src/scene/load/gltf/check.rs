//! Whether a glTF file can be asked without a panic of the crate. Its own validation trusts some indices before it has looked at
//! them, and leaves out what images need; those are looked at first.

use std::path::Path;

use gltf::json::validation::{Error as Invalid, Validate as _};
use gltf::json::{Path as Place, Root};

use super::super::REPAIR;
use crate::error::{Error, Result};

/// # Errors
/// Names the first thing that is wrong.
pub(super) fn check(path: &Path, root: &Root) -> Result<()> {
    let wrong = |place: String, problem: &str| Error::file(path, place, problem.to_owned(), REPAIR);
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let used = primitive.attributes.values().chain(&primitive.indices);
            if { used }.any(|index| index.value() >= root.accessors.len()) {
                let place = format!("meshes[{m}].primitives[{p}]");
                return Err(wrong(place, "names an accessor that does not exist"));
            }
        }
    }
    for (i, image) in root.images.iter().enumerate() {
        let missing = match image.buffer_view {
            Some(_) if image.mime_type.is_none() => "has no mimeType",
            None if image.uri.is_none() => "has neither data nor a name",
            _ => continue,
        };
        return Err(wrong(format!("images[{i}]"), missing));
    }
    let mut first = None;
    let mut unsupported = None;
    root.validate(root, Place::new, &mut |place: &dyn Fn() -> Place, error: Invalid| {
        if unsupported.is_none() && matches!(error, Invalid::Unsupported) {
            unsupported = Some(place().to_string()).filter(|p| p.contains("extensionsRequired"));
        }
        first.get_or_insert_with(|| (place().to_string(), error));
    });
    // What it asks for may be why the rest seems wrong: compressed data are not where they should be.
    if let Some(place) = unsupported {
        let problem = "needs an extension that is not supported";
        let remedy = "export it without compression or other required extensions";
        return Err(Error::file(path, place, problem, remedy));
    }
    match first {
        None => Ok(()),
        Some((place, error)) => Err(wrong(place, &format!("is not valid glTF: {error}"))),
    }
}
