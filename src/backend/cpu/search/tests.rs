//! Pieces of triangles.

use glam::Vec3;

use super::images::Image;
use super::pieces::{Piece, reflected_part, whole};

fn image(x: f32, y: f32, height: f32) -> Image {
    Image { place: Vec3::new(x, y, 0.0), height, distance: 1.0 + x, steps: 3.0 }
}

fn area(piece: &Piece) -> f32 {
    let [a, b, c] = piece.corners.map(|c| c.image.place);
    0.5 * (b - a).cross(c - a).length()
}

#[test]
fn only_the_reflected_part_is_left() {
    for (heights, left) in [
        ([1.0, 1.0, 1.0], 0.5),
        ([-1.0, -1.0, -1.0], 0.0),
        ([1.0, -1.0, -1.0], 0.125),
        ([-1.0, 1.0, 1.0], 0.375),
        ([1.0, 1.0, -3.0], 0.5 * (1.0 - 0.75 * 0.75)),
    ] {
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)];
        let images = [0, 1, 2].map(|k: usize| image(corners[k].0, corners[k].1, heights[k]));
        let mut pieces = Vec::new();
        reflected_part(&whole(7, images), &mut pieces);
        let sum: f32 = pieces.iter().map(area).sum();
        assert!((sum - left).abs() < 1e-6, "{heights:?}: {sum}");
        for piece in &pieces {
            assert_eq!(piece.parent, 7);
            for corner in &piece.corners {
                let weights = corner.weights;
                assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
                assert!(corner.image.height >= -1e-6, "{corner:?}");
                // Weights, places and distances go together.
                let place = Vec3::new(weights[1], weights[2], 0.0);
                assert!(corner.image.place.distance(place) < 1e-6);
                assert!((corner.image.distance - 1.0 - weights[1]).abs() < 1e-6);
            }
            let middle = piece.parent_weights([1.0 / 3.0; 3]);
            assert!((middle.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        }
    }
}
