//! Cells: the mirrors' pixels in groups whose exact rays are nearly linear over the picture, so that one 3-ray camera
//! sees for each. Where a mirror's triangles are small, a cell spans many; where they are large or strongly curved,
//! a triangle has many cells. Their number follows the picture, not the mesh.

mod field;
mod fit;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use self::field::{Linear, RayField, centre};
use self::fit::{BASE, Judge, Mask, Sums};
use super::super::FrameInput;
use crate::camera::three_ray::{RayScale, Rays};
use crate::visibility::{MirrorTriangleIndex, Patch, PixelRect};

/// Columns and rows of a tile: the largest cell. A row is a word of bits.
const TILE: usize = 32;
/// How far a ray of a cell may lie from its camera's, in pixels (untuned).
const TOLERANCE_PX: f32 = 0.25;
/// The same at the mirror's surface.
const SURFACE_TOLERANCE_PX: f32 = 2.0;
/// Squares of a tile along a side.
const SQUARES: usize = TILE / BASE;

/// The construction rays of a cell, from the corners of a triangle in the picture.
pub(super) struct CellRays {
    pub(super) corners_px: [DVec2; 3],
    pub(super) rays: Rays,
}

/// All cells of a frame.
#[derive(Default)]
pub(super) struct Cells {
    pub(super) patches: Vec<Patch>,
    /// By patch.
    pub(super) rays: Vec<CellRays>,
    /// By patch and row: which pixels are its own.
    pub(super) rows: Vec<u32>,
}

/// A cell in its tile.
struct Group {
    rows: [u32; TILE],
    linear: Linear<4>,
}

pub(super) fn cells(frame: FrameInput<'_>, scale: RayScale) -> Cells {
    let size = frame.eye.size;
    let tile = TILE as u32;
    let across = size.width.div_ceil(tile);
    let count = across * size.height.div_ceil(tile);
    let parts: Vec<Cells> = (0..count)
        .into_par_iter()
        .fold(
            || (RayField::new(), Vec::new(), Cells::default()),
            |(mut field, mut groups, mut cells), i| {
                let origin = [i % across * tile, i / across * tile];
                groups.clear();
                of_tile(frame, origin, &mut field, &mut groups);
                for group in &groups {
                    cells.push(frame, origin, &field, group, scale);
                }
                (field, groups, cells)
            },
        )
        .map(|(_, _, cells)| cells)
        .collect();
    let mut all = Cells::default();
    for part in parts {
        let rows = u32::try_from(all.rows.len()).expect("fewer rows than pixels");
        all.patches.extend(part.patches.into_iter().map(|mut patch| {
            patch.rows = patch.rows.map(|first| first + rows);
            patch
        }));
        all.rays.extend(part.rays);
        all.rows.extend(part.rows);
    }
    all
}

/// One square of a tile, or several that became one.
#[derive(Clone, Copy, Default)]
struct Square {
    sums: Sums,
    linear: Linear<4>,
    /// All of its pixels are of one cell.
    whole: bool,
    empty: bool,
}

fn of_tile(frame: FrameInput<'_>, origin: [u32; 2], field: &mut RayField, out: &mut Vec<Group>) {
    let shown = field.fill(frame.eye, frame.scene, frame.visibility, origin);
    let Some(first) = shown.iter().position(|row| *row != 0) else { return };
    let first = first * TILE + shown[first].trailing_zeros() as usize;
    let about = [0, 1, 2, 3].map(|k| field.field[k][first]);
    let focal_px = frame.eye.focal_px;
    let mut squares = [Square::default(); SQUARES * SQUARES];
    let mut masks = [Mask { left: 0, top: 0, bits: [0; BASE] }; SQUARES * SQUARES];
    for (i, (square, mask)) in squares.iter_mut().zip(&mut masks).enumerate() {
        *mask = Mask::of(&shown, i % SQUARES * BASE, i / SQUARES * BASE);
        square.empty = mask.is_empty();
        square.whole = square.empty;
        if square.empty {
            continue;
        }
        square.sums = Sums::new(&field.field, about, mask);
        if let Some(linear) = square.sums.fit(about) {
            let judge = Judge::new(&linear, mask.middle(), focal_px, TOLERANCE_PX, SURFACE_TOLERANCE_PX);
            square.linear = linear;
            square.whole = judge.accepted(&field.field, mask).bits == mask.bits;
        }
        if !square.whole {
            split(frame, origin, field, about, *mask, out);
        }
    }
    merge(&squares, &masks, field, about, focal_px, out);
}

/// Groups the pixels of a square whose rays one linear function does not describe.
fn split(
    frame: FrameInput<'_>,
    origin: [u32; 2],
    field: &mut RayField,
    about: [f32; 4],
    mut left: Mask,
    out: &mut Vec<Group>,
) {
    let focal_px = frame.eye.focal_px;
    while !left.is_empty() {
        let seed = left.first();
        let at = seed.map(centre);
        let tangent = field.tangent(frame.eye, frame.scene, origin, seed);
        let judge = |linear: &Linear<4>, more: f32| {
            Judge::new(linear, at, focal_px, TOLERANCE_PX * more, SURFACE_TOLERANCE_PX)
        };
        let near = judge(&tangent, 2.0).accepted(&field.field, &left);
        let refit = Sums::new(&field.field, about, &near).fit(about).and_then(|linear| {
            let near = judge(&linear, 1.5).accepted(&field.field, &left);
            near.contains(seed).then_some((linear, near))
        });
        let (linear, mut near) = refit.unwrap_or_else(|| {
            (tangent, judge(&tangent, 1.0).accepted(&field.field, &left))
        });
        near.bits[seed[1] - near.top] |= 1 << (seed[0] - near.left);
        out.push(Group::new(linear, &[near]));
        left = left.without(&near);
    }
}

/// Squares side by side become one cell where one function describes them.
fn merge(
    squares: &[Square; SQUARES * SQUARES],
    masks: &[Mask; SQUARES * SQUARES],
    field: &RayField,
    about: [f32; 4],
    focal_px: f32,
    out: &mut Vec<Group>,
) {
    let join = |parts: &[usize]| -> Option<Linear<4>> {
        let mut sums = Sums::default();
        for &i in parts {
            if !squares[i].whole {
                return None;
            }
            sums = sums.plus(&squares[i].sums);
        }
        let linear = sums.fit(about)?;
        let judge = Judge::new(&linear, sums.middle(), focal_px, TOLERANCE_PX, SURFACE_TOLERANCE_PX);
        let fits = |&i: &usize| {
            squares[i].empty || judge.accepted(&field.field, &masks[i]).bits == masks[i].bits
        };
        parts.iter().all(fits).then_some(linear)
    };
    let mut push = |linear: Linear<4>, parts: &[usize]| {
        let masks: Vec<Mask> = parts.iter().map(|&i| masks[i]).collect();
        out.push(Group::new(linear, &masks));
    };
    let all: Vec<usize> = (0..SQUARES * SQUARES).collect();
    if let Some(linear) = join(&all) {
        push(linear, &all);
        return;
    }
    for corner in [0, 2, 2 * SQUARES, 2 * SQUARES + 2] {
        let four = [corner, corner + 1, corner + SQUARES, corner + SQUARES + 1];
        if let Some(linear) = join(&four) {
            push(linear, &four);
            continue;
        }
        for i in four {
            if squares[i].whole && !squares[i].empty {
                push(squares[i].linear, &[i]);
            }
        }
    }
}

impl Group {
    fn new(linear: Linear<4>, masks: &[Mask]) -> Self {
        let mut rows = [0; TILE];
        for mask in masks {
            for (row, bits) in rows[mask.top..mask.top + BASE].iter_mut().zip(mask.bits) {
                *row |= u32::from(bits) << mask.left;
            }
        }
        Self { rows, linear }
    }
}

impl Cells {
    fn push(
        &mut self,
        frame: FrameInput<'_>,
        [left, top]: [u32; 2],
        field: &RayField,
        group: &Group,
        scale: RayScale,
    ) {
        let all = group.rows.iter().fold(0, |all, row| all | row);
        let used = |row: &u32| *row != 0;
        let Some(first) = group.rows.iter().position(used) else { return };
        let last = group.rows.iter().rposition(used).unwrap_or(first);
        let (from, to) = (all.trailing_zeros(), 32 - all.leading_zeros());
        #[expect(clippy::cast_possible_truncation, reason = "rows of a tile")]
        let rect = PixelRect {
            min: [left + from, top + first as u32],
            max: [left + to, top + last as u32 + 1],
        };
        let some = first * TILE + group.rows[first].trailing_zeros() as usize;
        self.patches.push(Patch {
            triangle: MirrorTriangleIndex(field.ids[some]),
            corners: [DVec3::X, DVec3::Y, DVec3::Z],
            rect,
            pixels: group.rows.iter().map(|row| row.count_ones()).sum(),
            cell: None,
            rows: Some(u32::try_from(self.rows.len()).expect("fewer rows than pixels")),
        });
        self.rows.extend(group.rows[first..=last].iter().map(|row| row >> from));
        self.rays.push(construction_rays(frame, [left, top], rect, &group.linear, scale));
    }
}

/// How much less than in its middle the inverse depth may be anywhere about a cell.
const LEAST_INVERSE: f64 = 0.25;

fn construction_rays(
    frame: FrameInput<'_>,
    [left, top]: [u32; 2],
    rect: PixelRect,
    linear: &Linear<4>,
    scale: RayScale,
) -> CellRays {
    let eye = frame.eye;
    let [x0, y0] = rect.min.map(f64::from);
    let [x1, y1] = rect.max.map(f64::from);
    let corners_px = [DVec2::new(x0, y0), DVec2::new(x1, y0), DVec2::new(x0, y1)];
    let half = 0.5 * TILE as f64;
    let middle = DVec2::new(f64::from(left) + half, f64::from(top) + half);
    let at = |k: usize, px: DVec2| {
        let p = px - middle;
        f64::from(linear.at[k]) + p.x * f64::from(linear.right[k]) + p.y * f64::from(linear.down[k])
    };
    let position = eye.position.as_dvec3();
    let (right, up, forward) = (eye.right.as_dvec3(), eye.up.as_dvec3(), eye.forward.as_dvec3());
    let focal = f64::from(eye.focal_px);
    let (cx, cy) = (0.5 * f64::from(eye.size.width), 0.5 * f64::from(eye.size.height));
    // Far outside the cell the inverse depth must stay positive: the slope is limited.
    let center = 0.5 * (DVec2::new(x0, y0) + DVec2::new(x1, y1));
    let inverse = at(3, center);
    let slope = DVec2::new(f64::from(linear.right[3]), f64::from(linear.down[3]));
    let around = 24.0 + (x1 - x0) + (y1 - y0);
    let share = ((1.0 - LEAST_INVERSE) * inverse / (slope.length() * around)).min(1.0);
    let rays = corners_px.map(|px| {
        let depth = 1.0 / (inverse + share * slope.dot(px - center));
        let view = forward + right * ((px.x - cx) / focal) - up * ((px.y - cy) / focal);
        let direction = DVec3::new(at(0, px), at(1, px), at(2, px));
        let direction = match scale {
            RayScale::EyeDistance => direction * depth,
            RayScale::Unit => direction.normalize_or_zero(),
        };
        (position + view * depth, direction)
    });
    CellRays {
        corners_px,
        rays: Rays { origins: rays.map(|r| r.0), directions: rays.map(|r| r.1) },
    }
}
