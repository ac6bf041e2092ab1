//! Which way a surface is curved.

use glam::Vec3;

use crate::plan::search::Bend;

/// Curved the other way by less than this share, a surface is what it is for the rest: welded seams are.
const NEGLIGIBLE: f64 = 0.002;
/// Normals that turn by less than this along an edge, as a share of its length, do not turn.
const ROUNDING: f64 = 1e-5;

/// How normals turn along the edges of triangles, long edges most: apart where the surface is convex.
pub(super) fn bend(corners: &[[Vec3; 3]], normals: &[[Vec3; 3]]) -> Bend {
    let (mut apart, mut together, mut longest) = (0.0, 0.0, 0.0);
    for (corners, normals) in corners.iter().zip(normals) {
        for k in 0..3 {
            let next = (k + 1) % 3;
            let turn = (normals[next] - normals[k]).dot(corners[next] - corners[k]);
            longest += f64::from((corners[next] - corners[k]).length());
            *(if turn > 0.0 { &mut apart } else { &mut together }) += f64::from(turn.abs());
        }
    }
    let all = apart + together;
    if all <= ROUNDING * longest {
        let same = normals.iter().flatten().all(|n| n.distance(normals[0][0]) < 1e-3);
        return if same { Bend::Flat } else { Bend::Faceted };
    }
    if together <= NEGLIGIBLE * all {
        Bend::Convex
    } else if apart <= NEGLIGIBLE * all {
        Bend::Concave
    } else {
        Bend::Mixed
    }
}
