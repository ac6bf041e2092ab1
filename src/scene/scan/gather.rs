//! Points from a file into memory.

use std::path::Path;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::image::color::srgb_to_linear;
use crate::scene::load::points::{Colors, PointReader};

/// Points in memory, as parallel lists.
#[derive(Clone, Debug, Default)]
pub(super) struct Points {
    /// What was taken off the coordinates.
    pub(super) offset: DVec3,
    pub(super) positions: Vec<Vec3>,
    /// Of any length, maybe not finite. Empty if there are none.
    pub(super) normals: Vec<Vec3>,
    /// Linear RGB, 0 to 1. Empty if there are none.
    pub(super) colors: Vec<Vec3>,
}

/// Points that are read at once: some milliseconds.
const PART: usize = 1 << 16;
/// Coordinates that are no more than so many times as far from zero as the cloud is large keep their zero.
const NEAR_ZERO: f64 = 2.0;
/// Part of the intensities that become white at most: a few returns from polished metal would leave all else black.
const WHITE_SHARE: f64 = 0.99;

/// Reads all points of a file, at most `most`.
pub(super) fn read(path: &Path, most: usize, cx: &Context) -> Result<Points> {
    let mut reader = PointReader::open(path)?;
    let layout = reader.layout();
    let mut positions = Vec::new();
    let (mut normals, mut colors) = (Vec::new(), Vec::new());
    let mut asked = 0;
    loop {
        cx.step("loading", reader.done())?;
        let part = reader.read_whole(PART)?;
        if part.is_empty() {
            break;
        }
        if positions.len() + part.len() > asked {
            // An eighth more is read before the question is asked again.
            asked = (positions.len() + part.len()) / 8 * 9;
            let all = (asked as u64).saturating_mul(super::BYTES_PER_POINT as u64);
            let bytes = all - size_of_val(&positions[..]) as u64;
            cx.room_for(&path.display().to_string(), &format!("{asked} points"), bytes)?;
        }
        if positions.len() + part.len() > most {
            let problem = format!("has more than {most} points");
            return Err(Error::file(path, "", problem, "thin it out or cut it into parts"));
        }
        positions.extend(part.iter().map(|point| point.position));
        if layout.normals {
            normals.extend(part.iter().map(|point| point.normal));
        }
        if layout.colors.is_some() {
            colors.extend(part.iter().map(|point| point.color));
        }
    }
    if let Some(kind) = layout.colors {
        decode(&mut colors, kind);
    }
    let (offset, positions) = place(&positions);
    Ok(Points { offset, positions, normals, colors })
}

/// Takes an offset off that leaves coordinates no larger than the cloud; none where they are so already.
pub(super) fn place(positions: &[DVec3]) -> (DVec3, Vec<Vec3>) {
    let corners = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
    let none = || (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = positions.par_iter().map(|&p| (p, p)).reduce(none, corners);
    let size = (high - low).max_element();
    let offset = if low.abs().max(high.abs()).max_element() <= NEAR_ZERO * size {
        DVec3::ZERO
    } else if size > 0.0 {
        // A round number in binary: taking it off leaves the digits of the rest as they are.
        let unit = size.log2().floor().exp2();
        ((low + high) / 2.0 / unit).round() * unit
    } else {
        low
    };
    // Zero has one sign only, so that equal places have equal bits.
    let local = positions.par_iter().map(|&p| (p - offset).as_vec3() + Vec3::ZERO);
    (offset, local.collect())
}

/// Turns stored numbers into linear RGB, 0 to 1; empties the list if they are no colours at all.
fn decode(colors: &mut Vec<Vec3>, kind: Colors) {
    let largest = colors.par_iter().map(|c| c.max_element()).reduce(|| 0.0, f32::max);
    let white = match kind {
        Colors::Linear => None,
        Colors::Srgb(white) => Some(white),
        Colors::ByLargest if largest <= 0.0 => {
            colors.clear();
            return;
        }
        Colors::ByLargest if largest <= 1.0 => None,
        Colors::ByLargest => Some(if largest <= 255.0 { 255.0 } else { 65535.0 }),
        Colors::Intensity => {
            let white = bright(colors);
            if white <= 0.0 {
                colors.clear();
                return;
            }
            colors.par_iter_mut().for_each(|c| *c /= white);
            None
        }
    };
    let clamped = |v: f32| if v > 0.0 { v.min(1.0) } else { 0.0 };
    colors.par_iter_mut().for_each(|color| {
        *color = match white {
            None => color.map(clamped),
            Some(white) => (*color / white).map(|v| srgb_to_linear(clamped(v))),
        };
    });
}

/// An intensity that only few exceed.
fn bright(colors: &[Vec3]) -> f32 {
    let step = colors.len() / SAMPLED + 1;
    let mut some: Vec<f32> = colors.iter().step_by(step).map(|c| c.x).collect();
    some.retain(|v| v.is_finite());
    if some.is_empty() {
        return 0.0;
    }
    #[expect(clippy::cast_possible_truncation, reason = "a part of a length")]
    let at = (some.len() as f64 * WHITE_SHARE) as usize;
    let at = at.min(some.len() - 1);
    let white = *some.select_nth_unstable_by(at, f32::total_cmp).1;
    if white > 0.0 { white } else { some.into_iter().fold(0.0, f32::max) }
}

/// Intensities that are looked at, about.
const SAMPLED: usize = 1 << 20;

impl Points {
    pub(super) fn len(&self) -> usize {
        self.positions.len()
    }

    /// Only these points, in this order.
    pub(super) fn pick(&mut self, which: &[u32]) {
        for list in [&mut self.positions, &mut self.normals, &mut self.colors] {
            if !list.is_empty() {
                *list = which.par_iter().map(|&i| list[i as usize]).collect();
            }
        }
    }
}
