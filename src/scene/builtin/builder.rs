//! Vertices and triangles of a shape in the making.

use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::Mesh;

/// A point of a surface and its unit normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    pub(super) point: DVec3,
    pub(super) normal: DVec3,
}

/// How the border of a grid is joined.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Joints {
    /// The last row of vertices is the first one.
    pub(super) rows: bool,
    /// The last column of vertices is the first one.
    pub(super) columns: bool,
    /// The first row of vertices is one point.
    pub(super) pole: bool,
}

/// A mesh in the making. Triangles are counter-clockwise seen from the front.
#[derive(Default)]
pub(super) struct Builder {
    vertices: Vec<Vertex>,
    triangles: Vec<[u32; 3]>,
}

impl Builder {
    /// Adds a vertex.
    ///
    /// # Panics
    /// Beyond 2³² vertices, which no shape reaches.
    pub(super) fn vertex(&mut self, vertex: Vertex) -> u32 {
        self.vertices.push(vertex);
        u32::try_from(self.vertices.len() - 1).expect("shapes stay below 2^32 vertices")
    }

    /// Adds a triangle.
    pub(super) fn triangle(&mut self, corners: [u32; 3]) {
        self.triangles.push(corners);
    }

    /// Adds a quadrilateral, cut along its shorter diagonal.
    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        let point = |i: u32| self.vertices[i as usize].point;
        if point(a).distance_squared(point(c)) <= point(b).distance_squared(point(d)) {
            self.triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            self.triangles.extend([[a, b, d], [b, c, d]]);
        }
    }

    /// Adds a grid of `rows` × `columns` quadrilaterals with vertex (i, j) at `surface(i, j)`; its front is
    /// where (direction of the rows' numbers) × (direction of the columns' numbers) points.
    pub(super) fn grid(
        &mut self,
        [rows, columns]: [usize; 2],
        joints: Joints,
        surface: impl Fn(usize, usize) -> Vertex + Sync,
    ) {
        let around = if joints.columns { columns } else { columns + 1 };
        let first = usize::from(joints.pole);
        let end = if joints.rows { rows } else { rows + 1 };
        let base = self.vertices.len();
        if joints.pole {
            self.vertices.push(surface(0, 0));
        }
        let body = (first * around..end * around).into_par_iter();
        self.vertices.par_extend(body.map(|k| surface(k / around, k % around)));

        #[expect(clippy::cast_possible_truncation, reason = "shapes stay below 2^32 vertices")]
        let index = |i: usize, j: usize| {
            let (i, j) = (if joints.rows { i % rows } else { i }, j % around);
            let place = if joints.pole {
                if i == 0 { 0 } else { 1 + (i - 1) * around + j }
            } else {
                i * around + j
            };
            (base + place) as u32
        };
        for i in 0..rows {
            for j in 0..columns {
                let [a, b, c, d] =
                    [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
                if a == d { self.triangle([a, b, c]) } else { self.quad([a, b, c, d]) }
            }
        }
    }

    /// The finished mesh.
    ///
    /// # Panics
    /// If the shape is no mesh: a bug here, since nothing in it comes from outside.
    pub(super) fn finish(self) -> Mesh {
        Mesh::new(
            self.vertices.iter().map(|v| v.point.as_vec3()).collect(),
            self.vertices.iter().map(|v| v.normal.as_vec3()).collect(),
            Vec::new(),
            self.triangles,
        )
        .expect("built-in shapes are sound")
    }

    /// Changes every vertex.
    #[must_use]
    pub(super) fn map(mut self, change: impl Fn(Vertex) -> Vertex) -> Self {
        for vertex in &mut self.vertices {
            *vertex = change(*vertex);
        }
        self
    }

    /// Lowest y of all vertices.
    pub(super) fn lowest(&self) -> f64 {
        self.vertices.iter().map(|v| v.point.y).fold(f64::INFINITY, f64::min)
    }
}

/// Rows and columns of the grid whose triangle count (`count`, rising in both) is nearest to `wanted`, among
/// those whose ratio of rows to columns is within about a tenth of `aspect`.
pub(super) fn best_grid(
    wanted: usize,
    aspect: f64,
    least: [usize; 2],
    count: impl Fn(usize, usize) -> usize,
) -> [usize; 2] {
    /// How much count error (as a fraction) a deviation of the ratio by a factor e outweighs: untuned.
    const RATIO_WEIGHT: f64 = 0.02;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small counts")]
    let rows_for = |columns: usize| (columns as f64 * aspect).round() as usize;
    let rows_for = |columns| rows_for(columns).max(least[0]);
    let middle = first(|columns| count(rows_for(columns), columns) >= wanted);
    let mut best = (f64::INFINITY, least);
    for columns in (middle - middle / 10).max(least[1])..=(middle + middle / 10).max(least[1]) {
        let above = first(|rows| count(rows, columns) >= wanted);
        for rows in [above.saturating_sub(1).max(least[0]), above.max(least[0])] {
            let error = count(rows, columns).abs_diff(wanted) as f64 / wanted as f64;
            let ratio = (rows as f64 / columns as f64 / aspect).ln().abs();
            let cost = error + RATIO_WEIGHT * ratio;
            if cost < best.0 {
                best = (cost, [rows, columns]);
            }
        }
    }
    best.1
}

/// The first number from 1 on for which `reached`, which is false up to it and true from there on.
fn first(reached: impl Fn(usize) -> bool) -> usize {
    let mut high = 1;
    while !reached(high) {
        high *= 2;
    }
    let mut low = high / 2;
    while high - low > 1 {
        let middle = low.midpoint(high);
        if reached(middle) { high = middle } else { low = middle }
    }
    high
}
