//! Newell's teapot (Martin Newell, University of Utah, 1975), without its bottom.
//!
//! The published figures are 290 control points of 32 patches, z up, spout along +x. They are
//! symmetric, and that is how they are kept here: body and lid as rings, handle and spout as halves.

use glam::{DVec2, DVec3};

use super::builder::{Builder, Joints, Vertex, best_grid};
use crate::geometry::{BicubicPatch, Mesh};

/// A ring of control points about the axis: radius, the length by which a quarter's inner control
/// points leave its ends, height.
type Ring = [f64; 3];

/// A half of a cross-section of handle or spout: from the middle plane over the side to the middle plane,
/// [along x, sideways, up].
type Half = [[f64; 3]; 4];

/// From the inside of the rim over the belly to the bottom: three patches of four rings that share their ends.
const BODY: [Ring; 10] = [
    [1.4, 0.784, 2.4],
    [1.3375, 0.749, 2.53125],
    [1.4375, 0.805, 2.53125],
    [1.5, 0.84, 2.4],
    [1.75, 0.98, 1.875],
    [2.0, 1.12, 1.35],
    [2.0, 1.12, 0.9],
    [2.0, 1.12, 0.45],
    [1.5, 0.84, 0.225],
    [1.5, 0.84, 0.15],
];

/// From the top of the knob to the lid's edge: two patches.
const LID: [Ring; 7] = [
    [0.0, 0.0, 3.15],
    [0.8, 0.45, 3.15],
    [0.0, 0.0, 2.85],
    [0.2, 0.112, 2.7],
    [0.4, 0.224, 2.55],
    [1.3, 0.728, 2.55],
    [1.3, 0.728, 2.4],
];

/// From its upper end backwards and down: two patches.
const HANDLE: [Half; 7] = [
    [[-1.6, 0.0, 2.025], [-1.6, 0.3, 2.025], [-1.5, 0.3, 2.25], [-1.5, 0.0, 2.25]],
    [[-2.3, 0.0, 2.025], [-2.3, 0.3, 2.025], [-2.5, 0.3, 2.25], [-2.5, 0.0, 2.25]],
    [[-2.7, 0.0, 2.025], [-2.7, 0.3, 2.025], [-3.0, 0.3, 2.25], [-3.0, 0.0, 2.25]],
    [[-2.7, 0.0, 1.8], [-2.7, 0.3, 1.8], [-3.0, 0.3, 1.8], [-3.0, 0.0, 1.8]],
    [[-2.7, 0.0, 1.575], [-2.7, 0.3, 1.575], [-3.0, 0.3, 1.35], [-3.0, 0.0, 1.35]],
    [[-2.5, 0.0, 1.125], [-2.5, 0.3, 1.125], [-2.65, 0.3, 0.9375], [-2.65, 0.0, 0.9375]],
    [[-2.0, 0.0, 0.9], [-2.0, 0.3, 0.9], [-1.9, 0.3, 0.6], [-1.9, 0.0, 0.6]],
];

/// From the belly outwards, over the lip and a little back inside: two patches.
const SPOUT: [Half; 7] = [
    [[1.7, 0.0, 1.425], [1.7, 0.66, 1.425], [1.7, 0.66, 0.6], [1.7, 0.0, 0.6]],
    [[2.6, 0.0, 1.425], [2.6, 0.66, 1.425], [3.1, 0.66, 0.825], [3.1, 0.0, 0.825]],
    [[2.3, 0.0, 2.1], [2.3, 0.25, 2.1], [2.4, 0.25, 2.025], [2.4, 0.0, 2.025]],
    [[2.7, 0.0, 2.4], [2.7, 0.25, 2.4], [3.3, 0.25, 2.4], [3.3, 0.0, 2.4]],
    [[2.8, 0.0, 2.475], [2.8, 0.25, 2.475], [3.525, 0.25, 2.49375], [3.525, 0.0, 2.49375]],
    [[2.9, 0.0, 2.475], [2.9, 0.15, 2.475], [3.45, 0.15, 2.5125], [3.45, 0.0, 2.5125]],
    [[2.8, 0.0, 2.4], [2.8, 0.15, 2.4], [3.2, 0.15, 2.4], [3.2, 0.0, 2.4]],
];

/// The teapot in Newell's units, y up, spout to -x; each patch is cut into the same number of quadrilaterals.
pub(super) fn teapot(wanted: usize) -> Mesh {
    let cuts = cuts(wanted);
    let mut builder = Builder::default();
    for (part, pole) in [
        (BODY.map(ring).as_slice(), false),
        (LID.map(ring).as_slice(), true),
        (HANDLE.map(cross_section).as_slice(), false),
        (SPOUT.map(cross_section).as_slice(), false),
    ] {
        add_part(&mut builder, part, cuts, pole);
    }
    builder.finish()
}

/// How many quadrilaterals a patch is cut into, lengthwise and around: 28 patches; the four at the knob lose a triangle a
/// column where they run together.
fn cuts(wanted: usize) -> [usize; 2] {
    best_grid(wanted, 9.0 / 8.0, [6, 5], |rows, columns| 4 * columns * (14 * rows - 1))
}

/// The teapot's parts, by how many of its triangles end with them: rim, body, lid, handle and spout.
pub(super) fn parts(wanted: usize) -> Vec<(&'static str, usize)> {
    let [rows, columns] = cuts(wanted);
    // Rings of patches in each part, and how many patches go around.
    let parts = [
        ("rim", 1, 4, 0),
        ("body", 2, 4, 0),
        ("lid", 2, 4, 1),
        ("handle", 2, 2, 0),
        ("spout", 2, 2, 0),
    ];
    let mut end = 0;
    let count = |(name, rings, around, poles): (&'static str, usize, usize, usize)| {
        end += around * columns * (2 * rings * rows - poles);
        (name, end)
    };
    parts.map(count).to_vec()
}

/// How many of the lid's triangles, its first ones, are the knob's: the upper one of its two patches.
pub(super) fn knob(wanted: usize) -> usize {
    let [rows, columns] = cuts(wanted);
    4 * columns * (2 * rows - 1)
}

/// The control points of one closed curve about a part: three a patch, since patches share their ends.
fn ring([radius, reach, height]: Ring) -> Vec<DVec3> {
    let quarter = [DVec2::new(radius, 0.0), DVec2::new(radius, reach), DVec2::new(reach, radius)];
    let mut points = Vec::with_capacity(12);
    let mut turn = DVec2::X;
    for _ in 0..4 {
        points.extend(quarter.map(|p| turn.rotate(p).extend(height)));
        turn = turn.perp();
    }
    points.into_iter().map(upright).collect()
}

/// See [`ring`]: there on one side, back on the other.
fn cross_section(half: Half) -> Vec<DVec3> {
    let [a, b, c, d] = half.map(DVec3::from);
    let mirrored = |p: DVec3| DVec3::new(p.x, -p.y, p.z);
    [a, b, c, d, mirrored(c), mirrored(b)].map(upright).to_vec()
}

/// From z up and the spout along +x to y up and the spout along -x.
fn upright(p: DVec3) -> DVec3 {
    DVec3::new(-p.x, p.z, p.y)
}

/// Adds the surface over closed control curves, 3n + 1 of them for n patches lengthwise.
fn add_part(builder: &mut Builder, curves: &[Vec<DVec3>], cuts: [usize; 2], pole: bool) {
    let (lengthwise, around) = ((curves.len() - 1) / 3, curves[0].len() / 3);
    let patch = |row: usize, column: usize| {
        let point = |i: usize, j: usize| curves[3 * row + i][(3 * column + j) % curves[0].len()];
        BicubicPatch(std::array::from_fn(|i| std::array::from_fn(|j| point(i, j))))
    };
    let joints = Joints { columns: true, pole, ..Joints::default() };
    builder.grid([lengthwise * cuts[0], around * cuts[1]], joints, |i, j| {
        // The last row belongs to the patch before it.
        let (row, column) = ((i / cuts[0]).min(lengthwise - 1), j / cuts[1]);
        let u = (i - row * cuts[0]) as f64 / cuts[0] as f64;
        let v = (j - column * cuts[1]) as f64 / cuts[1] as f64;
        let patch = patch(row, column);
        let normal = patch.normal(u, v).expect("the teapot has a normal everywhere");
        Vertex { point: patch.at(u, v).point, normal }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_meet_with_one_normal() {
        for part in [
            &BODY.map(ring)[..],
            &LID.map(ring),
            &HANDLE.map(cross_section),
            &SPOUT.map(cross_section),
        ] {
            let (rows, columns) = ((part.len() - 1) / 3, part[0].len() / 3);
            let patch = |row: usize, column: usize| {
                BicubicPatch(std::array::from_fn(|i| {
                    std::array::from_fn(|j| part[3 * row + i][(3 * column + j) % part[0].len()])
                }))
            };
            for (row, column) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
                for t in [0.0, 0.3, 0.6, 1.0] {
                    let here = patch(row, column);
                    let beside = patch(row, (column + 1) % columns);
                    let [a, b] = [here.normal(t, 1.0), beside.normal(t, 0.0)].map(Option::unwrap);
                    assert!(a.distance(b) < 1e-9, "{row} {column} at {t}: {a} {b}");
                    if row + 1 < rows {
                        let below = patch(row + 1, column);
                        let [a, b] =
                            [here.normal(1.0, t), below.normal(0.0, t)].map(Option::unwrap);
                        assert!(a.distance(b) < 1e-9, "{row} {column} at {t}: {a} {b}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_default_is_the_papers_teapot() {
        let mesh = teapot(4000);
        assert_eq!(mesh.triangles().len(), 4000);
        // 28 rings of 32, the lid's 18 of 32 and its top, handle and spout 19 rings of 16 each.
        assert_eq!(mesh.positions().len(), 28 * 32 + 18 * 32 + 1 + 2 * 19 * 16);
        let bounds = mesh.bounds();
        // Extremes that are control points, since the surface is level there.
        assert_eq!((bounds.min.y, bounds.max.y), (0.15, 3.15));
        assert_eq!((bounds.min.z, bounds.max.z), (-2.0, 2.0));
        assert_eq!(bounds.max.x, 3.0);
        assert!(bounds.min.x < -3.3 && bounds.min.x > -3.525, "spout to -x");
    }
}
