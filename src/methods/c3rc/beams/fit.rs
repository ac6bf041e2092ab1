//! What describes a beam's rays as a whole: ranges by group, and how steps from pixel to pixel change.

use fearless_simd::{Simd, f32x16};
use glam::{Mat3, Vec3};

use super::beam::{Beam, COLUMNS, ROWS, Rays};
use super::block::{GROUP, GROUPS, LANES, SIDE};
use crate::geometry::lanes::{Real, Vector};

/// How a beam's steps change from pixel to pixel: by axis, xx, xy, yy.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bend {
    pub(super) start: [[f32; 3]; 2],
    pub(super) slope: [[f32; 3]; 2],
    /// Least and most pixel from the beam's first one on: columns, rows.
    pub(super) pixels: [[f32; 2]; 2],
}

/// Against pixels to the fourth (untuned).
const STIFF: f32 = 30.0;

/// Least and most of the groups' starts and slopes: by axis and end, a lane a group. One without pixels has none.
#[derive(Clone, Debug)]
pub(super) struct Ranges {
    pub(super) starts: [[[f32; GROUPS]; 2]; 2],
    pub(super) slopes: [[[f32; GROUPS]; 2]; 2],
}

type F<S> = f32x16<S>;

impl Beam {
    /// What bounds each group's rays.
    #[inline(always)]
    pub(super) fn ranges<S: Simd>(&self, simd: S) -> Ranges {
        let mut ranges = Ranges {
            starts: [[[f32::MAX; GROUPS], [-f32::MAX; GROUPS]]; 2],
            slopes: [[[0.0; GROUPS]; 2]; 2],
        };
        let far = F::<S>::broadcast(simd, f32::MAX);
        for group in 0..GROUPS {
            if self.pixels[group] == 0 {
                continue;
            }
            let own = F::<S>::mask(simd, u64::from(self.pixels[group]));
            for k in 0..2 {
                let start = F::<S>::load(simd, &self.rays[group].start[k]);
                let slope = F::<S>::load(simd, &self.rays[group].slope[k]);
                ranges.starts[k][0][group] = F::<S>::select(own, start, far).least();
                ranges.starts[k][1][group] = F::<S>::select(own, start, -far).most();
                ranges.slopes[k][0][group] = F::<S>::select(own, slope, far).least();
                ranges.slopes[k][1][group] = F::<S>::select(own, slope, -far).most();
            }
        }
        ranges
    }

    /// Second derivatives by pixel of starts and slopes, as all its rays have them in the mean.
    #[inline(always)]
    pub(super) fn bend<S: Simd>(&self, simd: S) -> Bend {
        let zero = F::<S>::broadcast(simd, 0.0);
        let mut squares = [[zero; 3]; 3];
        let mut sums = [[zero; 3]; 4];
        let mut ends = [[zero; 2]; 2];
        for group in (0..GROUPS).filter(|group| self.pixels[*group] != 0) {
            let own = F::<S>::mask(simd, u64::from(self.pixels[group]));
            let [x, y] = [group % SIDE * GROUP, group / SIDE * GROUP];
            let dx = F::<S>::load(simd, &COLUMNS) + (x as f32 - self.at[0]);
            let dy = F::<S>::load(simd, &ROWS) + (y as f32 - self.at[1]);
            let (ox, oy) = (F::<S>::select(own, dx, zero), F::<S>::select(own, dy, zero));
            ends = [
                [ends[0][0].min(ox), ends[0][1].max(ox)],
                [ends[1][0].min(oy), ends[1][1].max(oy)],
            ];
            let by = [dx * dx * 0.5, dx * dy, dy * dy * 0.5];
            let by = [
                F::<S>::select(own, by[0], zero),
                F::<S>::select(own, by[1], zero),
                F::<S>::select(own, by[2], zero),
            ];
            for i in 0..3 {
                for j in i..3 {
                    squares[i][j] += by[i] * by[j];
                }
            }
            let Rays { start, slope, .. } = &self.rays[group];
            for k in 0..2 {
                let of = |list: &[f32; LANES], [x, y]: [f32; 2]| {
                    F::<S>::load(simd, list) - dx * x - dy * y
                };
                let start = of(&start[k], self.step[k]);
                let slope = of(&slope[k], self.step_per_s[k]);
                for i in 0..3 {
                    sums[k][i] += start * by[i];
                    sums[2 + k][i] += slope * by[i];
                }
            }
        }
        let mut normal = [[0.0f32; 3]; 3];
        for i in 0..3 {
            for j in i..3 {
                normal[i][j] = sum::<S>(squares[i][j]);
                normal[j][i] = normal[i][j];
            }
            // A few pixels bend nothing.
            normal[i][i] += STIFF;
        }
        let inverse = Mat3::from_cols_array_2d(&normal).inverse();
        let solve = |sums: [F<S>; 3]| {
            let right = Vec3::new(sum::<S>(sums[0]), sum::<S>(sums[1]), sum::<S>(sums[2]));
            (inverse * right).to_array()
        };
        Bend {
            start: [solve(sums[0]), solve(sums[1])],
            slope: [solve(sums[2]), solve(sums[3])],
            pixels: [
                [ends[0][0].least(), ends[0][1].most()],
                [ends[1][0].least(), ends[1][1].most()],
            ],
        }
    }
}

/// All lanes together.
#[inline(always)]
fn sum<S: Simd>(values: F<S>) -> f32 {
    let mut list = [0.0f32; LANES];
    Vector::<S>::store(values, &mut list);
    let mut half = LANES / 2;
    while half > 0 {
        for i in 0..half {
            list[i] += list[i + half];
        }
        half /= 2;
    }
    list[0]
}
