//! Cube maps: a function of the direction, kept as six faces of texels.

use glam::Vec3;
use rayon::prelude::*;

/// Of each face: where it looks, where its columns go, where its rows go.
pub const FACES: [[Vec3; 3]; 6] = [
    [Vec3::X, Vec3::NEG_Z, Vec3::NEG_Y],
    [Vec3::NEG_X, Vec3::Z, Vec3::NEG_Y],
    [Vec3::Y, Vec3::X, Vec3::Z],
    [Vec3::NEG_Y, Vec3::X, Vec3::NEG_Z],
    [Vec3::Z, Vec3::X, Vec3::NEG_Y],
    [Vec3::NEG_Z, Vec3::NEG_X, Vec3::NEG_Y],
];

/// `N` numbers by direction. Each face has a border of one texel from beyond its edges, so that four neighbours are
/// always of one face and nothing is cut off between faces.
#[derive(Clone, Debug, PartialEq)]
pub struct CubeMap<const N: usize> {
    side: u32,
    /// Face by face, row by row, `side` + 2 a row.
    pub texels: Vec<[f32; N]>,
}

/// Unit directions of the texels of a map with `side` texels a side, in their order.
pub fn directions(side: u32) -> Vec<Vec3> {
    let along = |k: u32| (k as f32 - 0.5) * 2.0 / side as f32 - 1.0;
    let row = side + 2;
    (0..6 * row * row)
        .into_par_iter()
        .map(|texel| {
            let [face, columns, rows] = FACES[(texel / (row * row)) as usize];
            let (i, j) = (texel % row, texel / row % row);
            (face + columns * along(i) + rows * along(j)).normalize_or(face)
        })
        .collect()
}

/// Where a direction falls: the first of the four texels around it, and its place between them.
#[derive(Clone, Copy, Debug)]
struct Place {
    first: usize,
    between: [f32; 2],
}

impl<const N: usize> CubeMap<N> {
    /// A map of these texels, in the order of [`directions`].
    ///
    /// # Panics
    /// If their number is another one.
    pub fn new(side: u32, texels: Vec<[f32; N]>) -> Self {
        let row = side as usize + 2;
        assert_eq!(texels.len(), 6 * row * row, "texels of a cube map of side {side}");
        Self { side, texels }
    }

    /// Texels a side, without the border.
    pub fn side(&self) -> u32 {
        self.side
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    #[inline(always)]
    fn place(&self, direction: Vec3) -> Place {
        let size = direction.abs();
        let face = if size.x >= size.y && size.x >= size.z {
            usize::from(direction.x < 0.0)
        } else if size.y >= size.z {
            2 + usize::from(direction.y < 0.0)
        } else {
            4 + usize::from(direction.z < 0.0)
        };
        let [front, columns, rows] = FACES[face];
        let (depth, side) = (direction.dot(front), self.side as f32);
        let along = |axis: Vec3| (direction.dot(axis) / depth + 1.0) * 0.5 * side + 0.5;
        let (x, y) = (along(columns), along(rows));
        let (i, j) = (x.floor().clamp(0.0, side), y.floor().clamp(0.0, side));
        let row = self.side as usize + 2;
        Place { first: (face * row + j as usize) * row + i as usize, between: [x - i, y - j] }
    }

    /// The texel nearest to a direction of any length.
    pub fn nearest(&self, direction: Vec3) -> usize {
        let Place { first, between: [x, y] } = self.place(direction);
        first + usize::from(x >= 0.5) + usize::from(y >= 0.5) * (self.side as usize + 2)
    }

    /// The values in a direction of any length, between four texels.
    #[inline(always)]
    pub fn at(&self, direction: Vec3) -> [f32; N] {
        let Place { first, between: [x, y] } = self.place(direction);
        let row = self.side as usize + 2;
        let (above, below) = (&self.texels[first..], &self.texels[first + row..]);
        std::array::from_fn(|k| {
            let upper = above[0][k] + (above[1][k] - above[0][k]) * x;
            let lower = below[0][k] + (below[1][k] - below[0][k]) * x;
            upper + (lower - upper) * y
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texel_is_what_its_direction_reads() {
        for side in [1, 5, 32] {
            let directions = directions(side);
            let numbers = (0..directions.len()).map(|k| [k as f32]).collect();
            let map = CubeMap::<1>::new(side, numbers);
            let row = side as usize + 2;
            for (k, direction) in directions.iter().enumerate() {
                let (i, j) = (k % row, k / row % row);
                let border = [i, j].iter().any(|&at| at == 0 || at == row - 1);
                if !border {
                    let read = map.at(*direction * 3.0)[0];
                    assert!((read - k as f32).abs() < 0.05, "{read} instead of {k}");
                }
            }
        }
    }

    #[test]
    fn what_is_smooth_stays_smooth_across_faces() {
        let side = 64;
        let texels = directions(side).iter().map(|d| [d.x * d.y, d.z]).collect();
        let map = CubeMap::<2>::new(side, texels);
        for k in 0..20_000 {
            let turn = k as f32 * 0.37;
            let d = Vec3::new(turn.cos(), (turn * 0.7).sin(), (turn * 1.3).cos());
            let d = d.normalize_or(Vec3::X);
            let [xy, z] = map.at(d);
            assert!((xy - d.x * d.y).abs() < 6e-4 && (z - d.z).abs() < 6e-4, "{d}");
        }
    }
}
