//! The trees over surfels apart from what made them: other leaves, and what everything takes in memory.

use std::time::Instant;

use super::{Cloud, PrepareOptions, PreparedScene, milliseconds, pad};
use crate::accel::{KdTree, KdTreeLimits};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::Surfels;
use crate::geometry::surfel::PADDING;

impl PreparedScene {
    /// Builds all trees anew with other limits. The surfels are the same ones, in the order of the new leaves, and keep
    /// their light. The trees are those of a scene that is prepared with these limits, but for surfels that have a
    /// coordinate in common: which of them comes first may differ.
    ///
    /// # Errors
    /// The limits make no sense, or cancelled: then nothing has changed.
    pub fn rebuild_trees(&mut self, limits: KdTreeLimits, cx: &Context) -> Result<()> {
        PrepareOptions { tree: limits, ..PrepareOptions::default() }.check()?;
        let start = Instant::now();
        let mut surfels = Surfels::default();
        let mut clouds: Vec<Cloud> = Vec::with_capacity(self.clouds.len());
        for (i, old) in self.clouds.iter().enumerate() {
            cx.step("building trees", i as f64 / self.clouds.len() as f64)?;
            let mut cloud = Cloud::new(self.surfels_of(i), old.closed, limits, &mut surfels);
            cloud.place(old.to_scene);
            clouds.push(cloud);
        }
        pad(&mut surfels);
        self.tree_builds += clouds.len();
        (self.surfels, self.clouds) = (surfels, clouds);
        self.times.tree_ms = milliseconds(start);
        self.average();
        Ok(())
    }

    /// A copy of the surfels of a cloud, without representatives, as [`KdTree::build`] takes them.
    ///
    /// # Panics
    /// If there is no such cloud.
    pub fn surfels_of(&self, cloud: usize) -> Surfels {
        let range = &self.clouds[cloud].surfels;
        let range = range.start as usize..range.end as usize;
        let all = &self.surfels;
        let padded = |list: &[f32]| {
            let mut own = Vec::with_capacity(range.len() + PADDING);
            own.extend_from_slice(&list[range.clone()]);
            own.resize(range.len() + PADDING, own.last().copied().unwrap_or(0.0));
            own
        };
        Surfels {
            x: padded(&all.x),
            y: padded(&all.y),
            z: padded(&all.z),
            normals: all.normals[range.clone()].to_vec(),
            albedo: all.albedo[range.clone()].to_vec(),
            radiance: all.radiance[range.clone()].to_vec(),
            extent: all.extent[range.clone()].to_vec(),
        }
    }

    /// Bytes of the surfels with their representatives, and of the trees over them: what the method needs besides the
    /// picture. Meshes and triangle BVHs are not counted.
    pub fn surfel_bytes(&self) -> SurfelBytes {
        let Surfels { x, y, z, normals, albedo, radiance, extent } = &self.surfels;
        let numbers = size_of_val(&x[..]) + size_of_val(&y[..]) + size_of_val(&z[..]);
        let vectors =
            size_of_val(&normals[..]) + size_of_val(&albedo[..]) + size_of_val(&radiance[..]);
        let tree = |tree: &KdTree| size_of_val(tree.wide());
        SurfelBytes {
            surfels: numbers + vectors + size_of_val(&extent[..]) + size_of_val(&self.looks[..]),
            trees: self.clouds.iter().map(|cloud| tree(&cloud.tree)).sum(),
        }
    }
}

/// See [`PreparedScene::surfel_bytes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfelBytes {
    /// Of surfels and representatives, mirrors' included.
    pub surfels: usize,
    /// Of trees.
    pub trees: usize,
}

#[cfg(test)]
mod tests {
    use crate::accel::KdTreeLimits;
    use crate::context::Context;
    use crate::scene::arrange::{self, Request};
    use crate::scene::prepared::{PrepareOptions, PreparedScene};

    fn limits(leaf_points: u32) -> KdTreeLimits {
        KdTreeLimits { leaf_points, leaf_size: 0.0 }
    }

    #[test]
    fn other_leaves_are_as_if_prepared_with_them() {
        let request = Request {
            mirrors: vec!["sphere".into()],
            // No two of their surfels have a coordinate in common, so that there is one tree only.
            objects: vec!["torus".into(), "knot".into()],
            ..Request::default()
        };
        let cx = Context::default();
        let scene = arrange::scene(&request, &cx).unwrap();
        let prepared = |leaf| {
            let options = PrepareOptions { surfels: 5000, tree: limits(leaf), seed: 3 };
            PreparedScene::new(&scene, &options, &cx).unwrap()
        };
        let (mut rebuilt, fresh) = (prepared(100), prepared(8));
        let coarse = rebuilt.surfel_bytes();
        let versions = (rebuilt.version, rebuilt.surfel_version);
        rebuilt.rebuild_trees(limits(8), &cx).unwrap();
        assert_eq!(rebuilt.version, versions.0, "the meshes are the same");
        assert_ne!(rebuilt.surfel_version, versions.1);
        for (a, b) in rebuilt.clouds.iter().zip(&fresh.clouds) {
            assert!(a.tree.wide() == b.tree.wide(), "too long to be shown");
            assert_eq!((&a.surfels, &a.representatives), (&b.surfels, &b.representatives));
            assert_eq!((a.bounds, a.extent, a.closed), (b.bounds, b.extent, b.closed));
        }
        let (a, b) = (&rebuilt.surfels, &fresh.surfels);
        assert!((&a.x, &a.normals, &a.radiance) == (&b.x, &b.normals, &b.radiance));
        assert!((&a.extent, &a.albedo) == (&b.extent, &b.albedo));
        assert_eq!(rebuilt.surfel_bytes(), fresh.surfel_bytes());
        assert!(rebuilt.surfel_bytes().trees > 4 * coarse.trees);
        let before = rebuilt.surfels.x.clone();
        assert!(rebuilt.rebuild_trees(limits(0), &cx).is_err());
        assert_eq!(rebuilt.surfels.x, before);
    }
}
