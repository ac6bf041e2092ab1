//! Which triangles of a mesh meet at which edge.

use rayon::prelude::*;

use super::Mesh;

/// An edge and the triangles beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SharedEdge {
    /// Vertex indices: the first of the vertices at their places.
    pub vertices: [u32; 2],
    /// Triangle indices; [`u32::MAX`] where there is none, and both of them if there are more than two.
    pub triangles: [u32; 2],
}

impl Mesh {
    /// For each vertex the first one at its place: they have one name, wherever a mesh was cut to have two normals there.
    pub(super) fn places(&self) -> Vec<u32> {
        let mut places: Vec<([u32; 3], u32)> = self
            .positions()
            .par_iter()
            .enumerate()
            // -0 is 0.
            .map(|(i, p)| {
                (p.to_array().map(|x| (x + 0.0).to_bits()), u32::try_from(i).unwrap_or(u32::MAX))
            })
            .collect();
        places.par_sort_unstable();
        let mut name = vec![0; places.len()];
        for same in places.chunk_by(|a, b| a.0 == b.0) {
            for (_, i) in same {
                name[*i as usize] = same[0].1;
            }
        }
        name
    }

    /// All edges, each once.
    pub fn shared_edges(&self) -> Vec<SharedEdge> {
        let name = self.places();
        let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * self.triangles().len());
        for (triangle, corners) in (0..).zip(self.triangles()) {
            let [a, b, c] = corners.map(|i| name[i as usize]);
            for [from, to] in [[a, b], [b, c], [c, a]] {
                sides.push(([from.min(to), from.max(to)], triangle));
            }
        }
        sides.par_sort_unstable();
        sides
            .chunk_by(|a, b| a.0 == b.0)
            .map(|same| {
                let triangles = match same {
                    [one, other] => [one.1, other.1],
                    _ => [u32::MAX; 2],
                };
                SharedEdge { vertices: same[0].0, triangles }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_fold_has_one_edge_with_two_triangles() {
        // The second triangle has its own copies of the common corners.
        let [a, b, c, d] = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE];
        let positions = vec![a, b, c, c, b, d];
        let mesh =
            Mesh::new(positions, vec![], vec![], vec![[0, 1, 2], [3, 4, 5]]).expect("a mesh");
        let edges = mesh.shared_edges();
        let shared: Vec<_> = edges.iter().filter(|e| e.triangles[0] != u32::MAX).collect();
        assert_eq!((edges.len(), shared.len()), (5, 1));
        assert_eq!(*shared[0], SharedEdge { vertices: [1, 2], triangles: [0, 1] });
    }
}
