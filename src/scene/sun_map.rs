//! Where the sun shines and where it does not, as far as a map from the sun's side can tell for sure: most points need no
//! shadow ray.
//!
//! The map is orthographic along the light. Of every texel it keeps bounds over *all* of it, not samples: above which
//! height nothing stands in the light, and below which height everything is in the shadow. What lies between is left to
//! the rays. Two observations make the bounds tight:
//!
//! - A closed surface is entered through a side that faces away from the sun. From outside such sides alone have to be
//!   in the map (cf. Wang & Molnar 1994), so lit surfaces do not stand in their own light.
//! - How many layers of a surface lie over a point changes only across its outline and its border. A texel without
//!   those that is touched by a triangle is covered altogether, however small the triangles are.

mod draw;

use glam::Vec3;
use rayon::prelude::*;

use self::draw::{Placed, Strip};
use super::shade::TERMINATOR;
use crate::geometry::{Aabb, SharedEdge};

/// Texels along the longer side of a map.
const SIDE: f32 = 1024.0;

/// Rows of texels a task.
const STRIP: usize = 64;

/// What is uncertain about a point's place, in units of [`super::shade::Sun::apart`]: shadow rays start by that much
/// above their surface, and both the map and the point are rounded.
const MARGIN: f32 = 2.0;

/// By what part of their size triangles are grown: more than the rays grow them.
const GROWTH: f32 = 1e-4;

/// An object as the map takes it.
#[derive(Clone, Copy)]
pub(super) struct Caster<'a> {
    /// Scene space.
    pub(super) positions: &'a [Vec3],
    /// Vertex indices.
    pub(super) triangles: &'a [[u32; 3]],
    /// See [`crate::geometry::Mesh::shared_edges`].
    pub(super) edges: &'a [SharedEdge],
    /// Encloses something, with its triangles counter-clockwise from outside.
    pub(super) closed: bool,
}

/// Bounds over a texel, as heights towards the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(16))]
struct Texel {
    /// Nothing that the light enters through is above this.
    top: f32,
    /// Nothing at all that casts a shadow is above the higher one of the two.
    face: f32,
    /// Everything below this is in the shadow.
    cover: f32,
    /// The same by surfaces that a point this far below cannot be a part of.
    far_cover: f32,
}

const NOTHING: Texel = Texel {
    top: f32::NEG_INFINITY,
    face: f32::NEG_INFINITY,
    cover: f32::NEG_INFINITY,
    far_cover: f32::NEG_INFINITY,
};

/// See the module.
#[derive(Debug, Default, Clone)]
pub struct SunMap {
    /// Scene space to map: two coordinates in texels, and the height in scene units.
    axes: [Vec3; 3],
    /// Of the first two.
    offset: [f32; 2],
    size: [usize; 2],
    texels: Vec<Texel>,
    /// Length of a texel, scene units.
    unit: f32,
    margin: f32,
    /// For each [`Backdrop`]: the distance in front of it, linear in the place.
    behind: Vec<[f32; 4]>,
}

impl SunMap {
    /// Of these objects under a sun in that direction (unit). `apart`: see [`super::shade::Sun::apart`].
    pub(super) fn new(casters: &[Caster], to_sun: Vec3, apart: f32) -> Self {
        let (right, up) = to_sun.any_orthonormal_pair();
        let axes = [right, up, to_sun];
        let margin = MARGIN * apart;
        let boxes: Vec<Aabb> = casters.iter().map(bounds).collect();
        let (mut standing, mut backdrops) = (Vec::new(), Vec::<Backdrop>::new());
        for caster in casters.iter().filter(|c| !c.triangles.is_empty()) {
            match Backdrop::of(caster, &boxes, to_sun, apart) {
                None => standing.push(*caster),
                Some(new) if backdrops.iter().any(|old| old.is(&new, apart)) => {}
                Some(new) => backdrops.push(new),
            }
        }
        let placed: Vec<Placed> = standing.iter().map(|c| Placed::new(c, axes)).collect();
        let (mut min, mut max) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for object in &placed {
            for k in 0..2 {
                min[k] = min[k].min(object.min[k]);
                max[k] = max[k].max(object.max[k]);
            }
        }
        let longest = (max[0] - min[0]).max(max[1] - min[1]) + 8.0 * margin;
        if placed.is_empty() {
            return Self::default();
        }
        if !(longest > 0.0 && longest.is_finite() && to_sun.is_finite()) {
            return Self { behind: vec![EVERYWHERE], ..Self::default() };
        }
        // A flat scene has a side of no length.
        let unit = longest * (1.0 + 2.0 * GROWTH) / SIDE;
        let size = [0, 1].map(|k: usize| count((max[k] - min[k] + 8.0 * margin) / unit) + 2);
        let offset = [0, 1].map(|k: usize| 1.0 - (min[k] - 4.0 * margin) / unit);
        let mut map = Self {
            axes: [right / unit, up / unit, to_sun],
            offset,
            size,
            texels: vec![NOTHING; size[0] * size[1]],
            unit,
            margin,
            behind: backdrops.iter().map(|b| b.in_map(axes, unit, offset)).collect(),
        };
        let mut texels = std::mem::take(&mut map.texels);
        texels.par_chunks_mut(STRIP * size[0]).enumerate().for_each(|(i, rows)| {
            let strip = Strip {
                map: &map,
                first: i * STRIP,
                rows: rows.len() / size[0],
                margin: margin / unit,
            };
            let mut layer = Vec::new();
            for object in &placed {
                strip.add(object, &mut layer, rows);
            }
        });
        map.texels = texels;
        map
    }

    /// The matrix that takes a point of scene space to the place that [`Self::lights`] asks for, without the offset.
    pub fn axes(&self) -> [Vec3; 3] {
        self.axes
    }

    /// What has to be added to the first two coordinates.
    pub fn offset(&self) -> [f32; 2] {
        self.offset
    }

    /// Whether the sun lights a point of a surface that faces it, or `None` if only a ray can tell. `facing`: n·l there,
    /// positive. Rays of the surface's own facets count as in [`super::shade::Sun`].
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "texels are few; beyond is beyond")]
    pub fn lights(&self, [x, y, height]: [f32; 3], facing: f32) -> Option<bool> {
        let is_behind = |[a, b, c, d]: &[f32; 4]| a * x + b * y + c * height + d < -self.margin;
        if self.behind.iter().any(is_behind) {
            return None;
        }
        // Below zero becomes zero, which is a texel of nothing.
        let (column, row) = (x as u32 as usize, y as u32 as usize);
        if column >= self.size[0] || row >= self.size[1] {
            return (x + y).is_finite().then_some(true);
        }
        let texel = &self.texels[row * self.size[0] + column];
        let highest = height + self.margin;
        let cover = if facing < TERMINATOR { texel.far_cover } else { texel.cover };
        if highest < cover {
            return Some(false);
        }
        // What faces the sun above a point that nothing shades is its own surface, rising within the texel. If it is
        // not, the point is inside of something.
        let rise = texel.face - highest;
        let slope = 3.0 * self.unit;
        let own =
            rise <= 0.0 || rise * rise * facing * facing <= slope * slope * (1.0 - facing * facing);
        (own && height - self.margin > texel.top).then_some(true)
    }

    /// [`Self::lights`] for a point in scene space.
    #[inline]
    pub(super) fn lights_point(&self, point: Vec3, facing: f32) -> Option<bool> {
        let [x, y, height] = self.axes.map(|axis| axis.dot(point));
        self.lights([x + self.offset[0], y + self.offset[1], height], facing)
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most SIDE or so")]
fn count(texels: f32) -> usize {
    texels.ceil() as usize
}

/// Has everything behind it.
const EVERYWHERE: [f32; 4] = [0.0, 0.0, 0.0, f32::NEG_INFINITY];

fn bounds(object: &Caster) -> Aabb {
    Aabb::of(object.triangles.iter().flatten().map(|&i| object.positions[i as usize]))
}

/// The plane of a flat object that most things are in front of, as seen from the sun: a floor. It shades only what is
/// behind it, which is left to the rays. In the map it would be in its own light in every texel.
struct Backdrop {
    /// Towards the sun.
    normal: Vec3,
    level: f32,
}

impl Backdrop {
    fn of(object: &Caster, all: &[Aabb], to_sun: Vec3, apart: f32) -> Option<Self> {
        let first = object.positions[object.triangles[0][0] as usize];
        let area: Vec3 = object
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| object.positions[i as usize]);
                (b - a).cross(c - a)
            })
            .sum();
        let normal = area.try_normalize()?;
        let normal = if normal.dot(to_sun) < 0.0 { -normal } else { normal };
        let level = normal.dot(first);
        let flat = |p: &Vec3| (normal.dot(*p) - level).abs() <= apart;
        // What nothing is in, or something that is not finite, is nowhere.
        let behind = |b: &Aabb| normal.dot(b.center()) - level < -apart;
        let some = object.positions.iter().all(flat) && !all.iter().any(behind);
        some.then_some(Self { normal, level })
    }

    fn is(&self, other: &Self, apart: f32) -> bool {
        self.normal == other.normal && (self.level - other.level).abs() < apart
    }

    fn in_map(&self, axes: [Vec3; 3], unit: f32, offset: [f32; 2]) -> [f32; 4] {
        let [right, up, along] = axes.map(|axis| axis.dot(self.normal));
        let (x, y) = (right * unit, up * unit);
        [x, y, along, -self.level - x * offset[0] - y * offset[1]]
    }
}

#[cfg(test)]
mod tests;
