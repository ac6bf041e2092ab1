//! Points along a Morton curve, so that neighbours in space are neighbours in memory, and each place once.

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use super::gather::Points;
use crate::scene::sample::index;

/// Bits of a coordinate in a code.
const BITS: u32 = 21;
/// Codes have so many bits.
pub(super) const CODE_BITS: u32 = 3 * BITS;

/// Sorts points along the curve and drops those that are exactly where another one is; the first of the file stays. Returns
/// how many were dropped.
pub(super) fn sort_and_dedupe(points: &mut Points) -> usize {
    let codes = codes(&points.positions);
    let mut order: Vec<(u64, u32)> = codes.into_par_iter().zip(0..index(points.len())).collect();
    order.par_sort_unstable();
    let same_code = |a: &(u64, u32), b: &(u64, u32)| a.0 == b.0;
    let bits = |i: u32| points.positions[i as usize].to_array().map(f32::to_bits);
    // Those of one code are few as a rule.
    order.par_chunk_by_mut(same_code).for_each(|run| {
        if run.len() > 1 {
            run.sort_unstable_by_key(|&(_, i)| (bits(i), i));
        }
    });
    let mut kept: Vec<u32> = order.into_par_iter().map(|(_, i)| i).collect();
    let before = kept.len();
    kept.dedup_by_key(|i| bits(*i));
    points.pick(&kept);
    before - kept.len()
}

/// Morton codes in the cube around all points (Morton 1966): 63 bits, x highest.
pub(super) fn codes(positions: &[Vec3]) -> Vec<u64> {
    let none = || (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let corners = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
    let (low, high) = positions.par_iter().map(|&p| (p, p)).reduce(none, corners);
    let size = (high - low).max_element();
    let per_unit = if size > 0.0 { (1 << BITS) as f32 / size } else { 0.0 };
    let per_unit = if per_unit.is_finite() { per_unit } else { 0.0 };
    let last = UVec3::splat((1 << BITS) - 1);
    let code = |&p: &Vec3| {
        let cell = ((p - low) * per_unit).as_uvec3().min(last);
        spread(cell.x) << 2 | spread(cell.y) << 1 | spread(cell.z)
    };
    positions.par_iter().map(code).collect()
}

/// Puts two zeros between each two of the 21 lowest bits.
fn spread(v: u32) -> u64 {
    let mut v = u64::from(v);
    v = (v | v << 32) & 0x001f_0000_0000_ffff;
    v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}
