//! Triangles that are not the objects' own: cut where the reflected region ends, or divided.

use super::images::Image;

/// A corner of a piece: its image, and where it is on the object's triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) image: Image,
    pub(super) weights: [f32; 3],
}

/// A part of an object's triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Of the triangle over all objects.
    pub(super) parent: u32,
    pub(super) corners: [Corner; 3],
}

fn mix(a: &Corner, b: &Corner, t: f32) -> Corner {
    let along = |x: f32, y: f32| x + (y - x) * t;
    Corner {
        image: Image {
            place: a.image.place + (b.image.place - a.image.place) * t,
            height: along(a.image.height, b.image.height),
            distance: along(a.image.distance, b.image.distance),
            steps: along(a.image.steps, b.image.steps),
        },
        weights: [0, 1, 2].map(|k| along(a.weights[k], b.weights[k])),
    }
}

/// The part of a piece in the reflected region, as one or two pieces.
pub(super) fn reflected_part(piece: &Piece, out: &mut Vec<Piece>) {
    let mut ring: Vec<Corner> = Vec::with_capacity(4);
    for k in 0..3 {
        let (here, next) = (&piece.corners[k], &piece.corners[(k + 1) % 3]);
        let (a, b) = (here.image.height, next.image.height);
        if a > 0.0 {
            ring.push(*here);
        }
        if (a > 0.0) != (b > 0.0) {
            ring.push(mix(here, next, a / (a - b)));
        }
    }
    for k in 2..ring.len() {
        out.push(Piece { parent: piece.parent, corners: [ring[0], ring[k - 1], ring[k]] });
    }
}

/// A corner of an object's triangle with its image.
pub(super) fn whole(parent: u32, images: [Image; 3]) -> Piece {
    let weights = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let corner = |k: usize| Corner { image: images[k], weights: weights[k] };
    Piece { parent, corners: [corner(0), corner(1), corner(2)] }
}

impl Piece {
    /// The weights of the parent's corners at weights of this piece's.
    pub(super) fn parent_weights(&self, weights: [f32; 3]) -> [f32; 3] {
        [0, 1, 2]
            .map(|k| (0..3).map(|corner| self.corners[corner].weights[k] * weights[corner]).sum())
    }
}
