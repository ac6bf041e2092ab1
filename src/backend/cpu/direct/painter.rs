//! Sorts what some rows show by object, then paints it in lanes.

use std::ops::Range;

use fearless_simd::{Simd, f32x16};
use glam::{DVec2, Vec3};

use super::spots::{Colors, LANES, Met, SkySpots, Spot, Spots, color};
use super::{Appearance, DirectView, clamped};
use crate::geometry::lanes::{Real, Vector, dot};
use crate::visibility::{NONE_ID, RayWeights, SAMPLE_EIGHTHS, SAMPLES, SurfaceMesh};

/// What one sample shows.
#[derive(Clone, Copy, PartialEq)]
struct Seen {
    /// `None` for the sky.
    surface: Option<usize>,
    id: u32,
}

/// Samples of a pixel, one bit each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group(pub(super) usize);

/// For each [`Group`]: the mean position of its samples in the pixel (px), and the sample nearest to it.
pub(super) const MIDDLES: [([f64; 2], usize); 1 << SAMPLES] = {
    let mut middles = [([0.0; 2], 0); 1 << SAMPLES];
    let mut group = 1;
    while group < middles.len() {
        // The mean is in units of 1 / count of an eighth, to stay in integers.
        let (mut x, mut y, mut count) = (0_i32, 0_i32, 0_i32);
        let mut s = 0;
        while s < SAMPLES {
            if group >> s & 1 == 1 {
                x += SAMPLE_EIGHTHS[s][0] as i32;
                y += SAMPLE_EIGHTHS[s][1] as i32;
                count += 1;
            }
            s += 1;
        }
        let (mut nearest, mut least) = (0, i32::MAX);
        s = 0;
        while s < SAMPLES {
            let dx = SAMPLE_EIGHTHS[s][0] as i32 * count - x;
            let dy = SAMPLE_EIGHTHS[s][1] as i32 * count - y;
            if group >> s & 1 == 1 && dx * dx + dy * dy < least {
                (nearest, least) = (s, dx * dx + dy * dy);
            }
            s += 1;
        }
        let unit = 8.0 * count as f64;
        middles[group] = ([x as f64 / unit, y as f64 / unit], nearest);
        group += 1;
    }
    middles
};

/// All samples of a pixel.
const ALL: Group = Group((1 << SAMPLES) - 1);

impl Group {
    fn of(seen: &[Seen; SAMPLES], belongs: impl Fn(Seen) -> bool) -> Self {
        Self((0..SAMPLES).fold(0, |bits, s| bits | usize::from(belongs(seen[s])) << s))
    }

    pub(super) fn count(self) -> f32 {
        self.0.count_ones() as f32
    }

    /// The sample nearest to that.
    fn middle_sample(self) -> usize {
        MIDDLES[self.0].1
    }
}

/// Computes some rows.
pub(super) struct Painter<'a, A> {
    view: &'a DirectView<'a>,
    appearance: &'a A,
    /// Index of the first pixel.
    first: usize,
    band: &'a mut [[f32; 3]],
    /// The surface met last, and its ids: neighbouring samples mostly show the same.
    surface: (Range<u32>, Option<usize>),
    sky: SkySpots,
    scratch: &'a mut Scratch,
}

/// Memory that the bands of a thread share.
#[derive(Default)]
pub(super) struct Scratch {
    /// What is seen of each object.
    spots: Vec<Vec<Spot>>,
    /// The triangles of an object that were met last, each in the place that its index gives it: the next row mostly shows
    /// the same ones.
    met: Vec<Option<Met>>,
}

/// A power of two.
const MET: usize = 256;

impl<'a, A: Appearance> Painter<'a, A> {
    /// Of the rows from the pixel `first` on, which become black.
    pub(super) fn new(
        view: &'a DirectView<'a>,
        appearance: &'a A,
        first: usize,
        band: &'a mut [[f32; 3]],
        scratch: &'a mut Scratch,
    ) -> Self {
        band.fill([0.0; 3]);
        scratch.spots.resize_with(view.objects.len(), Vec::new);
        let sky = SkySpots::default();
        Self { view, appearance, first, band, surface: (0..0, None), sky, scratch }
    }

    /// Paints the rows, which are black.
    #[inline(always)]
    pub(super) fn paint<S: Simd>(&mut self, simd: S) {
        let visibility = self.view.visibility;
        let width = visibility.size.width as usize;
        for start in (0..self.band.len()).step_by(width.max(1)) {
            let samples = &visibility.samples[self.first + start..][..width];
            let mut x = 0;
            while x < width {
                let ids = samples[x];
                if ids != [ids[0]; SAMPLES] {
                    self.pixel(simd, start + x, ids);
                    x += 1;
                    continue;
                }
                let end = x + samples[x..].iter().take_while(|next| **next == ids).count();
                self.uniform(simd, start + x..start + end, ids[0]);
                x = end;
            }
        }
        self.paint_sky(simd);
        for object in 0..self.scratch.spots.len() {
            self.paint_object(simd, object);
        }
    }

    /// Pixels of a row of which all samples show the same.
    #[inline(always)]
    fn uniform<S: Simd>(&mut self, simd: S, pixels: Range<usize>, id: u32) {
        let visibility = self.view.visibility;
        if id < visibility.mirror_triangles() {
            for i in pixels {
                self.band[i] = self.displayed(self.view.reflection[self.first + i]).to_array();
            }
        } else if id == NONE_ID {
            for i in pixels {
                self.push_sky(simd, i, ALL);
            }
        } else {
            let surface = self.surface_of(id);
            self.push(surface, id, pixels, ALL);
        }
    }

    /// A pixel of which the samples show different things.
    #[inline(always)]
    fn pixel<S: Simd>(&mut self, simd: S, i: usize, ids: [u32; SAMPLES]) {
        let visibility = self.view.visibility;
        let at = self.first + i;
        let surface = self.surface_of(ids[0]);
        if let Some(object) = surface
            && object >= visibility.mirrors()
            && ids.iter().all(|id| self.surface.0.contains(id))
        {
            self.push_object(object, &ids.map(|id| Seen { surface, id }), i, ALL);
            return;
        }
        let seen = ids.map(|id| Seen { surface: self.surface_of(id), id });
        let mut done = 0;
        for (sample, Seen { surface, id }) in seen.into_iter().enumerate() {
            if done >> sample & 1 == 1 {
                continue;
            }
            let group = Group::of(&seen, |other| other.surface == surface);
            done |= group.0;
            match surface {
                None => self.push_sky(simd, i, group),
                Some(mirror) if mirror < visibility.mirrors() => {
                    let value = if seen[0].surface == surface {
                        self.displayed(self.view.reflection[at])
                    } else if let Some(borrowed) = self.neighbours(at, mirror) {
                        borrowed
                    } else {
                        self.reflected_sky(self.middle_px(i, group), mirror, id)
                    };
                    self.add(i, value * group.count());
                }
                Some(object) => self.push_object(object, &seen, i, group),
            }
        }
    }

    /// Whether all triangles of a surface that a pixel shows have a corner in common with one of them: then that one, continued,
    /// shows what the others show. Where a mesh has an edge, its sides have corners of their own.
    #[inline(always)]
    fn goes_on(&self, surface: usize, middle: u32, seen: &[Seen; SAMPLES]) -> bool {
        let visibility = self.view.visibility;
        let triangles = self.view.objects[surface - visibility.mirrors()].triangles;
        let first = visibility.ids(surface).start;
        let own = triangles[(middle - first) as usize];
        seen.iter().all(|other| {
            other.surface != Some(surface)
                || other.id == middle
                || triangles[(other.id - first) as usize].iter().any(|corner| own.contains(corner))
        })
    }

    /// Remembers what a group of a pixel's samples shows of an object: as one, or triangle by triangle.
    #[inline(always)]
    fn push_object(&mut self, object: usize, seen: &[Seen; SAMPLES], i: usize, group: Group) {
        let middle = seen[group.middle_sample()].id;
        if !self.appearance.varies(object - self.view.visibility.mirrors())
            || self.goes_on(object, middle, seen)
        {
            self.push(Some(object), middle, i..i + 1, group);
            return;
        }
        let mut rest = group.0;
        while rest != 0 {
            let id = seen[rest.trailing_zeros() as usize].id;
            let group = Group::of(seen, |other| other.id == id);
            rest &= !group.0;
            self.push(Some(object), id, i..i + 1, group);
        }
    }

    /// The surface, mirrors first, that an id is of.
    #[inline(always)]
    fn surface_of(&mut self, id: u32) -> Option<usize> {
        if !self.surface.0.contains(&id) {
            let (surface, _) = self.view.visibility.locate(id)?;
            self.surface = (self.view.visibility.ids(surface), Some(surface));
        }
        self.surface.1
    }

    /// Adds the sum of some samples to a pixel.
    #[inline(always)]
    fn add(&mut self, i: usize, sum: Vec3) {
        self.band[i] = (Vec3::from(self.band[i]) + sum * (1.0 / SAMPLES as f32)).to_array();
    }

    /// Remembers what pixels show of an object.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "a band has fewer than 2^32 pixels")]
    fn push(&mut self, surface: Option<usize>, id: u32, pixels: Range<usize>, samples: Group) {
        let Some(surface) = surface else { return };
        let visibility = self.view.visibility;
        let first = visibility.ids(surface).start;
        self.scratch.spots[surface - visibility.mirrors()].push(Spot {
            triangle: id - first,
            pixel: pixels.start as u32,
            pixels: pixels.len() as u32,
            samples,
        });
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "a band has fewer than 2^32 pixels")]
    fn push_sky<S: Simd>(&mut self, simd: S, i: usize, group: Group) {
        if self.sky.len == LANES {
            self.paint_sky(simd);
        }
        let eye = self.view.eye;
        let middle = MIDDLES[group.0].0;
        let [x, y] = self.place(i);
        let lane = self.sky.len;
        let place = |at: usize, middle: f64, size: u32| {
            (at as f32 + (middle as f32 - 0.5 * size as f32)) / eye.focal_px
        };
        self.sky.place[0][lane] = place(x, middle[0], eye.size.width);
        self.sky.place[1][lane] = place(y, middle[1], eye.size.height);
        self.sky.count[lane] = group.count();
        self.sky.pixel[lane] = i as u32;
        self.sky.len += 1;
    }

    /// Adds the sky that waits for it.
    #[inline(always)]
    fn paint_sky<S: Simd>(&mut self, simd: S) {
        let eye = self.view.eye;
        let mut out: Colors = [[0.0; LANES]; 3];
        for at in (0..self.sky.len).step_by(16) {
            let x = f32x16::load(simd, &self.sky.place[0][at..]);
            let y = f32x16::load(simd, &self.sky.place[1][at..]);
            let ray = [
                x * eye.right[0] - y * eye.up[0] + eye.forward[0],
                x * eye.right[1] - y * eye.up[1] + eye.forward[1],
                x * eye.right[2] - y * eye.up[2] + eye.forward[2],
            ];
            let length = Real::sqrt(dot(ray, ray));
            let scale = x.splat(1.0) / length;
            let direction = [ray[0] * scale, ray[1] * scale, ray[2] * scale];
            let sky = self.appearance.sky_in(simd, direction);
            let count = f32x16::load(simd, &self.sky.count[at..]);
            for k in 0..3 {
                (clamped(sky[k], self.view.white) * count).store(&mut out[k][at..]);
            }
        }
        for lane in 0..self.sky.len {
            self.add(self.sky.pixel[lane] as usize, color(&out, lane));
        }
        self.sky.len = 0;
    }

    /// Adds all that is seen of an object.
    #[inline(always)]
    fn paint_object<S: Simd>(&mut self, simd: S, object: usize) {
        let list = std::mem::take(&mut self.scratch.spots[object]);
        if list.is_empty() {
            return;
        }
        let mut met = std::mem::take(&mut self.scratch.met);
        met.clear();
        met.resize_with(MET, || None);
        let view = self.view;
        let mesh = &view.objects[object];
        let mut spots = Spots::default();
        let meet = |triangle: u32| Met {
            triangle,
            rays: RayWeights::new(view.eye, mesh.corners(triangle as usize)),
            values: self.appearance.corner_values(object, triangle as usize),
        };
        for spot in &list {
            let place = &mut met[spot.triangle as usize % MET];
            if place.as_ref().is_none_or(|old| old.triangle != spot.triangle) {
                *place = None;
            }
            let shown = place.get_or_insert_with(|| meet(spot.triangle));
            let shares = shown.rays.shares_about(self.middle_px(spot.pixel as usize, ALL));
            let mut ahead = 0;
            while ahead < spot.pixels {
                ahead += spots.push(spot, &shares, &shown.values, ahead);
                if spots.len == LANES {
                    self.paint_spots(simd, mesh, object, &mut spots);
                }
            }
        }
        self.paint_spots(simd, mesh, object, &mut spots);
        self.scratch.met = met;
        self.scratch.spots[object] = list;
        self.scratch.spots[object].clear();
    }

    #[inline(always)]
    fn paint_spots<S: Simd>(
        &mut self,
        simd: S,
        mesh: &SurfaceMesh,
        object: usize,
        spots: &mut Spots,
    ) {
        let mut out: Colors = [[0.0; LANES]; 3];
        self.appearance.paint(simd, mesh, object, spots, self.view.white, &mut out);
        for lane in 0..spots.len {
            self.add(spots.pixel[lane] as usize, color(&out, lane));
        }
        spots.len = 0;
    }

    /// Column and row of a pixel of the band.
    #[inline(always)]
    fn place(&self, i: usize) -> [usize; 2] {
        let width = self.view.visibility.size.width as usize;
        [(self.first + i) % width, (self.first + i) / width]
    }

    /// Mean position of a group's samples of a pixel of the band, px.
    #[inline(always)]
    fn middle_px(&self, i: usize, group: Group) -> DVec2 {
        let [x, y] = self.place(i);
        DVec2::from(MIDDLES[group.0].0) + DVec2::new(x as f64, y as f64)
    }

    fn displayed(&self, radiance: Vec3) -> Vec3 {
        radiance.clamp(Vec3::ZERO, Vec3::splat(self.view.white))
    }

    /// The unit direction of the view ray.
    fn direction(&self, px: DVec2) -> Vec3 {
        self.view.eye.ray_through_px(px.as_vec2()).normalize_or(self.view.eye.forward)
    }

    /// The mean of the reflections at those of the neighbouring pixels that show the mirror at their
    /// centres.
    fn neighbours(&self, at: usize, mirror: usize) -> Option<Vec3> {
        let visibility = self.view.visibility;
        let [x, y] = self.place(at - self.first);
        let (width, height) = (visibility.size.width as usize, visibility.size.height as usize);
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for row in y.saturating_sub(1)..(y + 2).min(height) {
            for at in row * width + x.saturating_sub(1)..row * width + (x + 2).min(width) {
                if visibility.ids(mirror).contains(&visibility.mirror_ids[at]) {
                    sum += self.displayed(self.view.reflection[at]);
                    count += 1.0;
                }
            }
        }
        (count > 0.0).then(|| sum / count)
    }

    /// What the flat triangle would reflect if there were nothing but sky.
    fn reflected_sky(&self, px: DVec2, mirror: usize, id: u32) -> Vec3 {
        let triangle = (id - self.view.visibility.ids(mirror).start) as usize;
        let direction = self.direction(px);
        let [a, b, c] = self.view.mirrors[mirror].corners(triangle);
        // Relative to their size, since products of small f32 lengths underflow.
        let [ab, ac] = [b - a, c - a].map(|side| side.normalize_or_zero());
        let normal = ab.cross(ac).normalize_or(-direction);
        let reflected = direction.reflect(normal);
        self.displayed(self.appearance.sky(reflected) * self.appearance.tint(mirror))
    }
}
