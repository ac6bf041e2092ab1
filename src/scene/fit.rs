//! Transforms that bring a mesh to a wanted size and place.

use glam::{DQuat, DVec3};

use crate::geometry::{Mesh, Similarity};

/// Rotates meshes that stand together, then scales and moves them so that their bounding box in world space has the given
/// diagonal, and the middle of the box's bottom lies at `base`. Each comes with what takes its own space to the common one,
/// and so is the result to be applied after that.
pub fn fit(
    meshes: &[(&Mesh, Similarity)],
    rotation: DQuat,
    diagonal: f64,
    base: DVec3,
) -> Similarity {
    let turn = Similarity { rotation, ..Similarity::IDENTITY };
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (min, max) = meshes.iter().fold(none, |(low, high), (mesh, own)| {
        let (min, max) = world_bounds(mesh, &own.then(&turn));
        (low.min(min), high.max(max))
    });
    let scale = diagonal / (max - min).length();
    let bottom = DVec3::new(0.5 * (min.x + max.x), min.y, 0.5 * (min.z + max.z));
    Similarity { rotation, translation: base - scale * bottom, scale }
}

/// Lowest and highest corner of the transformed mesh's box, world space.
pub fn world_bounds(mesh: &Mesh, transform: &Similarity) -> (DVec3, DVec3) {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    mesh.triangles().iter().flatten().fold(none, |(min, max), &i| {
        let p = transform.point(mesh.positions()[i as usize].as_dvec3());
        (min.min(p), max.max(p))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn fit_meets_diagonal_and_base() {
        let corners = vec![
            Vec3::new(1.0, 2.0, 3.0),
            Vec3::new(4.0, 2.5, 3.0),
            Vec3::new(2.0, 7.0, -9.0),
            Vec3::splat(1e6),
        ];
        // The last vertex belongs to no triangle and must not count.
        let mesh = Mesh::new(corners, vec![], vec![], vec![[0, 1, 2]]).unwrap();
        let rotation = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
        let base = DVec3::new(0.74, -3.0, 0.5);
        let transform = fit(&[(&mesh, Similarity::IDENTITY)], rotation, 1.2, base);
        let (min, max) = world_bounds(&mesh, &transform);
        assert!(((max - min).length() - 1.2).abs() < 1e-12);
        let bottom = DVec3::new(0.5 * (min.x + max.x), min.y, 0.5 * (min.z + max.z));
        assert!((bottom - base).length() < 1e-12);
        assert_eq!(transform.rotation, rotation);
    }
}
