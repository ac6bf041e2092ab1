//! Meshes for the tests.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use crate::geometry::Mesh;

/// A grid of `columns`·`rows` cells, two triangles each; `place` maps the unit square.
fn grid(columns: u32, rows: u32, place: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let corner = |i: u32, j: u32| place(i as f32 / columns as f32, j as f32 / rows as f32);
    let points = (0..=rows).flat_map(|j| (0..=columns).map(move |i| (i, j)));
    let positions = points.map(|(i, j)| corner(i, j)).collect();
    let at = |i: u32, j: u32| j * (columns + 1) + i;
    let cells = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
    let triangles = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, d, b], [b, d, c]]
    });
    Mesh::new(positions, vec![], vec![], triangles.collect()).unwrap()
}

/// The unit square of the plane y = 0, facing up.
pub(super) fn plane(columns: u32, rows: u32) -> Mesh {
    grid(columns, rows, |u, v| Vec3::new(u, 0.0, v))
}

/// The unit sphere. Its triangles get ever smaller towards the poles.
pub(super) fn sphere(columns: u32, rows: u32) -> Mesh {
    let mesh = grid(columns, rows, |u, v| {
        let ((sin_u, cos_u), (sin_v, cos_v)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
        Vec3::new(sin_v * cos_u, cos_v, sin_v * sin_u)
    });
    let normals = mesh.positions().to_vec();
    Mesh::new(mesh.positions().to_vec(), normals, vec![], mesh.triangles().to_vec()).unwrap()
}

/// A torus of radii 1 and 0.4.
pub(super) fn torus(columns: u32, rows: u32) -> Mesh {
    grid(columns, rows, |u, v| {
        let ((sin_u, cos_u), (sin_v, cos_v)) = ((TAU * u).sin_cos(), (TAU * v).sin_cos());
        let radius = 1.0 + 0.4 * cos_v;
        Vec3::new(radius * cos_u, 0.4 * sin_v, radius * sin_u)
    })
}

/// The six sides of the unit cube, two triangles each.
pub(super) fn cube() -> Mesh {
    let side = |corner: Vec3, u: Vec3, v: Vec3| grid(1, 1, |s, t| corner + u * s + v * t);
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    joined(&[
        side(Vec3::ZERO, x, y),
        side(Vec3::ZERO, y, z),
        side(Vec3::ZERO, z, x),
        side(x, z, y),
        side(y, x, z),
        side(z, y, x),
    ])
}

/// The unit square as a fan of slivers about a corner, in a scrambled order.
pub(super) fn slivers(count: u32) -> Mesh {
    let rim = (0..=count).map(|i| {
        let t = 2.0 * i as f32 / count as f32;
        if t <= 1.0 { Vec3::new(1.0, 0.0, t) } else { Vec3::new(2.0 - t, 0.0, 1.0) }
    });
    let positions = std::iter::once(Vec3::ZERO).chain(rim).collect();
    // 7,919 is a prime, so every sliver comes once unless `count` is a multiple of it.
    let scrambled = (0..count).map(|i| i * 7_919 % count);
    let triangles = scrambled.map(|i| [0, i + 2, i + 1]).collect();
    Mesh::new(positions, vec![], vec![], triangles).unwrap()
}

/// The same triangles elsewhere; `flipped` turns them over.
pub(super) fn moved(mesh: &Mesh, by: Vec3, flipped: bool) -> Mesh {
    let positions = mesh.positions().iter().map(|&p| p + by).collect();
    let turn = |[a, b, c]: [u32; 3]| if flipped { [a, c, b] } else { [a, b, c] };
    let triangles = mesh.triangles().iter().map(|&t| turn(t)).collect();
    Mesh::new(positions, vec![], vec![], triangles).unwrap()
}

/// All triangles of several meshes, in order.
pub(super) fn joined(meshes: &[Mesh]) -> Mesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let first = u32::try_from(positions.len()).unwrap();
        positions.extend_from_slice(mesh.positions());
        triangles.extend(mesh.triangles().iter().map(|t| t.map(|i| i + first)));
    }
    Mesh::new(positions, vec![], vec![], triangles).unwrap()
}
