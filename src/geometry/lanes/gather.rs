//! Tables read lane by lane.

use fearless_simd::{ExtractToken, Simd, SimdBase, f32x16};

use super::Real;

/// Lanes of f32 that can be looked up in a table.
pub trait Gather: Real<Scalar = f32> {
    /// What `row` says of each lane's number: `N` numbers, each of which becomes lanes.
    fn gather<const N: usize>(self, row: impl Fn(f32) -> [f32; N]) -> [Self; N];
}

impl Gather for f32 {
    #[inline(always)]
    fn gather<const N: usize>(self, row: impl Fn(f32) -> [f32; N]) -> [Self; N] {
        row(self)
    }
}

impl<S: Simd> Gather for f32x16<S> {
    #[inline(always)]
    fn gather<const N: usize>(self, row: impl Fn(f32) -> [f32; N]) -> [Self; N] {
        let mut columns = [[0.0; 16]; N];
        for (lane, number) in self.as_slice().iter().enumerate() {
            for (column, value) in columns.iter_mut().zip(row(*number)) {
                column[lane] = value;
            }
        }
        let mut found = [self; N];
        for (lanes, column) in found.iter_mut().zip(&columns) {
            *lanes = Self::from_slice(self.token(), column);
        }
        found
    }
}
