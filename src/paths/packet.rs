//! Points of a group in lanes: which of them may have an image in a camera.

use fearless_simd::{Level, Simd, SimdBase, SimdMask, dispatch, f64x8};
use glam::DVec3;

use super::TIE;
use super::cameras::Camera;
use crate::geometry::lanes::Real;

/// Points looked up at once.
const LANES: usize = 8;

/// Positions by coordinate, as many as fill whole vectors.
pub(super) struct Packet {
    xyz: [Vec<f64>; 3],
    len: usize,
}

impl Packet {
    /// Of at least one point.
    pub(super) fn new(points: &[DVec3]) -> Self {
        let filled = points.len().next_multiple_of(LANES);
        let xyz = [0, 1, 2].map(|k| {
            let mut list: Vec<f64> = points.iter().map(|p| p[k]).collect();
            list.resize(filled, points[points.len() - 1][k]);
            list
        });
        Self { xyz, len: points.len() }
    }

    /// Hands the index of each point that may have an image in `camera` to `visit`: of those that have one, none is left out.
    /// With it comes the λ that is the only one possible, if that is known.
    pub(super) fn visit(
        &self,
        level: Level,
        camera: &Camera,
        visit: &mut impl FnMut(usize, Option<f64>),
    ) {
        if camera.three_ray.wide {
            // λ has no bound: too few to be worth lanes.
            (0..self.len).for_each(|slot| visit(slot, None));
        } else {
            dispatch!(level, simd => self.visit_in_lanes(simd, camera, visit));
        }
    }

    /// The same arithmetic as [`Camera::images`], to the bit, where there is one root.
    #[inline(always)]
    fn visit_in_lanes<S: Simd>(
        &self,
        simd: S,
        camera: &Camera,
        visit: &mut impl FnMut(usize, Option<f64>),
    ) {
        let three_ray = &camera.three_ray;
        let [v1_x, v1_y, v1_z] = three_ray.v1;
        let [all_x, all_y, all_z] = &self.xyz;
        for first in (0..self.len).step_by(LANES) {
            let range = first..first + LANES;
            let q = [
                f64x8::from_slice(simd, &all_x[range.clone()]) - v1_x,
                f64x8::from_slice(simd, &all_y[range.clone()]) - v1_y,
                f64x8::from_slice(simd, &all_z[range]) - v1_z,
            ];
            let zero = q[0].splat(0.0);
            let (lo, hi) = three_ray.bracket(q, zero, q[0].splat(f64::INFINITY));
            let open = lo.le(hi);
            if !open.any_true() {
                continue;
            }
            let cubic = three_ray.cubic(q);
            let several = cubic.bends(lo, hi) & open;
            let (lambda, found) = cubic.monotone_root(lo, hi, true);
            let image = three_ray.image_at(q, lambda, found);
            let several_bits = several.to_bitmask();
            let mut bits = (image.within([2.0 * TIE; 3]) | several).to_bitmask();
            if bits == 0 {
                continue;
            }
            let mut lambdas = [0.0; LANES];
            lambda.store_slice(&mut lambdas);
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                if first + lane < self.len {
                    let only = (several_bits >> lane & 1 == 0).then_some(lambdas[lane]);
                    visit(first + lane, only);
                }
            }
        }
    }
}
