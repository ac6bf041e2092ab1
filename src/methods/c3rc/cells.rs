//! Cells: the mirrors' pixels in groups whose exact rays are nearly linear over the picture, so that one 3-ray camera
//! sees for each. Where a mirror's triangles are small, a cell spans many; where they are large or strongly curved,
//! a triangle has many cells. Their number follows the picture, not the mesh.

mod fit;

use fearless_simd::{Simd, dispatch};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use self::fit::{Judge, Mask, Sums};
use super::super::FrameInput;
use super::cameras::{CameraSettings, Top, View, of_view, sees_objects, starts};
use super::guard::Outline;
use crate::camera::Eye;
use crate::camera::three_ray::Rays;
use crate::plan::{CELL_SLACK_PX, CameraInstance, Pixels};
use crate::visibility::mirror_rays::{Linear, RayField, TILE, TILE_PX, centre};
use crate::visibility::{MirrorTriangleIndex, OwnPixels, Patch, PixelRect};

/// How far points of the mirror may lie from a cell's plane, in pixels. Measured: from 2 to a half errors fall by 2 to 6 % at
/// next to no cost, as boxes are refused sooner; below that cells become more, and errors hardly less.
const SURFACE_TOLERANCE_PX: f32 = 0.5;
/// What a tile sees is bounded by a fit to its rays that is no farther off than this, in pixels.
const GLANCE_PX: f32 = 12.0;
/// How much farther off the rays may be that were not looked at.
const UNSEEN: f32 = 1.5;
/// How much farther a ray may lie while its cell grows (untuned).
const GROWING: f32 = 1.5;
/// How much farther the exact rays of other pixels may lie to go on from those of a cell (untuned).
const NEIGHBOURS: f32 = 4.0;
/// How often a cell's function is fitted.
const ROUNDS: usize = 4;

/// Some cells of a frame that see objects.
#[derive(Default)]
struct Cells {
    patches: Vec<Patch>,
    pixels: Pixels,
    cameras: Vec<CameraInstance>,
}

/// A cell in its tile.
struct Group {
    rows: Mask,
    /// Its own and other pixels whose exact rays go on from its own.
    known: Mask,
    linear: Linear<4>,
}

/// All cells that see objects, and their cameras.
pub(super) fn cells(
    frame: FrameInput<'_>,
    settings: CameraSettings,
) -> (Vec<Patch>, Pixels, (Vec<CameraInstance>, Vec<u32>)) {
    let size = frame.eye.size;
    let tile = TILE_PX;
    let across = size.width.div_ceil(tile);
    let count = across * size.height.div_ceil(tile);
    let top = Top::new(frame.scene, frame.eye);
    let parts: Vec<Cells> = (0..count)
        .into_par_iter()
        .fold(
            || (RayField::new(), Vec::new(), Cells::default()),
            |(mut field, mut groups, mut cells), i| {
                let origin = [i % across * tile, i / across * tile];
                groups.clear();
                dispatch!(top.level, simd => of_tile(simd, frame, &top, origin, &mut field, settings, &mut groups));
                for group in &groups {
                    cells.push(frame, &top, origin, &field, group, settings);
                }
                (field, groups, cells)
            },
        )
        .map(|(_, _, cells)| cells)
        .collect();
    let mut all = Cells::default();
    for part in parts {
        all.append(part);
    }
    let starts = starts(&all.cameras, all.patches.len());
    (all.patches, all.pixels, (all.cameras, starts))
}

fn index(count: usize) -> u32 {
    u32::try_from(count).expect("fewer than pixels")
}

/// Of a tile that may be one cell, rays at so many pixels along a side are enough to tell.
const SPARSE: usize = 8;

/// Some of the pixels of `shown`, spread evenly.
fn sparse(shown: &Mask) -> Mask {
    const COLUMNS: u32 = 0x4444_4444;
    let step = TILE / SPARSE;
    std::array::from_fn(|y| if y % step == step / 2 { shown[y] & COLUMNS } else { 0 })
}

/// Whether a tile sees no object, by some of its rays and all of its depths.
#[inline(always)]
pub(super) fn sees_nothing<S: Simd>(
    simd: S,
    frame: FrameInput<'_>,
    top: &Top,
    origin: [u32; 2],
    field: &mut RayField,
    shown: &Mask,
    settings: CameraSettings,
) -> bool {
    let (eye, visibility) = (frame.eye, frame.visibility);
    let some = sparse(shown);
    let Some(seed) = seed(&some) else { return false };
    field.fill(eye, frame.scene, &some);
    let about = field.at(seed);
    let sums = Sums::new(&field.field, about, &some);
    let Some(linear) = sums.fit(about) else { return false };
    let judge = Judge::new(&linear, sums.middle(), eye.focal_px, GLANCE_PX, GLANCE_PX);
    let slack = judge.farthest(&field.field, &some);
    if slack > GLANCE_PX {
        return false;
    }
    let mut depth = [[0.0; TILE]; TILE];
    let [left, first] = origin.map(|v| v as usize);
    let columns = (eye.size.width as usize - left).min(TILE);
    let rows = (eye.size.height as usize - first).min(TILE);
    for (y, row) in depth[..rows].iter_mut().enumerate() {
        let from = (first + y) * eye.size.width as usize + left;
        row[..columns].copy_from_slice(&visibility.mirror_depth[from..from + columns]);
    }
    if !judge.accepts_depths(simd, &depth, shown) {
        return false;
    }
    let group = Group { rows: *shown, known: *shown, linear };
    let patch = group.patch(origin, field);
    let (mut view, _) = group.view(eye, origin, &patch);
    let slack = f64::from(slack * UNSEEN);
    view.outline = view
        .outline
        .map(|(outline, most)| (Outline { half: outline.half + slack, ..outline }, most));
    !sees_objects(eye, top, &view, settings)
}

/// Groups the pixels of a tile: from a seed's tangent grows what one linear function describes.
#[inline(always)]
fn of_tile<S: Simd>(
    simd: S,
    frame: FrameInput<'_>,
    top: &Top,
    origin: [u32; 2],
    field: &mut RayField,
    settings: CameraSettings,
    out: &mut Vec<Group>,
) {
    let shown = field.enter(simd, frame.eye, frame.visibility, origin);
    if shown == [0; TILE] {
        return;
    }
    if sees_nothing(simd, frame, top, origin, field, &shown, settings) {
        return;
    }
    field.fill(frame.eye, frame.scene, &shown);
    let focal_px = frame.eye.focal_px;
    let mut left = shown;
    while let Some(seed) = seed(&left) {
        let about = field.at(seed);
        let tangent = field.tangent(frame.eye, frame.scene, seed);
        let center = [centre(seed[0]), centre(seed[1])];
        let growing = GROWING * CELL_SLACK_PX;
        let mut linear = tangent;
        let mut near = Judge::new(&tangent, center, focal_px, growing, SURFACE_TOLERANCE_PX)
            .accepted(simd, &field.field, &left);
        for round in 0..ROUNDS {
            let sums = Sums::new(&field.field, about, &near);
            let Some(better) = sums.fit(about) else { break };
            let tolerance = if round + 1 < ROUNDS { growing } else { CELL_SLACK_PX };
            let judge =
                Judge::new(&better, sums.middle(), focal_px, tolerance, SURFACE_TOLERANCE_PX);
            let grown = judge.accepted(simd, &field.field, &left);
            let same = grown == near;
            (linear, near) = (better, grown);
            if same || near == left {
                break;
            }
        }
        if near[seed[1]] >> seed[0] & 1 == 0 {
            linear = tangent;
            near = Judge::new(&tangent, center, focal_px, CELL_SLACK_PX, SURFACE_TOLERANCE_PX)
                .accepted(simd, &field.field, &left);
            near[seed[1]] |= 1 << seed[0];
        }
        for y in 0..TILE {
            left[y] &= !near[y];
        }
        let judge =
            Judge::new(&linear, center, focal_px, NEIGHBOURS * CELL_SLACK_PX, SURFACE_TOLERANCE_PX);
        let known = judge.accepted(simd, &field.field, &shown);
        out.push(Group { rows: near, known, linear });
    }
}

/// The middle of the longest run of pixels in a row.
fn seed(mask: &Mask) -> Option<[usize; 2]> {
    let mut best = (0, 0, 0);
    for (y, &bits) in mask.iter().enumerate().filter(|(_, bits)| **bits != 0) {
        let (mut rest, mut from) = (bits, 0);
        while rest != 0 {
            let gap = rest.trailing_zeros();
            let run = (!(rest >> gap)).trailing_zeros().min(32 - gap);
            if run > best.0 {
                best = (run, from + gap + run / 2, y);
            }
            from += gap + run;
            rest = if gap + run < 32 { rest >> (gap + run) } else { 0 };
        }
    }
    (best.0 > 0).then_some([best.1 as usize, best.2])
}

impl Group {
    fn patch(&self, origin: [u32; 2], field: &RayField) -> Patch {
        let all = self.rows.iter().fold(0, |all, row| all | row);
        let used = |row: &u32| *row != 0;
        let first = self.rows.iter().position(used).unwrap_or(0);
        let last = self.rows.iter().rposition(used).unwrap_or(first);
        let some = first * TILE + self.rows[first].trailing_zeros() as usize;
        Patch {
            triangle: MirrorTriangleIndex(field.ids[some]),
            corners: [DVec3::X, DVec3::Y, DVec3::Z],
            rect: PixelRect {
                min: [origin[0] + all.trailing_zeros(), origin[1] + index(first)],
                max: [origin[0] + 32 - all.leading_zeros(), origin[1] + index(last) + 1],
            },
            pixels: self.rows.iter().map(|row| row.count_ones()).sum(),
            cell: None,
            own: None,
        }
    }

    /// The group's camera, and the inverse depth of where its rays start.
    fn view<'a>(&self, eye: &Eye, origin: [u32; 2], patch: &'a Patch) -> (View<'a>, Plane) {
        let outline = outline(&self.rows, origin);
        let inverse = inverse_depth(&self.linear, origin, &outline);
        let [a, b, _, c] = outline.grown(DVec2::ZERO);
        let rays = construction_rays(eye, origin, [a, b, c], &self.linear, &inverse);
        let most = farthest(&self.linear, outline.along);
        (View { patch, rays, front: [1.0; 3], outline: Some((outline, most)) }, inverse)
    }

    /// The direction of the exact ray of a pixel, less that of the group's camera.
    #[expect(clippy::cast_possible_truncation, reason = "rounded once")]
    fn deviation(
        &self,
        field: &RayField,
        origin: [u32; 2],
        [x, y]: [usize; 2],
        inverse: &Plane,
    ) -> [f32; 3] {
        let (cx, cy) = (centre(x), centre(y));
        let px = middle(origin) + DVec2::new(f64::from(cx), f64::from(cy));
        let depth = (1.0 / inverse.at(px)) as f32;
        let exact = field.at([x, y]);
        [0, 1, 2].map(|k| (exact[k] - self.linear.get(k, cx, cy)) * depth)
    }
}

impl Cells {
    fn push(
        &mut self,
        frame: FrameInput<'_>,
        top: &Top,
        origin: [u32; 2],
        field: &RayField,
        group: &Group,
        settings: CameraSettings,
    ) {
        let mut patch = group.patch(origin, field);
        patch.own = Some(OwnPixels {
            first_row: index(self.pixels.rows.len()),
            first_pixel: index(self.pixels.deviations.len()),
        });
        let cameras = self.cameras.len();
        let (view, inverse) = group.view(frame.eye, origin, &patch);
        of_view(frame, top, &view, index(self.patches.len()), settings, &mut self.cameras);
        if self.cameras.len() == cameras {
            return;
        }
        self.patches.push(patch);
        let [from, first] = [0, 1].map(|k| (patch.rect.min[k] - origin[k]) as usize);
        let [to, end] = [0, 1].map(|k| (patch.rect.max[k] - origin[k]) as usize);
        self.pixels.rows.extend(group.rows[first..end].iter().map(|row| row >> from));
        for y in first..end {
            let begin = self.pixels.deviations.len();
            let mut last_known = [0.0; 3];
            for x in from..to {
                if (group.rows[y] | group.known[y]) >> x & 1 != 0 {
                    last_known = group.deviation(field, origin, [x, y], &inverse);
                    if x > 0 && (group.rows[y] | group.known[y]) << (32 - x) == 0 {
                        self.pixels.deviations[begin..].fill(last_known);
                    }
                }
                self.pixels.deviations.push(last_known);
            }
        }
    }

    fn append(&mut self, other: Self) {
        let (patches, rows) = (index(self.patches.len()), index(self.pixels.rows.len()));
        let pixels = index(self.pixels.deviations.len());
        let cameras = other
            .cameras
            .into_iter()
            .map(|camera| CameraInstance { patch: camera.patch + patches, ..camera });
        self.cameras.extend(cameras);
        self.patches.extend(other.patches.into_iter().map(|patch| Patch {
            own: patch.own.map(|own| OwnPixels {
                first_row: own.first_row + rows,
                first_pixel: own.first_pixel + pixels,
            }),
            ..patch
        }));
        self.pixels.rows.extend(other.pixels.rows);
        self.pixels.deviations.extend(other.pixels.deviations);
    }
}

/// How much less than in its middle the inverse depth may be anywhere about a cell.
const LEAST_INVERSE: f64 = 0.25;
/// Pixels around a cell in which its camera is used.
const AROUND_PX: f64 = 24.0;

/// A linear function of picture positions: its value at one and its slope there.
struct Plane {
    center: DVec2,
    value: f64,
    slope: DVec2,
}

impl Plane {
    fn at(&self, px: DVec2) -> f64 {
        self.value + self.slope.dot(px - self.center)
    }
}

/// The inverse depth of a cell's rays, made so flat that it stays positive all around the cell.
fn inverse_depth(linear: &Linear<4>, origin: [u32; 2], outline: &Outline) -> Plane {
    let center = outline.center;
    let p = center - middle(origin);
    let slope = DVec2::new(f64::from(linear.right[3]), f64::from(linear.down[3]));
    let value = f64::from(linear.at[3]) + slope.dot(p);
    let around = AROUND_PX + outline.half.element_sum();
    let share = ((1.0 - LEAST_INVERSE) * value / (slope.length() * around)).min(1.0);
    Plane { center, value, slope: slope * share }
}

/// A rectangle along the main direction of the pixels' spread that holds them all.
fn outline(mask: &Mask, origin: [u32; 2]) -> Outline {
    let rows = || (0..TILE).filter(|&y| mask[y] != 0);
    let (mut n, mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for row in rows() {
        let cy = f64::from(centre(row));
        for i in (0..TILE).filter(|i| mask[row] >> i & 1 != 0) {
            let cx = f64::from(centre(i));
            n += 1.0;
            x += cx;
            y += cy;
            xx += cx * cx;
            xy += cx * cy;
            yy += cy * cy;
        }
    }
    let (xx, xy, yy) =
        (xx / n - x * x / (n * n), xy / n - x * y / (n * n), yy / n - y * y / (n * n));
    // Nearly round ones lie along the rows.
    let apart = ((xx - yy).powi(2) + 4.0 * xy * xy).sqrt();
    let along = if apart < 0.3 * (xx + yy) {
        DVec2::X
    } else {
        DVec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy))
    };
    let across = along.perp();
    let (mut least, mut most) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for row in rows() {
        let cy = f64::from(centre(row));
        for i in [mask[row].trailing_zeros(), 31 - mask[row].leading_zeros()] {
            let p = DVec2::new(f64::from(centre(i as usize)), cy);
            let at = DVec2::new(p.dot(along), p.dot(across));
            (least, most) = (least.min(at), most.max(at));
        }
    }
    let mid = 0.5 * (least + most);
    // Pixels reach half a pixel about their centres, along the rows.
    let pixel = 0.5 * (along.x.abs() + along.y.abs());
    Outline {
        center: middle(origin) + along * mid.x + across * mid.y,
        along,
        half: 0.5 * (most - least) + pixel,
    }
}

/// How many pixels beyond its own a cell's rays may be continued along a direction and across it: they turn by so much
/// at most (untuned).
const MOST_TURN: f64 = 0.5;

fn farthest(linear: &Linear<4>, along: DVec2) -> DVec2 {
    let [r0, r1, r2, _] = linear.right.map(f64::from);
    let [b0, b1, b2, _] = linear.down.map(f64::from);
    let (right, down) = (DVec3::new(r0, r1, r2), DVec3::new(b0, b1, b2));
    let turn = |direction: DVec2| (right * direction.x + down * direction.y).length();
    let most = DVec2::new(MOST_TURN / turn(along), MOST_TURN / turn(along.perp()));
    most.max(DVec2::ONE)
}

fn middle(origin: [u32; 2]) -> DVec2 {
    DVec2::from_array(origin.map(f64::from)) + 0.5 * TILE as f64
}

fn construction_rays(
    eye: &Eye,
    origin: [u32; 2],
    corners_px: [DVec2; 3],
    linear: &Linear<4>,
    inverse: &Plane,
) -> Rays {
    let middle = middle(origin);
    let at = |k: usize, p: DVec2| {
        f64::from(linear.at[k]) + p.x * f64::from(linear.right[k]) + p.y * f64::from(linear.down[k])
    };
    let position = eye.position.as_dvec3();
    let (right, up, forward) = (eye.right.as_dvec3(), eye.up.as_dvec3(), eye.forward.as_dvec3());
    let focal = f64::from(eye.focal_px);
    let (cx, cy) = (0.5 * f64::from(eye.size.width), 0.5 * f64::from(eye.size.height));
    let rays = corners_px.map(|px| {
        let depth = 1.0 / inverse.at(px);
        let view = forward + right * ((px.x - cx) / focal) - up * ((px.y - cy) / focal);
        let p = px - middle;
        (position + view * depth, DVec3::new(at(0, p), at(1, p), at(2, p)) * depth)
    });
    Rays { origins: rays.map(|r| r.0), directions: rays.map(|r| r.1) }
}
