//! What a surfel looks like, packed.

use fearless_simd::Simd;
use glam::{Vec2, Vec3};

use super::lanes::Vector;

/// Normal and radiance of a surfel in three words: nearly every surfel that is drawn is read from memory, not from a cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// See [`packed_normal`].
    pub normal: u32,
    /// Three numbers that are not negative, the upper 21 of their 31 bits each.
    radiance: [u32; 2],
}

impl Look {
    /// What is negative in `radiance` becomes 0.
    pub fn new(normal: Vec3, radiance: Vec3) -> Self {
        let [r, g, b] = radiance.to_array().map(|v| {
            let bits = v.max(0.0).to_bits();
            // To the nearest; the largest numbers stay numbers.
            u64::from((bits + (1 << 9)).min(f32::MAX.to_bits()) >> 10)
        });
        let all = r | g << 21 | b << 42;
        #[expect(clippy::cast_possible_truncation, reason = "by halves")]
        let radiance = [all as u32, (all >> 32) as u32];
        Self { normal: packed_normal(normal), radiance }
    }

    /// Linear RGB, each off by 2^-14 of itself at most.
    #[inline(always)]
    pub fn radiance(self) -> [f32; 3] {
        let all = u64::from(self.radiance[0]) | u64::from(self.radiance[1]) << 32;
        #[expect(clippy::cast_possible_truncation, reason = "21 bits")]
        [0, 21, 42].map(|shift| f32::from_bits(((all >> shift) as u32 & 0x1f_ffff) << 10))
    }
}

/// A unit vector as a place on the unfolded octahedron (Cigolle et al. 2014, "oct32").
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "16 bits")]
pub fn packed_normal(n: Vec3) -> u32 {
    let sum = n.abs().element_sum();
    if sum.is_nan() || sum <= 0.0 {
        return 0;
    }
    let p = Vec2::new(n.x, n.y) / sum;
    let folded = if n.z < 0.0 {
        let sign = |v: f32| if v >= 0.0 { 1.0 } else { -1.0 };
        Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    } else {
        p
    };
    let half = |v: f32| u32::from((v.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    half(folded.x) | half(folded.y) << 16
}

/// What [`packed_normal`] packed, by coordinate and lane.
#[inline(always)]
pub(crate) fn unpacked_normals<S: Simd, V: Vector<S>>(simd: S, packed: &[u32]) -> [V; 3] {
    let [x, y] = V::halves(simd, packed);
    let (zero, one) = (x.splat(0.0), x.splat(1.0));
    let z = one - x.abs() - y.abs();
    let fold = (-z).max(zero);
    let x = x - V::select(x.lt(zero), -fold, fold);
    let y = y - V::select(y.lt(zero), -fold, fold);
    let per_length = one / (x * x + y * y + z * z).sqrt();
    [x * per_length, y * per_length, z * per_length]
}

#[cfg(test)]
mod tests {
    use fearless_simd::{dispatch, f32x16};

    use super::*;
    use crate::geometry::lanes::simd_level;

    #[test]
    fn looks_are_kept() {
        let mut most = 0.0f32;
        for turn in 0..200u16 {
            let normals: [Vec3; 16] = std::array::from_fn(|i| match i {
                0..6 => Vec3::AXES[i % 3] * if i < 3 { 1.0 } else { -1.0 },
                // All over the sphere.
                _ => {
                    let n = f32::from(turn) * 10.0 + i as f32 - 6.0;
                    let (z, angle) = (n / 1000.0 - 1.0, n * 2.399_963);
                    let r = (1.0 - z * z).max(0.0).sqrt();
                    Vec3::new(r * angle.cos(), r * angle.sin(), z)
                }
            });
            let packed = normals.map(packed_normal);
            let mut lists = [[0.0f32; 16]; 3];
            dispatch!(simd_level(), simd => {
                let unpacked: [f32x16<_>; 3] = unpacked_normals(simd, &packed);
                for k in 0..3 {
                    Vector::store(unpacked[k], &mut lists[k]);
                }
            });
            for (i, n) in normals.iter().enumerate() {
                most = most.max(n.distance(Vec3::new(lists[0][i], lists[1][i], lists[2][i])));
            }
        }
        assert!(most < 1e-4, "{most}");
        for v in [0.0, 1e-30, 0.003, 0.5, 1.0, 7.3, 1e5, 3e38] {
            let [r, g, b] = Look::new(Vec3::Y, Vec3::new(v, 0.25, -1.0)).radiance();
            assert!((r - v).abs() <= v * 6.2e-5 && g == 0.25 && b == 0.0, "{v}: {r} {g} {b}");
        }
        assert!(Look::new(Vec3::Y, Vec3::MAX).radiance()[0].is_finite());
    }
}
