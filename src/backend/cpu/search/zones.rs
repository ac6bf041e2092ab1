//! Hollow mirrors show what is near them upright and what is far from them upside down; between these zones (Roger &
//! Holzschuch section 4.4) a point has several images, of which a search finds one.

use glam::{DVec3, Vec3};

use super::images::Reflecting;
use crate::camera::three_ray::multiplicity::Jacobian;
use crate::error::Result;
use crate::plan::search::Bend;

/// Vertices of an object that are looked at.
const SAMPLE: usize = 256;

/// A sentence for each object that is not in one of the zones with a single image as a whole.
pub(super) fn notes(reflecting: &Reflecting<'_>) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    if reflecting.part.bend != Bend::Concave {
        return Ok(notes);
    }
    for object in &reflecting.scene.objects {
        let every = object.positions.len().div_ceil(SAMPLE).max(1);
        let sample: Vec<Vec3> = object.positions.iter().copied().step_by(every).collect();
        let mut zones = [false; 3];
        for (rays, lambda) in reflecting.paths(&sample)? {
            // How often neighbouring rays have crossed before: twice at most.
            let folds = Jacobian::of(&rays).folds_on_ray(DVec3::splat(1.0 / 3.0));
            let before = |fold: &f64| (0.0..lambda).contains(fold);
            zones[folds.into_iter().flatten().filter(before).count()] = true;
        }
        if zones[1] || (zones[0] && zones[2]) {
            notes.push(format!(
                "{} is partly where {} shows several images of a point: one of them is drawn",
                object.name, reflecting.part.name
            ));
        }
    }
    Ok(notes)
}
