//! A beam: the rays of some pixels of a block, each exactly, and what bounds them.

use fearless_simd::{Simd, f32x16};
use glam::{DMat3, DVec2, DVec3, Mat3, Vec3};

use super::block::{Block, GROUP, GROUPS, LANES, SIDE};
use crate::camera::Eye;
use crate::geometry::Similarity;
use crate::geometry::lanes::{Real, Vector, dot_const};
use crate::plan::LARGEST_ELLIPSE;
use crate::visibility::mirror_rays::{Linear, RayField, TILE};

/// Rays belong to one beam if the linear function that describes its first one's neighbourhood is no farther off than this, in
/// pixels (untuned).
const ALIKE_PX: f32 = 2.0;
/// Rays of one beam start so many pixels' steps from its first one at most (untuned).
const NEAR_PX: f32 = 60.0;
/// The least cosine of a ray's angle with the beam's axis.
const AHEAD: f32 = 0.6;

/// Rays in the beam's own frame: axes u, v and, along its first ray, a. At the distance s along a, the ray of a pixel crosses the plane
/// (u, v) at start + s · slope.
#[derive(Clone, Debug)]
pub(super) struct Beam {
    /// Where the first ray starts, and the axes; scene space.
    pub(super) origin: Vec3,
    pub(super) axes: [Vec3; 3],
    /// The mirror triangle of the first ray.
    pub(super) triangle: u32,
    /// By group: bit i: pixel i of the group is the beam's.
    pub(super) pixels: [u32; GROUPS],
    /// By group; any numbers in one without pixels.
    pub(super) rays: [Rays; GROUPS],
    /// Where along the axis the first of all rays starts, and the last.
    pub(super) first: f32,
    pub(super) last: f32,
    /// Least and most of starts and slopes, by axis.
    pub(super) starts: [[f32; 2]; 2],
    pub(super) slopes: [[f32; 2]; 2],
    /// How a ray's place in the plane moves with its pixel, one to the right and one down: by axis, at s = 0 and by s.
    pub(super) step: [[f32; 2]; 2],
    pub(super) step_per_s: [[f32; 2]; 2],
    /// The first ray's pixel, from the block's first column and row on.
    pub(super) at: [f32; 2],
    /// Length of the first ray's direction: its λ is s by this.
    pub(super) length: f32,
    /// Tangent of the widest angle of a ray with the axis.
    pub(super) spread: f32,
}

/// Of a group's pixels, by lane.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rays {
    /// By axis.
    pub(super) start: [[f32; LANES]; 2],
    /// By axis.
    pub(super) slope: [[f32; LANES]; 2],
    /// Where along the axis each ray starts.
    pub(super) begin: [f32; LANES],
}

/// Relative to a beam's own space: what a cloud's space has for it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) origin: [f32; 3],
    pub(super) axes: [[f32; 3]; 3],
    /// Cloud units a scene unit.
    pub(super) per_scene: f32,
}

impl Beam {
    pub(super) fn empty() -> Self {
        Self {
            origin: Vec3::ZERO,
            axes: [Vec3::X, Vec3::Y, Vec3::Z],
            triangle: 0,
            pixels: [0; GROUPS],
            rays: [Rays::default(); GROUPS],
            first: 0.0,
            last: 0.0,
            starts: [[0.0; 2]; 2],
            slopes: [[0.0; 2]; 2],
            step: [[0.0; 2]; 2],
            step_per_s: [[0.0; 2]; 2],
            at: [0.0; 2],
            length: 0.0,
            spread: 0.0,
        }
    }

    /// Becomes the beam of a tile's pixel `at` and of those pixels that are left of its block and go on from it.
    #[inline(always)]
    pub(super) fn aim<S: Simd>(
        &mut self,
        simd: S,
        eye: &Eye,
        field: &RayField,
        tangent: &Linear<4>,
        block: &Block,
        at: [usize; 2],
    ) {
        let corner = block.corner;
        let [f0, f1, f2, q] = field.at(at);
        let toward = Vec3::new(f0, f1, f2);
        let length = toward.length();
        let axis = toward / length;
        let view = field.view_at(at);
        let origin = eye.position + view / q;
        let of = |l: &[f32; 4]| Vec3::new(l[0], l[1], l[2]);
        let turn = [of(&tangent.right) / length, of(&tangent.down) / length];
        let moved = field.view_steps();
        let shift = [
            (moved[0] - view * (tangent.right[3] / q)) / q,
            (moved[1] - view * (tangent.down[3] / q)) / q,
        ];
        // The axes lie along and across the direction in which rays part most.
        let (e1, e2) = axis.any_orthonormal_pair();
        let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
        for t in turn {
            let (a, b) = (e1.dot(t), e2.dot(t));
            (uu, uv, vv) = (uu + a * a, uv + a * b, vv + b * b);
        }
        let (cosine, sine) = half_angle(uu - vv, 2.0 * uv);
        let axes = [e1 * cosine + e2 * sine, e2 * cosine - e1 * sine, axis];
        let [u, v, a] = axes;
        let step = [u, v].map(|e| shift.map(|s| e.dot(s)));
        let step_per_s = [u, v].map(|e| turn.map(|t| e.dot(t)));
        let widths = step_per_s.map(|[x, y]| (x * x + y * y).sqrt() + 0.1 / eye.focal_px);
        let reach = NEAR_PX * (shift[0].length() + shift[1].length());
        (self.origin, self.axes) = (origin, axes);
        self.triangle = field.ids[at[1] * TILE + at[0]];
        (self.step, self.step_per_s, self.length) = (step, step_per_s, length / q);
        self.at = [(at[0] - corner[0]) as f32, (at[1] - corner[1]) as f32];
        let zero = F::<S>::broadcast(simd, 0.0);
        let one = zero.splat(1.0);
        let far = zero.splat(f32::MAX);
        let (mut widest, mut first, mut last) = (zero, far, -far);
        let mut lows = [[far; 2]; 2];
        let mut highs = [[-far; 2]; 2];
        let from = eye.position - origin;
        let [right, down] = moved;
        for (group, left) in block.left.into_iter().enumerate() {
            self.pixels[group] = 0;
            if left == 0 {
                continue;
            }
            // All rays of the group, a lane each.
            let corner = [corner[0] + group % SIDE * GROUP, corner[1] + group / SIDE * GROUP];
            let block = field.block(corner);
            let load = [
                F::<S>::load(simd, &block[0]),
                F::<S>::load(simd, &block[1]),
                F::<S>::load(simd, &block[2]),
            ];
            let own = F::<S>::mask(simd, u64::from(left));
            let along = dot_const(load, a.to_array());
            let squared = load[0] * load[0] + load[1] * load[1] + load[2] * load[2];
            // Lanes that are not among `left` hold anything.
            let ahead = own & zero.lt(along) & (squared * (AHEAD * AHEAD)).le(along * along);
            let per_along = one / F::<S>::select(ahead, along, one);
            let slope = [
                dot_const(load, u.to_array()) * per_along,
                dot_const(load, v.to_array()) * per_along,
            ];
            let depth = one / F::<S>::select(ahead, F::<S>::load(simd, &block[3]), one);
            let dx = F::<S>::load(simd, &COLUMNS) + (corner[0] as f32 - at[0] as f32);
            let dy = F::<S>::load(simd, &ROWS) + (corner[1] as f32 - at[1] as f32);
            let start_of = [
                (dx * right.x + dy * down.x + view.x) * depth + from.x,
                (dx * right.y + dy * down.y + view.y) * depth + from.y,
                (dx * right.z + dy * down.z + view.z) * depth + from.z,
            ];
            let before = dot_const(start_of, a.to_array());
            let start = [
                dot_const(start_of, u.to_array()) - slope[0] * before,
                dot_const(start_of, v.to_array()) - slope[1] * before,
            ];
            let off_u =
                (slope[0] - dx * step_per_s[0][0] - dy * step_per_s[0][1]) * (1.0 / widths[0]);
            let off_v =
                (slope[1] - dx * step_per_s[1][0] - dy * step_per_s[1][1]) * (1.0 / widths[1]);
            let apart =
                start_of[0] * start_of[0] + start_of[1] * start_of[1] + start_of[2] * start_of[2];
            let alike = ahead
                & (off_u * off_u + off_v * off_v).le(zero.splat(ALIKE_PX * ALIKE_PX))
                & apart.le(zero.splat(reach * reach));
            // The first ray is the axis itself.
            let is_first =
                at[0].wrapping_sub(corner[0]) < GROUP && at[1].wrapping_sub(corner[1]) < GROUP;
            let lane =
                if is_first { 1 << ((at[1] - corner[1]) * GROUP + at[0] - corner[0]) } else { 0 };
            let itself = F::<S>::mask(simd, lane);
            let alike = alike | itself;
            #[expect(clippy::cast_possible_truncation, reason = "sixteen bits")]
            let pixels = F::<S>::bits(alike) as u32;
            self.pixels[group] = pixels;
            if pixels == 0 {
                continue;
            }
            let rays = &mut self.rays[group];
            let none = itself | !alike;
            let mut angle = zero;
            for k in 0..2 {
                let start = F::<S>::select(none, zero, start[k]);
                let slope = F::<S>::select(none, zero, slope[k]);
                Vector::<S>::store(start, &mut rays.start[k]);
                Vector::<S>::store(slope, &mut rays.slope[k]);
                angle += slope * slope;
                // The axis is among them, so that zeros do not matter.
                lows[k] = [lows[k][0].min(start), lows[k][1].min(slope)];
                highs[k] = [highs[k][0].max(start), highs[k][1].max(slope)];
            }
            let before = F::<S>::select(none, zero, before);
            Vector::<S>::store(before, &mut rays.begin);
            (first, last) = (first.min(before), last.max(before));
            widest = widest.max(angle);
        }
        for k in 0..2 {
            self.starts[k] = [lows[k][0].least(), highs[k][0].most()];
            self.slopes[k] = [lows[k][1].least(), highs[k][1].most()];
        }
        self.first = first.least();
        self.last = last.most();
        self.spread = widest.most().sqrt();
    }

    /// The scene's place at u, v, s.
    pub(super) fn place(&self, [u, v, s]: [f32; 3]) -> Vec3 {
        self.origin + self.axes[0] * u + self.axes[1] * v + self.axes[2] * s
    }

    /// Its frame in a cloud's space.
    #[expect(clippy::cast_possible_truncation, reason = "rounded once")]
    pub(super) fn frame(&self, place: &Place) -> Frame {
        let origin = place.inverse * (self.origin.as_dvec3() - place.translation);
        Frame {
            origin: origin.to_array().map(|x| x as f32),
            axes: self.axes.map(|e| (place.turn * e).to_array()),
            per_scene: place.per_scene,
        }
    }
}

/// How far from the middle of a pixel (column and row of its tile) a place is seen, in pixels, and its λ there. `tangent`: of that
/// pixel. `None` if it is not seen near it.
pub(super) fn image_near(
    eye: &Eye,
    field: &RayField,
    tangent: &Linear<4>,
    px: [usize; 2],
    place: Vec3,
) -> Option<(DVec2, f64)> {
    let of = |l: &[f32; 4]| DVec3::new(l[0].into(), l[1].into(), l[2].into());
    let place = place.as_dvec3() - eye.position.as_dvec3();
    let view = field.view_at(px).as_dvec3();
    let [view_right, view_down] = field.view_steps().map(|v| v.as_dvec3());
    let [f0, f1, f2, q] = field.at(px);
    let (f, q) = (DVec3::new(f0.into(), f1.into(), f2.into()), f64::from(q));
    let (right, down) = (of(&tangent.right), of(&tangent.down));
    let (q_right, q_down) = (f64::from(tangent.right[3]), f64::from(tangent.down[3]));
    // q place = view + λ f, all linear over the picture.
    let mut off = DVec2::ZERO;
    let mut lambda = f.dot(place * q - view) / f.length_squared();
    for _ in 0..IMAGE_STEPS {
        let ray = f + right * off.x + down * off.y;
        let rest = place * (q + q_right * off.x + q_down * off.y)
            - (view + view_right * off.x + view_down * off.y)
            - ray * lambda;
        let slopes = DMat3::from_cols(
            place * q_right - view_right - right * lambda,
            place * q_down - view_down - down * lambda,
            -ray,
        );
        let step = slopes.inverse() * -rest;
        off += step.truncate();
        lambda += step.z;
    }
    // A splat does not reach farther.
    let near = off.abs().max_element() <= f64::from(LARGEST_ELLIPSE);
    (near && lambda.is_finite()).then_some((off, lambda))
}

/// Newton's steps, from a pixel or two away.
const IMAGE_STEPS: usize = 4;

/// From the scene to a cloud's space.
pub(super) struct Place {
    /// Of positions relative to `translation`.
    inverse: DMat3,
    translation: DVec3,
    /// Of directions.
    turn: Mat3,
    per_scene: f32,
}

impl Place {
    #[expect(clippy::cast_possible_truncation, reason = "rounded once")]
    pub(super) fn new(to_scene: &Similarity) -> Self {
        let back = DMat3::from_quat(to_scene.rotation.conjugate());
        Self {
            inverse: back * (1.0 / to_scene.scale),
            translation: to_scene.translation,
            turn: back.as_mat3(),
            per_scene: (1.0 / to_scene.scale) as f32,
        }
    }
}

type F<S> = f32x16<S>;

/// By lane.
pub(super) const COLUMNS: [f32; LANES] =
    [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0];
pub(super) const ROWS: [f32; LANES] =
    [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0];

/// Cosine and sine of half the angle of a direction; of none for no direction.
fn half_angle(x: f32, y: f32) -> (f32, f32) {
    let length = (x * x + y * y).sqrt();
    if length <= 0.0 || !length.is_finite() {
        return (1.0, 0.0);
    }
    let double = x / length;
    if double >= 0.0 {
        let cosine = (0.5 + 0.5 * double).sqrt();
        (cosine, 0.5 * y / length / cosine)
    } else {
        let sine = (0.5 - 0.5 * double).sqrt();
        (0.5 * y / length / sine, sine)
    }
}
