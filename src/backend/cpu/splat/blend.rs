//! Ellipses to pixels. Every splat covers parts of pixels; from the nearest on, each pixel takes them until it is full.
//! So a surface that covers it in part lets through what lies behind it, be it another surface or the environment.

use fearless_simd::{Simd, f32x8};
use glam::{Vec3, Vec4};

use super::EMPTY;
use super::hits::{DEPTH_RANGE, FORM, HALF, Hits, MIDDLE, WEIGHT};
use crate::geometry::lanes::{Real, Vector};
use crate::plan::kernel::{
    CLOSING, CLOSING_TWO, GAIN, LARGE, SAME_SURFACE_SHARE, SLOPE, SURROUNDED, WHOLE, closed,
};

/// Splats drawn before it is asked whether any pixel is still open (untuned).
const UNTIL_FULL: usize = 32;

/// Values a pixel has, each in a list of its own; the last two: where the splats of the front lie about the pixel, in their own
/// size, times what they cover.
const PLANES: usize = 10;
/// How full a pixel is.
const FULL: usize = 3;
/// The part of that which shows objects; times their radiance in the first three planes.
const SHOWN: usize = 4;
/// Depth of the nearest splat.
const NEAR: usize = 5;
/// How full it was when the first splat of a farther surface came; more than 1: none did.
const FRONT: usize = 6;
/// Index of the nearest splat that shows an object, as bits: as a number it would be exact below 2^24 only.
const FIRST: usize = 7;

/// One patch's pixels, by slot of its tile.
#[derive(Default)]
pub(super) struct Layers {
    /// Splats from the nearest on: depth and index.
    order: Vec<u64>,
    /// Radiance by splat, gathered at once: one after the other these accesses would each be waited for.
    colors: Vec<Vec3>,
    planes: [Vec<f32>; PLANES],
    /// First and last column to be drawn, by row; reversed where there is none.
    spans: Vec<[f32; 2]>,
    stride: usize,
}

/// What lands on a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Blended {
    /// Radiance times coverage, and coverage.
    pub(super) value: Vec4,
    /// The nearest splat.
    pub(super) first: usize,
}

/// Those columns of a row that a splat covers.
struct Row {
    /// Columns from the splat's middle to the centre of the first pixel.
    dx: f32,
    dy: f32,
    slope: f32,
    rest: f32,
    /// Slot of the first pixel, and how many there are.
    at: usize,
    count: f32,
}

/// Two slots on both sides of a gap.
struct Across {
    a: usize,
    b: usize,
    /// The gap's other slot, if it is two wide.
    between: Option<usize>,
    /// How far from `a` to `b` the gap's own slot lies.
    share: f32,
}

impl Layers {
    /// Draws what was hit into a tile with rows of `stride` slots, of which those that are `EMPTY` are taken. Surfels
    /// from `first_hider` on show nothing.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        &mut self,
        simd: S,
        hits: &Hits,
        radiance: &[Vec3],
        first_hider: u32,
        stride: usize,
        tile: &[u64],
    ) {
        self.begin(stride, tile);
        self.order.clear();
        self.colors.clear();
        for (depth, i) in hits.depth[..hits.len].iter().zip(0u32..) {
            self.order.push(u64::from(depth.to_bits()) << 32 | u64::from(i));
            let surfel = hits.surfel[i as usize];
            self.colors.push(radiance[surfel as usize]);
        }
        self.order.sort_unstable();
        let mut last = None;
        for n in 0..self.order.len() {
            if n % UNTIL_FULL == 0 && n > 0 && self.is_full(simd) {
                break;
            }
            #[expect(clippy::cast_possible_truncation, reason = "the low half")]
            let i = self.order[n] as u32 as usize;
            // Two images of a point at one place, on the caustic, are one.
            let one = (hits.depth[i].to_bits(), hits.surfel[i]);
            if last == Some(one) {
                continue;
            }
            last = Some(one);
            let shows = hits.surfel[i] < first_hider;
            self.splat(simd, hits, i, self.colors[i], shows);
        }
        self.close(simd);
    }

    /// Closes the gaps of surfaces that have nothing behind them.
    #[inline(always)]
    fn close<S: Simd>(&mut self, simd: S) {
        let [red, green, blue, full, shown, _, front, _, about_x, about_y] = &mut self.planes;
        let zero: f32x8<S> = Vector::broadcast(simd, 0.0);
        let one: f32x8<S> = Vector::broadcast(simd, 1.0);
        let slots = full.len() / 8 * 8;
        for at in (0..slots).step_by(8) {
            let was: f32x8<S> = Vector::load(simd, &full[at..]);
            let so_far: f32x8<S> = Vector::load(simd, &front[at..]);
            let open = one.lt(so_far) & zero.lt(was) & was.lt(Real::splat(one, WHOLE));
            if f32x8::<S>::any(open) {
                let about: [f32x8<S>; 2] =
                    [Vector::load(simd, &about_x[at..]), Vector::load(simd, &about_y[at..])];
                let whole = Real::select(open, closed(was, about), was);
                Vector::store(whole, &mut full[at..]);
                let scale = Real::select(open, whole / was, one);
                for plane in [&mut *red, &mut *green, &mut *blue, &mut *shown] {
                    let value: f32x8<S> = Vector::load(simd, &plane[at..]);
                    Vector::store(value * scale, &mut plane[at..]);
                }
            }
        }
    }

    fn begin(&mut self, stride: usize, tile: &[u64]) {
        self.stride = stride;
        // Vectors may reach beyond the last slot.
        let room = tile.len() + 8;
        for (plane, list) in self.planes.iter_mut().enumerate() {
            list.clear();
            list.resize(room, if plane == FRONT { 2.0 } else { 0.0 });
        }
        for (full, &key) in self.planes[FULL].iter_mut().zip(tile) {
            *full = if key == EMPTY { 0.0 } else { 1.0 };
        }
        self.planes[FULL][tile.len()..].fill(1.0);
        self.spans.clear();
        for row in tile.chunks_exact(stride) {
            let own = |key: &u64| *key == EMPTY;
            let first = row.iter().position(own).unwrap_or(stride);
            let last = row.iter().rposition(own).unwrap_or(0);
            self.spans.push([first as f32, last as f32]);
        }
    }

    #[inline(always)]
    fn is_full<S: Simd>(&self, simd: S) -> bool {
        let mut least: f32x8<S> = Vector::broadcast(simd, 1.0);
        for eight in self.planes[FULL].chunks_exact(8) {
            least = least.min(Vector::load(simd, eight));
        }
        !f32x8::<S>::any(least.lt(Vector::broadcast(simd, WHOLE)))
    }

    #[inline(always)]
    fn splat<S: Simd>(&mut self, simd: S, hits: &Hits, i: usize, color: Vec3, shows: bool) {
        let e = &hits.ellipse;
        let (x, y) = (e[MIDDLE][i], e[MIDDLE + 1][i]);
        let (a, b, c) = (e[FORM][i], e[FORM + 1][i], e[FORM + 2][i]);
        let (wide, high) = (e[HALF][i], e[HALF + 1][i]);
        let inverse = 1.0 / a;
        // Centres of pixels lie half a pixel behind their index. Not negative: casts truncate, which is floor.
        let mut row = (y - high - 0.5).ceil().max(0.0);
        let last = (y + high - 0.5).min(self.spans.len() as f32 - 1.0);
        while row <= last {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "see above"
            )]
            let index = row as usize;
            let [left, right] = self.spans[index];
            let dy = row + 0.5 - y;
            row += 1.0;
            if x + wide < left || right + 1.0 < x - wide {
                continue;
            }
            let (slope, rest) = (2.0 * b * dy, c * dy * dy);
            // Between the roots of 1 = a dx² + slope dx + rest.
            let middle = -0.5 * slope * inverse;
            let half = ((1.0 - rest) * inverse + middle * middle).max(0.0).sqrt();
            let column = (x + middle - half - 0.5).ceil().max(left);
            let end = (x + middle + half - 0.5).min(right);
            if column <= end {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "see above"
                )]
                let at = index * self.stride + column as usize;
                let row =
                    Row { dx: column + 0.5 - x, dy, slope, rest, at, count: end - column + 1.0 };
                self.row(simd, hits, i, a, &row, color, shows);
            }
        }
    }

    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the innermost loop: all of it in registers")]
    fn row<S: Simd>(
        &mut self,
        simd: S,
        hits: &Hits,
        i: usize,
        a: f32,
        row: &Row,
        color: Vec3,
        shows: bool,
    ) {
        const COLUMNS: [f32; 8] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        let [red, green, blue, full, shown, near, front, first, about_x, about_y] =
            &mut self.planes;
        let depth = hits.depth[i];
        let columns: f32x8<S> = Vector::load(simd, &COLUMNS);
        let zero: f32x8<S> = Vector::broadcast(simd, 0.0);
        let one: f32x8<S> = Vector::broadcast(simd, 1.0);
        let weight = f32x8::<S>::broadcast(simd, hits.ellipse[WEIGHT][i] * GAIN);
        let farther = f32x8::<S>::broadcast(simd, depth - hits.ellipse[DEPTH_RANGE][i]);
        let depth = f32x8::<S>::broadcast(simd, depth);
        let (wide, high) = (hits.ellipse[HALF][i], hits.ellipse[HALF + 1][i]);
        let (per_wide, per_high) = (1.0 / wide, 1.0 / high);
        // What is small counts as if it lay beside the pixel: it closes nothing.
        let small = ((LARGE[1] - wide.min(high)) / (LARGE[1] - LARGE[0])).clamp(0.0, 1.0);
        let mut done = 0.0;
        let mut at = row.at;
        while done < row.count {
            let dx = columns + (row.dx + done);
            let inside = (one - (dx * (dx * a + row.slope) + row.rest)).max(zero);
            let mut was: f32x8<S> = Vector::load(simd, &full[at..]);
            let kernel = inside * inside * weight;
            let mut part = kernel.min(one - was);
            let mut mine = Real::lt(columns + done, Real::splat(one, row.count)) & zero.lt(part);
            if f32x8::<S>::any(mine) {
                let mut nearest: f32x8<S> = Vector::load(simd, &near[at..]);
                let mut so_far: f32x8<S> = Vector::load(simd, &front[at..]);
                let [ax, ay]: [f32x8<S>; 2] =
                    [Vector::load(simd, &about_x[at..]), Vector::load(simd, &about_y[at..])];
                let behind = mine & nearest.lt(farther) & one.lt(so_far) & zero.lt(was);
                if f32x8::<S>::any(behind) {
                    let closed = Real::select(behind, closed(was, [ax, ay]), was);
                    let scale = Real::select(behind, closed / was, one);
                    for plane in [&mut *red, &mut *green, &mut *blue, &mut *shown] {
                        let value: f32x8<S> = Vector::load(simd, &plane[at..]);
                        Vector::store(value * scale, &mut plane[at..]);
                    }
                    was = closed;
                    so_far = Real::select(behind, was, so_far);
                    Vector::store(so_far, &mut front[at..]);
                    Vector::store(was, &mut full[at..]);
                    part = kernel.min(one - was);
                    mine &= zero.lt(part);
                }
                part = Real::select(mine, part, zero);
                Vector::store(was + part, &mut full[at..]);
                let fresh = mine & was.le(zero);
                if f32x8::<S>::any(fresh) {
                    nearest = Real::select(fresh, depth, nearest);
                    Vector::store(nearest, &mut near[at..]);
                }
                let of_front = Real::select(one.lt(so_far), part, zero);
                Vector::store(ax + of_front * (dx * per_wide + small), &mut about_x[at..]);
                Vector::store(ay + of_front * (row.dy * per_high), &mut about_y[at..]);
                if shows {
                    let showed: f32x8<S> = Vector::load(simd, &shown[at..]);
                    let unseen = mine & showed.le(zero);
                    if f32x8::<S>::any(unseen) {
                        let was: f32x8<S> = Vector::load(simd, &first[at..]);
                        #[expect(clippy::cast_possible_truncation, reason = "it was 32 bits")]
                        let index = f32x8::<S>::broadcast(simd, f32::from_bits(i as u32));
                        Vector::store(Real::select(unseen, index, was), &mut first[at..]);
                    }
                    Vector::store(showed + part, &mut shown[at..]);
                    let was: f32x8<S> = Vector::load(simd, &red[at..]);
                    Vector::store(was + part * color.x, &mut red[at..]);
                    let was: f32x8<S> = Vector::load(simd, &green[at..]);
                    Vector::store(was + part * color.y, &mut green[at..]);
                    let was: f32x8<S> = Vector::load(simd, &blue[at..]);
                    Vector::store(was + part * color.z, &mut blue[at..]);
                }
            }
            done += 8.0;
            at += 8;
        }
    }

    /// The pairs of slots that a gap at `slot` may lie between: a pixel wide, or two, in its row or its column.
    fn across(&self, slot: usize) -> impl Iterator<Item = Across> {
        // The first slot is the border's: not the patch's, as all beyond.
        let slots = self.planes[FULL].len() - 8;
        let at = move |steps: isize, step: usize| {
            let at = slot.checked_add_signed(steps * step.cast_signed());
            at.filter(|at| *at < slots).unwrap_or(0)
        };
        [1, self.stride].into_iter().flat_map(move |step| {
            let (third, two) = (1.0 / 3.0, 2.0 / 3.0);
            [(-1, 1, None, 0.5), (-1, 2, Some(1), third), (-2, 1, Some(-1), two)].map(
                |(a, b, between, share)| Across {
                    a: at(a, step),
                    b: at(b, step),
                    between: between.map(|c| at(c, step)),
                    share,
                },
            )
        })
    }

    /// The mean of what lies around a slot, if that is one surface with what landed first there: a gap larger than a pixel between
    /// splats. One of the four may be another patch's.
    fn surrounding(&self, slot: usize) -> Option<Vec4> {
        let get = |plane: usize, slot: usize| self.planes[plane][slot];
        let near = get(NEAR, slot);
        let (mut sum, mut own) = (Vec4::ZERO, 0.0);
        for (a, b) in [(slot - 1, slot + 1), (slot - self.stride, slot + self.stride)] {
            let (mut depths, mut count) = ([near; 2], 0.0);
            for (n, depth) in [a, b].into_iter().zip(&mut depths) {
                let value = Vec4::new(get(0, n), get(1, n), get(2, n), get(SHOWN, n));
                if get(FULL, n).min(get(FRONT, n)) < SURROUNDED {
                    return None;
                }
                if get(NEAR, n) > 0.0 {
                    if value.w < SURROUNDED {
                        return None;
                    }
                    (*depth, count) = (get(NEAR, n), count + 1.0);
                    sum += value;
                }
            }
            let slope = if count == 2.0 { (depths[0] - depths[1]).abs() } else { 0.0 };
            let off = (0.5 * (depths[0] + depths[1]) - near).abs();
            if off > SAME_SURFACE_SHARE * near + SLOPE * slope {
                return None;
            }
            own += count;
        }
        (own >= 3.0).then(|| sum / own)
    }

    /// What landed on a slot. Where splats leave a part of the front open between two pixels that show the same
    /// surface, they lie too far apart there: it is closed. Edges stay.
    pub(super) fn at(&self, slot: usize) -> Option<Blended> {
        let get = |plane: usize, slot: usize| self.planes[plane][slot];
        let value =
            |slot: usize| Vec4::new(get(0, slot), get(1, slot), get(2, slot), get(SHOWN, slot));
        let mut own = value(slot);
        if own.w == 0.0 {
            return None;
        }
        let full = get(FULL, slot);
        if full.min(get(FRONT, slot)) < CLOSING
            && let Some(mean) = self.surrounding(slot)
        {
            own = mean;
        }
        if (CLOSING..WHOLE).contains(&full) {
            let mut closed = full;
            for Across { a, b, between, .. } in self.across(slot) {
                if between.is_none_or(|c| get(FULL, c).min(full) >= CLOSING_TWO) {
                    closed = closed.max(get(FULL, a).min(get(FULL, b)));
                }
            }
            own *= closed / full;
        }
        let front = get(FRONT, slot);
        if (CLOSING..WHOLE).contains(&front) {
            let near = get(NEAR, slot);
            let of_front = |slot: usize| get(FRONT, slot).min(get(FULL, slot));
            let mut closed = front;
            let mut mean = own;
            for Across { a, b, between, share } in self.across(slot) {
                let depths = [get(NEAR, a), get(NEAR, b)];
                let off = (depths[0] + (depths[1] - depths[0]) * share - near).abs();
                let alike =
                    off <= SAME_SURFACE_SHARE * near + SLOPE * (depths[0] - depths[1]).abs();
                let covered = of_front(a).min(of_front(b));
                let narrow = between.is_none_or(|c| of_front(c).min(front) >= CLOSING_TWO);
                if covered > closed && alike && narrow {
                    closed = covered;
                    mean = value(a).lerp(value(b), share);
                }
            }
            own = own.lerp(mean, (closed - front) / (1.0 - front));
        }
        let first = get(FIRST, slot).to_bits() as usize;
        Some(Blended { value: own, first })
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;

    use super::super::FOREIGN;
    use super::*;
    use crate::geometry::lanes::simd_level;

    /// A round splat: its middle, radius, weight in the middle and depth; its surfel is its number.
    fn hits(list: &[[f32; 5]]) -> Hits {
        let mut hits = Hits::default();
        hits.reserve(list.len());
        for (i, &[x, y, radius, weight, depth]) in list.iter().enumerate() {
            let form = 1.0 / (radius * radius);
            let values = [x, y, form, 0.0, form, radius, radius, weight, 0.5];
            for (list, value) in hits.ellipse.iter_mut().zip(values) {
                list[i] = value;
            }
            hits.depth[i] = depth;
            hits.surfel[i] = u32::try_from(i).unwrap();
            hits.len += 1;
        }
        hits
    }

    /// Five columns and rows, of which the middle three are the patch's.
    fn tile() -> Vec<u64> {
        let own = |i: usize| (1..4).contains(&(i % 5)) && (1..4).contains(&(i / 5));
        (0..25).map(|i| if own(i) { EMPTY } else { FOREIGN }).collect()
    }

    const SLOT: usize = 12;

    fn draw(list: &[[f32; 5]], radiance: &[Vec3], first_hider: u32) -> Layers {
        let mut layers = Layers::default();
        let (hits, tile) = (hits(list), tile());
        dispatch!(simd_level(), simd => layers.draw(simd, &hits, radiance, first_hider, 5, &tile));
        layers
    }

    const COLORS: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];

    fn is(blended: Option<Blended>, r: f32, g: f32, b: f32, coverage: f32) -> bool {
        blended.unwrap().value.abs_diff_eq(Vec4::new(r, g, b, coverage), 1e-6)
    }

    #[test]
    fn two_images_at_one_place_are_one() {
        let middle = [2.5, 2.5, 1.0, 0.25 / GAIN, 1.0];
        let mut twice = hits(&[middle, middle]);
        let count = |hits: &Hits| {
            let (mut layers, tile) = (Layers::default(), tile());
            dispatch!(simd_level(), simd => layers.draw(simd, hits, &COLORS, 9, 5, &tile));
            layers.at(SLOT).unwrap().value.w
        };
        assert!((count(&twice) - 0.5).abs() < 1e-6, "two surfels are two");
        twice.surfel[1] = 0;
        assert!((count(&twice) - 0.25).abs() < 1e-6);
    }

    #[test]
    fn the_nearest_fill_a_pixel_and_the_rest_shows_through() {
        // A quarter in front, whatever the order; behind it half of one; a third behind both fills the rest.
        let parts = [
            [2.5, 2.5, 0.4, 9.0, 3.0],
            [2.5, 2.5, 0.4, 0.25 / GAIN, 1.0],
            [2.5, 2.5, 0.4, 0.5 / GAIN, 2.0],
        ];
        let layers = draw(&parts, &COLORS, 3);
        assert!(is(layers.at(SLOT), 0.25, 0.25, 0.5, 1.0));
        assert_eq!(layers.at(SLOT).unwrap().first, 1, "the nearest");
        // Alone the front leaves the rest to the environment.
        assert!(is(draw(&parts[1..2], &COLORS, 3).at(SLOT), 0.25, 0.0, 0.0, 0.25));
        // A full front hides all.
        let full = [[2.5, 2.5, 0.4, 2.0, 1.0], [2.5, 2.5, 0.4, 2.0, 2.0]];
        assert!(is(draw(&full, &COLORS, 3).at(SLOT), 1.0, 0.0, 0.0, 1.0));
        assert_eq!(draw(&[], &COLORS, 3).at(SLOT), None);
    }

    #[test]
    fn mirrors_hide_what_is_behind_them_and_show_nothing() {
        // The third is a mirror's: a quarter of the pixel, before, between and behind two objects.
        let mut parts = [
            [2.5, 2.5, 0.4, 0.5 / GAIN, 1.0],
            [2.5, 2.5, 0.4, 9.0, 3.0],
            [2.5, 2.5, 0.4, 0.25 / GAIN, 0.0],
        ];
        for (depth, second) in [(0.5, 0.25), (2.0, 0.25), (4.0, 0.5)] {
            parts[2][4] = depth;
            let layers = draw(&parts, &COLORS, 2);
            assert!(is(layers.at(SLOT), 0.5, second, 0.0, 0.5 + second), "{depth}");
            assert_eq!(layers.at(SLOT).unwrap().first, 0, "a mirror is no object");
        }
        parts[2][3] = 9.0;
        parts[2][4] = 0.5;
        assert_eq!(draw(&parts, &COLORS, 2).at(SLOT), None);
    }

    #[test]
    fn a_splat_covers_what_its_form_says_within_the_patch() {
        let (x, y, radius) = (2.2f32, 2.7f32, 1.9f32);
        let layers = draw(&[[x, y, radius, 0.1, 1.0]], &[Vec3::ONE], 1);
        for row in 0..5 {
            for column in 0..5 {
                let slot = row * 5 + column;
                let (dx, dy) = (column as f32 + 0.5 - x, row as f32 + 0.5 - y);
                let kernel = (1.0 - (dx * dx + dy * dy) / (radius * radius)).max(0.0).powi(2);
                let own = (1..4).contains(&row) && (1..4).contains(&column);
                let expected = if own { 0.1 * GAIN * kernel } else { 1.0 };
                assert!((layers.planes[FULL][slot] - expected).abs() < 1e-6, "{row} {column}");
            }
        }
    }

    #[test]
    fn wide_splats_cover_all_their_columns() {
        // Rows longer than a vector.
        let mut layers = Layers::default();
        let tile = vec![EMPTY; 3 * 40];
        let hits = hits(&[[20.0, 1.5, 19.0, 0.1, 1.0]]);
        dispatch!(simd_level(), simd => layers.draw(simd, &hits, &[Vec3::ONE], 1, 40, &tile));
        for column in 0..40 {
            let dx = column as f32 + 0.5 - 20.0;
            let kernel = (1.0 - dx * dx / (19.0 * 19.0)).max(0.0).powi(2);
            let found = layers.planes[FULL][40 + column];
            assert!((found - 0.1 * GAIN * kernel).abs() < 1e-6, "{column}: {found}");
        }
    }

    /// Layers whose pixels all show red at depth 1, but for the middle one: a part of that, and green behind.
    fn gap(front: f32, behind: f32) -> Layers {
        let mut layers = draw(&[[2.5, 2.5, 90.0, 9.0, 1.0]], &COLORS, 3);
        let mut set = |plane: usize, value: f32| layers.planes[plane][SLOT] = value;
        set(0, front);
        set(1, behind);
        set(FULL, front + behind);
        set(SHOWN, front + behind);
        set(FRONT, if behind > 0.0 { front } else { 2.0 });
        // Its splats lie to the left.
        set(PLANES - 2, front);
        layers
    }

    #[test]
    fn gaps_between_covered_pixels_are_closed_and_edges_stay() {
        let mut layers = gap(0.6, 0.0);
        assert!(is(layers.at(SLOT), 1.0, 0.0, 0.0, 1.0));
        // The right and lower neighbours are open: an edge.
        layers.planes[FULL][SLOT + 1] = 0.0;
        layers.planes[FULL][SLOT + 5] = 0.0;
        assert!(is(layers.at(SLOT), 0.6, 0.0, 0.0, 0.6));
        // What is nearly open stays so.
        let mut layers = gap(0.1, 0.0);
        layers.planes[FULL][SLOT + 5] = 0.8;
        assert!(is(layers.at(SLOT), 0.1, 0.0, 0.0, 0.1));
    }

    #[test]
    fn a_gap_in_the_middle_of_a_surface_shows_what_is_around_it() {
        for behind in [0.0, 0.9] {
            assert!(is(gap(0.1, behind).at(SLOT), 1.0, 0.0, 0.0, 1.0));
            // One neighbour may be another patch's, two not.
            let foreign = |count: usize| {
                let mut layers = gap(0.1, behind);
                for slot in [SLOT + 1, SLOT + 5].into_iter().take(count) {
                    for plane in [0, SHOWN, NEAR] {
                        layers.planes[plane][slot] = 0.0;
                    }
                }
                layers.at(SLOT)
            };
            assert!(is(foreign(1), 1.0, 0.0, 0.0, 1.0));
            assert!(is(foreign(2), 0.1, behind, 0.0, 0.1 + behind));
            // Something small before the surface, or a neighbour that mirrors hide.
            let mut layers = gap(0.1, behind);
            layers.planes[NEAR][SLOT] = 0.9;
            assert!(is(layers.at(SLOT), 0.1, behind, 0.0, 0.1 + behind));
            let mut layers = gap(0.1, behind);
            layers.planes[SHOWN][SLOT - 5] = 0.5;
            assert!(is(layers.at(SLOT), 0.1, behind, 0.0, 0.1 + behind));
        }
    }

    #[test]
    fn gaps_two_pixels_wide_are_closed_if_both_are_nearly_full() {
        for (own, other, closed) in [(0.8, 0.8, true), (0.8, 0.7, false), (0.7, 0.8, false)] {
            for behind in [0.0, 1.0 - own] {
                // Its neighbours in the row and the column, too: no pair of next ones is full.
                let mut layers = gap(own, behind);
                for beside in [SLOT - 1, SLOT + 5] {
                    layers.planes[FULL][beside] = other;
                    layers.planes[FRONT][beside] = if behind > 0.0 { other } else { 2.0 };
                }
                // What lies beyond them shows the same, although the tile ends there.
                for beyond in [SLOT - 2, SLOT + 10] {
                    for plane in [0, SHOWN, NEAR] {
                        layers.planes[plane][beyond] = 1.0;
                    }
                }
                let red = if closed { 1.0 } else { own.max(other) };
                let found = layers.at(SLOT).unwrap().value;
                assert!((found.x - red).abs() < 1e-5, "{own} {other} {behind}: {found}");
            }
        }
    }

    #[test]
    fn a_gap_with_splats_all_around_is_closed_and_what_lies_beyond_an_edge_is_not() {
        // Three about the middle of a pixel, half of it in all; something else behind.
        let (radius, away) = (4.0f32, 1.5f32);
        let kernel = (1.0 - (away / radius).powi(2)).powi(2);
        let part = |weight: f32| weight / (GAIN * kernel);
        let around = |weight: f32, angles: [f32; 3], radius: f32| {
            angles.map(|angle: f32| {
                let (sin, cos) = angle.to_radians().sin_cos();
                [2.5 + away * cos, 2.5 + away * sin, radius, part(weight), 1.0]
            })
        };
        let back = [2.5, 2.5, 9.0, 9.0, 3.0];
        let colors = [Vec3::X, Vec3::X, Vec3::X, Vec3::Y];
        let shown = |list: &[[f32; 5]]| draw(list, &colors, 9).at(SLOT).unwrap().value;
        let [a, b, c] = around(0.18, [0.0, 120.0, 240.0], radius);
        assert!(shown(&[a, b, c, back]).abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-5));
        assert!(shown(&[a, b, c]).abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-5));
        // On one side, four fifths of their size away.
        let [a, b, c] = around(0.18, [0.0, 20.0, -20.0], away / 0.8);
        let found = shown(&[a, b, c, back]);
        assert!(found.x < 0.5 && found.y > 0.5, "{found}");
        // Too little, or by what is small.
        let [a, b, c] = around(0.1, [0.0, 120.0, 240.0], radius);
        assert!((shown(&[a, b, c, back]) - Vec4::new(0.3, 0.7, 0.0, 1.0)).length() < 1e-5);
        let small = [2.5, 2.5, 0.9, 0.6 / GAIN, 1.0];
        assert!(is(draw(&[small, back], &[Vec3::X, Vec3::Y], 9).at(SLOT), 0.6, 0.4, 0.0, 1.0));
    }

    #[test]
    fn what_is_behind_does_not_show_through_gaps_of_a_surface() {
        assert!(is(gap(0.6, 0.4).at(SLOT), 1.0, 0.0, 0.0, 1.0));
        // Its neighbours show something else, nearer or farther: it is an edge.
        let mut layers = gap(0.6, 0.4);
        for other in [SLOT - 1, SLOT - 5] {
            layers.planes[NEAR][other] = 0.9;
        }
        assert!(is(layers.at(SLOT), 0.6, 0.4, 0.0, 1.0));
        // A slope is one surface, however steep for the distance; before a step it is not.
        for (below, beyond, closed) in [(0.8, 1.2, 1.0), (0.9, 1.1, 1.0), (1.0, 1.1, 0.6)] {
            let mut layers = gap(0.6, 0.4);
            for (slot, depth) in
                [(SLOT - 1, below), (SLOT - 5, below), (SLOT + 1, beyond), (SLOT + 5, beyond)]
            {
                layers.planes[NEAR][slot] = depth;
            }
            assert!(is(layers.at(SLOT), closed, 1.0 - closed, 0.0, 1.0), "{below} to {beyond}");
        }
        // What mirrors hide wholly shows no object, whatever its neighbours do.
        let mut layers = gap(0.6, 0.4);
        for plane in [0, 1, SHOWN] {
            layers.planes[plane][SLOT] = 0.0;
        }
        assert_eq!(layers.at(SLOT), None);
        // Of the depths before and behind a splat, its range decides which are another surface.
        let parts = [
            [2.5, 2.5, 0.4, 0.3 / GAIN, 1.0],
            [2.5, 2.5, 0.4, 9.0, 1.4],
            [2.5, 2.5, 0.4, 9.0, 1.6],
        ];
        assert_eq!(draw(&parts[..2], &COLORS, 3).planes[FRONT][SLOT], 2.0);
        let apart = [parts[0], parts[2]];
        assert!((draw(&apart, &COLORS, 3).planes[FRONT][SLOT] - 0.3).abs() < 1e-6);
    }
}
