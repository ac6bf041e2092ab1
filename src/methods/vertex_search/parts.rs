//! The star-shaped parts of a mirror.

use std::ops::Range;

use glam::Vec3;

use super::bend::bend;
use super::center::{Center, center};
use super::refused;
use crate::error::Result;
use crate::geometry::{Mesh, Similarity};
use crate::plan::search::Bend;
use crate::scene::builtin;
use crate::scene::description::Source;
use crate::scene::prepared::PreparedScene;

/// A part of a mirror that is star-shaped, with the surface that its map is made from.
pub(super) struct Shape {
    pub(super) name: String,
    /// Of the mirror, as drawn.
    pub(super) triangles: Range<u32>,
    pub(super) center: Center,
    pub(super) bend: Bend,
    /// The mirror's local space.
    pub(super) corners: Vec<[Vec3; 3]>,
    /// Unit, at the corners.
    pub(super) normals: Vec<[Vec3; 3]>,
}

/// What can be searched on in a mirror, and the names of its parts that cannot. Built-in shapes are made anew with `fine`
/// triangles, if that is not 0.
///
/// # Errors
/// No part is star-shaped.
pub(super) fn shapes(
    scene: &PreparedScene,
    mirror: usize,
    fine: u32,
) -> Result<(Vec<Shape>, Vec<String>)> {
    let (mut shapes, mut others) = (Vec::new(), Vec::new());
    for piece in pieces(scene, mirror, fine) {
        match center(&piece.corners) {
            Some(center) => shapes.push(Shape {
                name: piece.name,
                triangles: piece.drawn,
                center,
                bend: bend(&piece.corners, &piece.normals),
                corners: piece.corners,
                normals: piece.normals,
            }),
            None => others.push(piece.name),
        }
    }
    if shapes.is_empty() {
        let problem = "is not star-shaped: from every point near it some of it is seen from behind";
        return Err(refused(scene, mirror, problem));
    }
    Ok((shapes, others))
}

/// A part of a mirror before anything is known of it.
struct Piece {
    name: String,
    drawn: Range<u32>,
    corners: Vec<[Vec3; 3]>,
    normals: Vec<[Vec3; 3]>,
}

impl Piece {
    fn of(
        name: String,
        drawn: Range<u32>,
        mesh: &Mesh,
        own: Range<usize>,
        place: &Similarity,
    ) -> Self {
        let triangles = &mesh.triangles()[own.start.min(mesh.triangles().len())..];
        let triangles = &triangles[..triangles.len().min(own.len())];
        let point = |i: u32| place.point(mesh.positions()[i as usize].as_dvec3()).as_vec3();
        let normal = |i: u32| place.direction(mesh.normals()[i as usize].as_dvec3()).as_vec3();
        Self {
            name,
            drawn,
            corners: triangles.iter().map(|t| t.map(point)).collect(),
            normals: triangles.iter().map(|t| t.map(normal)).collect(),
        }
    }
}

fn pieces(scene: &PreparedScene, index: usize, fine: u32) -> Vec<Piece> {
    let mirror = &scene.mirrors[index];
    let all = 0..u32::try_from(mirror.mesh.triangles().len()).expect("fewer than 2^32 triangles");
    let here = Similarity::IDENTITY;
    let whole = |mesh: &Mesh, place: &Similarity| {
        vec![Piece::of(mirror.name.clone(), all.clone(), mesh, 0..usize::MAX, place)]
    };
    if let Some(proxy) = &mirror.proxy {
        return whole(&proxy.mesh, &proxy.transform);
    }
    let Some(Source::Shape { name, triangles }) = &mirror.source else {
        return whole(&mirror.mesh, &here);
    };
    if let Some(closed) = builtin::closed(name, *triangles) {
        return whole(&closed, &here);
    }
    let wanted = if fine > 0 { Some(fine as usize) } else { *triangles };
    let finer = if fine > 0 { builtin::shape(name, wanted) } else { None };
    let mesh = finer.as_ref().unwrap_or(&mirror.mesh);
    let drawn = builtin::parts(name, *triangles);
    let mapped = builtin::parts(name, wanted);
    let clip = |end: usize| u32::try_from(end).unwrap_or(u32::MAX).min(all.end);
    drawn
        .into_iter()
        .zip(mapped)
        .map(|((part, drawn), (_, own))| {
            let name =
                if part == name { mirror.name.clone() } else { format!("{} {part}", mirror.name) };
            Piece::of(name, clip(drawn.start)..clip(drawn.end), mesh, own, &here)
        })
        .collect()
}
