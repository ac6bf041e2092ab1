//! Hollow mirrors show what is near them upright and what is far from them upside down; between these zones (Roger &
//! Holzschuch section 4.4) a point has several images, of which a search finds one.

use glam::Vec3;

use super::images::Reflecting;
use crate::camera::three_ray::multiplicity::quadratics;
use crate::error::Result;

/// Vertices of an object that are looked at.
const SAMPLE: usize = 256;

/// A sentence for each object that is not in one of the zones with a single image as a whole.
pub(super) fn notes(reflecting: &Reflecting<'_>) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    if !reflecting.part.map.inward {
        return Ok(notes);
    }
    for object in &reflecting.scene.objects {
        let every = object.positions.len().div_ceil(SAMPLE).max(1);
        let sample: Vec<Vec3> = object.positions.iter().copied().step_by(every).collect();
        let mut zones = [false; 3];
        for (rays, lambda) in reflecting.paths(&sample)? {
            zones[folds_before(&quadratics(&rays), lambda)] = true;
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

/// How many times neighbouring rays have crossed before λ: the sign changes of det J along the middle ray, 0 to 2.
fn folds_before(g: &[[f64; 3]; 3], lambda: f64) -> usize {
    let [c, b, a] = [0, 1, 2].map(|k| (g[0][k] + g[1][k] + g[2][k]) / 3.0);
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return 0;
    }
    let t = -0.5 * (b + discriminant.sqrt().copysign(b));
    [t / a, c / t].into_iter().filter(|root| (0.0..lambda).contains(root)).count()
}
