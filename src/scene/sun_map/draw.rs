//! Draws objects into the map: bounds over every texel that a triangle may touch.

use glam::Vec3;
use rayon::prelude::*;

use super::{Caster, GROWTH, SunMap, Texel};
use crate::geometry::Aabb;
use crate::scene::shade::{NEIGHBORHOOD, TERMINATOR};

/// Which way a triangle looks.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    ToSun,
    Away,
    /// Neither, or it is not finite.
    Neither,
}

/// An object in the sun's axes, scene units.
pub(super) struct Placed<'a> {
    caster: Caster<'a>,
    points: Vec<Vec3>,
    sides: Vec<Side>,
    pub(super) min: Vec3,
    pub(super) max: Vec3,
    /// Longest edge of a triangle.
    longest: f32,
    /// How far away a facet that counts as a point's own surface may be: none that the sun is high above does.
    reach: f32,
}

impl<'a> Placed<'a> {
    pub(super) fn new(caster: &Caster<'a>, axes: [Vec3; 3]) -> Self {
        let along = |p: &Vec3| Vec3::from(axes.map(|axis| axis.dot(*p)));
        let points: Vec<Vec3> = caster.positions.par_iter().map(along).collect();
        let (sides, edges): (Vec<Side>, Vec<[f32; 2]>) = caster
            .triangles
            .par_iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| points[i as usize].as_dvec3());
                let area = (b - a).truncate().perp_dot((c - a).truncate());
                let side = match area {
                    _ if area > 0.0 => Side::ToSun,
                    _ if area < 0.0 => Side::Away,
                    _ => Side::Neither,
                };
                let [a, b, c] = t.map(|i| points[i as usize]);
                let longest = (b - a).length().max((c - b).length()).max((a - c).length());
                let normal = (b - a).cross(c - a);
                let high = normal.z.abs() > 1.01 * TERMINATOR * normal.length();
                (side, [longest, if high { 0.0 } else { longest }])
            })
            .unzip();
        let used = caster.triangles.iter().flatten().map(|&i| points[i as usize]);
        let bounds = Aabb::of(used.filter(|p| p.is_finite()));
        let most = |a: [f32; 2], b: [f32; 2]| [a[0].max(b[0]), a[1].max(b[1])];
        let [longest, steep] = edges.into_iter().fold([0.0; 2], most);
        Self {
            caster: *caster,
            points,
            sides,
            min: bounds.min,
            max: bounds.max,
            longest,
            reach: NEIGHBORHOOD * steep,
        }
    }
}

/// Of one object over a texel.
#[derive(Clone, Copy)]
pub(super) struct Layer {
    top: f32,
    face: f32,
    /// Nothing that casts is below; -∞ where its outline passes.
    low: f32,
}

const NO_LAYER: Layer =
    Layer { top: f32::NEG_INFINITY, face: f32::NEG_INFINITY, low: f32::INFINITY };

/// Some rows of the map.
pub(super) struct Strip<'a> {
    pub(super) map: &'a SunMap,
    pub(super) first: usize,
    pub(super) rows: usize,
    /// In texels.
    pub(super) margin: f32,
}

/// Texels from the first to before the second, in x and y.
type Window = [[usize; 2]; 2];

impl Strip<'_> {
    /// Adds an object to the strip's texels.
    pub(super) fn add(&self, object: &Placed, layer: &mut Vec<Layer>, rows: &mut [Texel]) {
        let [min, max] = [object.min, object.max].map(|p| self.place(p));
        // One for all its triangles: what they are grown by must not reach beyond a grown outline.
        let growth = self.margin + GROWTH * object.longest / self.map.unit;
        let window = self.window(min, max, 2.0 * growth);
        let [[left, right], [low, high]] = window;
        if left >= right || low >= high {
            return;
        }
        layer.clear();
        layer.resize((right - left) * (high - low), NO_LAYER);
        for (triangle, side) in object.caster.triangles.iter().zip(&object.sides) {
            let corners = triangle.map(|i| self.place(object.points[i as usize]));
            let face = object.caster.closed && *side == Side::ToSun;
            self.draw(corners, growth, window, |at, lowest, highest| {
                let texel = &mut layer[at];
                if face {
                    texel.face = texel.face.max(highest);
                } else {
                    texel.top = texel.top.max(highest);
                    texel.low = texel.low.min(lowest);
                }
            });
        }
        for edge in object.caster.edges {
            let side = |t: u32| object.sides.get(t as usize).copied().unwrap_or(Side::Neither);
            let [one, other] = edge.triangles.map(side);
            if one != other || one == Side::Neither {
                let [a, b] = edge.vertices.map(|i| self.place(object.points[i as usize]));
                self.draw([a, b, b], 2.0 * growth, window, |at, _, _| {
                    layer[at].low = f32::NEG_INFINITY
                });
            }
        }
        let width = right - left;
        for (own, y) in layer.chunks(width).zip(low..) {
            let start = (y - self.first) * self.map.size[0] + left;
            for (texel, own) in rows[start..start + width].iter_mut().zip(own) {
                texel.top = texel.top.max(own.top);
                texel.face = texel.face.max(own.face);
                if own.low < f32::INFINITY {
                    texel.cover = texel.cover.max(own.low);
                    texel.far_cover = texel.far_cover.max(own.low - object.reach);
                }
            }
        }
    }

    /// From scene units to texels.
    fn place(&self, p: Vec3) -> Vec3 {
        let [x, y] = self.map.offset;
        let per = 1.0 / self.map.unit;
        Vec3::new(p.x * per + x, p.y * per + y, p.z)
    }

    /// The texels of the strip that a box touches.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    fn window(&self, min: Vec3, max: Vec3, growth: f32) -> Window {
        let range = |lo: f32, hi: f32, first: usize, end: usize| {
            let from = ((lo - growth).max(0.0) as usize).max(first);
            let to = (((hi + growth).max(-1.0) + 1.0) as usize).min(end);
            [from, to]
        };
        let [width, _] = self.map.size;
        [range(min.x, max.x, 0, width), range(min.y, max.y, self.first, self.first + self.rows)]
    }

    /// Calls `texel` with the index within `window` and the lowest and highest height for every texel that the grown
    /// triangle touches, and for few others.
    #[inline(always)]
    fn draw(
        &self,
        [a, b, c]: [Vec3; 3],
        growth: f32,
        window: Window,
        mut texel: impl FnMut(usize, f32, f32),
    ) {
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        let extent = (max - min).truncate().max_element();
        let [[left, right], [low, high]] = self.window(min, max, growth);
        let [[first, _], [bottom, _]] = window;
        if !(extent.is_finite() && min.z.is_finite() && max.z.is_finite()) {
            return;
        }
        let width = window[0][1] - first;
        let one = |lo: f32, hi: f32| (lo - growth).floor() == (hi + growth).floor();
        // The texels of its box are those that it touches if they are in one line.
        if one(min.x, max.x) || one(min.y, max.y) {
            for y in low..high {
                for x in left..right {
                    texel((y - bottom) * width + x - first, min.z, max.z);
                }
            }
            return;
        }
        let plane = Plane::new([a, b, c], growth);
        for y in low..high {
            let [from, to] = row_extent([a, b, c], y as f32 - growth, (y + 1) as f32 + growth);
            let reach = [Vec3::new(from, min.y, 0.0), Vec3::new(to, max.y, 0.0)];
            let [[from, to], _] = self.window(reach[0], reach[1], growth);
            for x in from.max(left)..to.min(right) {
                let [lowest, highest] = plane.over(x as f32 + 0.5, y as f32 + 0.5);
                let (lowest, highest) = (lowest.max(min.z), highest.min(max.z));
                texel((y - bottom) * width + x - first, lowest, highest);
            }
        }
    }
}

/// Lowest and highest x of the part of a triangle between two y.
fn row_extent(corners: [Vec3; 3], from: f32, to: f32) -> [f32; 2] {
    let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        if a.y >= from && a.y <= to {
            (least, most) = (least.min(a.x), most.max(a.x));
        }
        for y in [from, to] {
            if (a.y < y) != (b.y < y) {
                let x = a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y));
                (least, most) = (least.min(x), most.max(x));
            }
        }
    }
    [least, most]
}

/// Heights of a triangle's plane.
struct Plane {
    at: Vec3,
    slope: [f32; 2],
    /// By how much they differ within a texel from its middle.
    half: f32,
}

impl Plane {
    #[expect(clippy::cast_possible_truncation, reason = "heights are f32")]
    fn new([a, b, c]: [Vec3; 3], growth: f32) -> Self {
        let (ab, ac) = ((b - a).as_dvec3(), (c - a).as_dvec3());
        let per_area = 1.0 / ab.truncate().perp_dot(ac.truncate());
        let slope = [
            ((ab.z * ac.y - ac.z * ab.y) * per_area) as f32,
            ((ac.z * ab.x - ab.z * ac.x) * per_area) as f32,
        ];
        // Rounding of the heights grows with the slope, too.
        let half = (slope[0].abs() + slope[1].abs()) * (0.5 + growth + 1e-3);
        Self { at: a, slope, half }
    }

    fn over(&self, x: f32, y: f32) -> [f32; 2] {
        let middle = self.at.z + self.slope[0] * (x - self.at.x) + self.slope[1] * (y - self.at.y);
        if middle.is_finite() && self.half.is_finite() {
            [middle - self.half, middle + self.half]
        } else {
            [f32::NEG_INFINITY, f32::INFINITY]
        }
    }
}
