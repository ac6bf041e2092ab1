//! The projection of what is packed by one camera.

use fearless_simd::Simd;

use super::hits::Hits;
use super::packed::Packed;
use super::{BORDER, EDGE_TOLERANCE};
use crate::camera::three_ray::project::along;
use crate::camera::three_ray::{Image, project};
use crate::geometry::Surfels;
use crate::geometry::lanes::{Real, Vector, cross, dot, dot_const};
use crate::plan::kernel::{LEAST_FACING, PER_DISK, PIXEL, SAME_SURFACE_RADII, SPREAD};
use crate::plan::{
    CELL_SLACK_PX, CameraInstance, DepthKey, LARGEST_ELLIPSE, SplatPass, SplatShape,
};
use crate::visibility::Patch;

/// A splat's kernel in the picture: 1 - (a x² + 2 b x y + c y²), squared.
struct Kernel<R> {
    form: [R; 3],
    /// Half its width and height.
    half: [R; 2],
    /// Value in the middle: its integral is the disk's area.
    weight: R,
}

impl<R: Real<Scalar = f32>> Kernel<R> {
    /// Of the disk that holds a surfel, see [`Frame::form`], and the form's determinant. Of a thin ellipse it would be
    /// lost in the difference of products, so those are never taken.
    #[inline(always)]
    fn new([a, b, c]: [R; 3], det: R) -> Self {
        let least = 1.0 / (LARGEST_ELLIPSE * LARGEST_ELLIPSE);
        // Near a caustic it is larger than what is drawn of it: that is to count for all of it.
        let most = a.splat(1.0) / det.max(a.splat(least * least * least));
        // Every axis with 1 / r² = e becomes e + l² / (e + l): what is well below the largest keeps its size.
        let (own, trace) = (det, a + c);
        let added = own + trace * least + least * least;
        let (kept, per) = (own / added, own.splat(least * least) / added);
        let (a, b, c) = (a + (c + least) * per, b - b * per, c + (a + least) * per);
        let det = (own + trace * least) * kept
            + (trace * trace - own + trace * least + least * least) * per;
        // The disk's ellipse and the pixel's add as variances do.
        let spread = a.splat(SPREAD * SPREAD) / det;
        let pixel = PIXEL * PIXEL;
        let (xx, xy, yy) = (c * spread + pixel, b * spread, a * spread + pixel);
        let both = spread * spread * det + spread * (a + c) * pixel + pixel * pixel;
        let per_det = a.splat(1.0) / both;
        Self {
            form: [yy * per_det, xy * per_det, xx * per_det],
            half: [xx.sqrt(), yy.sqrt()],
            weight: (most * per_det).sqrt() * (3.0 * PER_DISK),
        }
    }
}

/// How the point of the ray that is seen moves, across the ray, with the place on the screen: a pixel to the right and
/// a pixel down. In the camera's unit, see [`CameraInstance::per_px`].
#[derive(Clone, Copy)]
struct Frame<R> {
    right: [R; 3],
    down: [R; 3],
}

impl<R: Real<Scalar = f32>> Frame<R> {
    /// The determinant of the form for a size of 1.
    #[inline(always)]
    fn det(&self) -> R {
        let across = cross(self.right, self.down);
        dot(across, across)
    }

    /// a, b, c: the squared distance a x² + 2 b x y + c y² from the surfel of the ray through a place (x, y) pixels
    /// away, in the surfel's radius.
    #[inline(always)]
    fn form(&self, size: R) -> [R; 3] {
        [
            dot(self.right, self.right) * size,
            dot(self.right, self.down) * size,
            dot(self.down, self.down) * size,
        ]
    }
}

/// A correction is no longer than this: beyond it the camera says nothing of the exact rays.
pub(crate) const MOST_CORRECTION_PX: f32 = 2.0;
/// Of any vector.
const MOST_LANES: usize = 32;

/// The projection of batches by one camera.
#[derive(Clone, Copy)]
pub(crate) struct Projection<'a> {
    pub(crate) pass: &'a SplatPass<'a>,
    pub(crate) surfels: &'a Surfels,
    pub(crate) camera: &'a CameraInstance,
    pub(crate) patch: &'a Patch,
    pub(crate) stride: u32,
}

impl Projection<'_> {
    /// Projects what is packed; appends what lands in the tile; returns how many have an image.
    #[inline(always)]
    pub(super) fn run<S: Simd, V: Vector<S>>(
        &self,
        simd: S,
        packed: &Packed,
        count: usize,
        hits: &mut Hits,
    ) -> u64 {
        let mut valid = 0;
        let offset = self.offset();
        let zero = V::broadcast(simd, 0.0);
        // An ellipse may reach the tile from outside.
        let beyond = match self.pass.shape {
            SplatShape::Ellipse => LARGEST_ELLIPSE,
            _ => 0.0,
        };
        // A cell's camera is a little beside the exact rays.
        let deviations = self.patch.own.map(|own| {
            let count = (self.patch.rect.width() * self.patch.rect.height()) as usize;
            let first = own.first_pixel as usize;
            &self.pass.pixels.deviations[first..first + count]
        });
        let slack = if deviations.is_some() { CELL_SLACK_PX } else { 0.0 };
        let beyond = beyond + slack;
        let before = V::broadcast(simd, -beyond);
        let width = V::broadcast(simd, (self.stride - BORDER) as f32 + beyond);
        let rows = self.patch.rect.height();
        let height = V::broadcast(simd, (rows + BORDER) as f32 + beyond);
        let mut len = hits.len;
        let mut i = 0;
        while i < count {
            let lanes = (count - i).min(V::LANES as usize);
            let active = V::mask(simd, (1u64 << lanes) - 1);
            let v1 = &self.camera.camera.v1;
            let q = [
                V::load(simd, &packed.x[i..]) - v1[0],
                V::load(simd, &packed.y[i..]) - v1[1],
                V::load(simd, &packed.z[i..]) - v1[2],
            ];
            let lo = V::load(simd, &packed.lo[i..]);
            let hi = V::load(simd, &packed.hi[i..]);
            let size = V::load(simd, &packed.size[i..]);
            let mut seen = 0u64;
            let mut taken = !active;
            for image in project(&self.camera.camera, q, lo, hi).as_slice() {
                let front = zero.lt(image.linear(self.camera.front)) & active;
                if deviations.is_none() {
                    seen |= V::bits(image.within([EDGE_TOLERANCE; 3]) & front);
                }
                let mut drawn = image.within(self.camera.guard) & front;
                if self.pass.first_root_only {
                    drawn = drawn & !taken;
                    taken = taken | drawn;
                }
                if !V::any(drawn) {
                    continue;
                }
                let [mut x, mut y, w] = self.place(image, offset);
                let mut lands =
                    drawn & zero.lt(w) & before.le(x) & x.lt(width) & before.le(y) & y.lt(height);
                if !V::any(lands) {
                    continue;
                }
                if deviations.is_some() {
                    // A cell's triangle is only half of its rectangle.
                    let (right, bottom) = (self.patch.rect.width(), self.patch.rect.height());
                    let inside = zero.le(x - offset)
                        & zero.le(y - offset)
                        & x.lt(zero.splat(right as f32 + offset))
                        & y.lt(zero.splat(bottom as f32 + offset));
                    seen |= V::bits(lands & inside);
                }
                let d = self.direction(image);
                let depth = self.depth(image, d);
                let frame = self.frame(image, d);
                if let Some(deviations) = deviations {
                    let apart = self.apart(simd, deviations, image, [x, y], offset, lands);
                    let [dx, dy] = self.correction(simd, &frame, apart);
                    (x, y) = (x + dx, y + dy);
                }
                if self.pass.shape == SplatShape::Ellipse {
                    let normal = self.normals(simd, &packed.surfel[i..]);
                    let (frame, facing, thin) = self.on_surface(&frame, d, normal);
                    lands = lands & facing;
                    let Kernel { form, half: [wide, high], weight } =
                        Kernel::new(frame.form(size), frame.det() * (size * size));
                    let weight = weight * thin;
                    lands = lands
                        & zero.le(x + wide)
                        & (x - wide).lt(width)
                        & zero.le(y + high)
                        & (y - high).lt(height);
                    if !V::any(lands) {
                        continue;
                    }
                    let range =
                        V::broadcast(simd, SAME_SURFACE_RADII * self.camera.radius) / size.sqrt();
                    let values = [x, y, form[0], form[1], form[2], wide, high, weight, range];
                    for (value, list) in values.into_iter().zip(&mut hits.ellipse) {
                        value.compress(lands, &mut list[len..]);
                    }
                } else {
                    // A square must lie in the tile, also after the correction.
                    let (right, bottom) = (self.stride - BORDER, rows + BORDER);
                    lands = lands
                        & zero.le(x)
                        & x.lt(zero.splat(right as f32))
                        & zero.le(y)
                        & y.lt(zero.splat(bottom as f32));
                    if !V::any(lands) {
                        continue;
                    }
                    let cell = [x.floor(), y.floor()];
                    let det = frame.det() * (size * size);
                    let from = [cell[0] - x, cell[1] - y];
                    let fills = self.fills(frame.form(size), det, from);
                    V::compress_cells(cell, self.stride, fills, lands, &mut hits.cell[len..]);
                }
                depth.compress(lands, &mut hits.depth[len..]);
                V::compress_numbers(simd, &packed.surfel[i..], lands, &mut hits.surfel[len..]);
                len += V::bits(lands).count_ones() as usize;
            }
            valid += u64::from(seen.count_ones());
            i += lanes;
        }
        hits.len = len;
        valid
    }

    /// How rays run about the image's. `d`: the image's ray.
    #[inline(always)]
    fn frame<R: Real<Scalar = f32>>(&self, image: &Image<R>, d: [R; 3]) -> Frame<R> {
        let [base, per_lambda] = self.camera.per_px;
        let right = along(base[0], per_lambda[0], image.lambda);
        let down = along(base[1], per_lambda[1], image.lambda);
        let per_length = image.lambda.splat(1.0) / dot(d, d);
        let (right_d, down_d) = (dot(right, d) * per_length, dot(down, d) * per_length);
        Frame {
            right: [0, 1, 2].map(|k| right[k] - right_d * d[k]),
            down: [0, 1, 2].map(|k| down[k] - down_d * d[k]),
        }
    }

    /// How far the exact ray of the pixel at (`x`, `y`) runs beside the camera's, where they meet the surfel.
    #[inline(always)]
    fn apart<S: Simd, V: Vector<S>>(
        &self,
        simd: S,
        deviations: &[[f32; 3]],
        image: &Image<V>,
        [x, y]: [V; 2],
        offset: f32,
        lands: V::Mask,
    ) -> [V; 3] {
        let zero = V::broadcast(simd, 0.0);
        let (width, height) = (self.patch.rect.width() as f32, self.patch.rect.height() as f32);
        let column = (x - offset).floor().max(zero).min(zero.splat(width - 1.0));
        let row = (y - offset).floor().max(zero).min(zero.splat(height - 1.0));
        let mut at = [0.0f32; MOST_LANES];
        V::select(lands, row * width + column, zero).store(&mut at);
        let mut e = [[0.0f32; MOST_LANES]; 3];
        for i in 0..V::LANES as usize {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "whole and clamped"
            )]
            let deviation = deviations[at[i] as usize];
            (e[0][i], e[1][i], e[2][i]) = (deviation[0], deviation[1], deviation[2]);
        }
        let scale = image.lambda * (1.0 / self.camera.radius);
        [V::load(simd, &e[0]) * scale, V::load(simd, &e[1]) * scale, V::load(simd, &e[2]) * scale]
    }

    /// From the camera's image to that of rays which run `apart` beside, in pixels.
    #[inline(always)]
    fn correction<S: Simd, V: Vector<S>>(
        &self,
        simd: S,
        frame: &Frame<V>,
        apart: [V; 3],
    ) -> [V; 2] {
        let zero = V::broadcast(simd, 0.0);
        let [a, b, c] = frame.form(V::broadcast(simd, 1.0));
        let (u, v) = (dot(frame.right, apart), dot(frame.down, apart));
        let det = frame.det();
        let usable = zero.lt(det);
        let share = V::select(usable, V::broadcast(simd, -1.0) / det, zero);
        let limit = V::broadcast(simd, MOST_CORRECTION_PX);
        let (dx, dy) = ((u * c - v * b) * share, (v * a - u * b) * share);
        [dx.max(-limit).min(limit), dy.max(-limit).min(limit)]
    }

    /// The surfels' normals in scene space.
    #[inline(always)]
    fn normals<S: Simd, V: Vector<S>>(&self, simd: S, surfels: &[u32]) -> [V; 3] {
        let mut n = [[0.0f32; MOST_LANES]; 3];
        for i in 0..V::LANES as usize {
            let normal = self.surfels.normals[surfels[i] as usize];
            (n[0][i], n[1][i], n[2][i]) = (normal.x, normal.y, normal.z);
        }
        let n = [V::load(simd, &n[0]), V::load(simd, &n[1]), V::load(simd, &n[2])];
        let r = &self.camera.rotation;
        [dot_const(n, r[0]), dot_const(n, r[1]), dot_const(n, r[2])]
    }

    /// A frame along the ray `d` as one along the surfel's plane (Zwicker et al. 2001: the object's own
    /// parametrisation), where the surfel does not show a hidden back, and how much thinner it is seen than the frame says.
    #[inline(always)]
    fn on_surface<R: Real<Scalar = f32>>(
        &self,
        frame: &Frame<R>,
        d: [R; 3],
        normal: [R; 3],
    ) -> (Frame<R>, R::Mask, R) {
        let zero = d[0].splat(0.0);
        let along = dot(normal, d);
        let front = along.lt(zero);
        let facing = if self.camera.gaze.is_some() { front } else { front | !front };
        // Seen from the side the frame's ends would lie far away.
        let least = dot(d, d).sqrt() * LEAST_FACING;
        let inverse = d[0].splat(1.0) / along.abs().max(least);
        let thin = along.abs() * inverse;
        let inverse = R::select(front, -inverse, inverse);
        let (right_n, down_n) =
            (dot(normal, frame.right) * inverse, dot(normal, frame.down) * inverse);
        let [dx, dy, dz] = d;
        let ([rx, ry, rz], [bx, by, bz]) = (frame.right, frame.down);
        let on = Frame {
            right: [rx - right_n * dx, ry - right_n * dy, rz - right_n * dz],
            down: [bx - down_n * dx, by - down_n * dy, bz - down_n * dz],
        };
        (on, facing, thin)
    }

    /// The low bits of [`Hits::cell`], as a number; `from` leads from the image to where the splat's first sample
    /// begins.
    #[inline(always)]
    fn fills<R: Real<Scalar = f32>>(&self, [a, b, c]: [R; 3], det: R, from: [R; 2]) -> R {
        let (one, zero) = (a.splat(1.0), a.splat(0.0));
        // A disk of that distance holds a surfel. Where it is seen so long that it leaves the splat's reach, it has
        // to be as much wider to hold one within it.
        let reach = self.pass.shape.reach();
        let least = det / (a + c) * (reach * reach);
        let mut fills = zero;
        let pixels: &[_] = match self.pass.shape {
            SplatShape::Ellipse => &[],
            SplatShape::Square1 => &[(0.5, 0.5, 1.0)],
            SplatShape::Square2 => {
                &[(0.0, 0.0, 1.0), (1.0, 0.0, 2.0), (0.0, 1.0, 4.0), (1.0, 1.0, 8.0)]
            }
        };
        for &(i, j, bit) in pixels {
            let (x, y) = (from[0] + i, from[1] + j);
            let distance = x * x * a + (x * y * b) * 2.0 + y * y * c;
            let far = one.lt(distance) & one.lt(distance * least);
            fills = fills + R::select(far, zero.splat(bit), zero);
        }
        fills
    }

    /// Position in the tile, in pixels plus `offset`, and the homogeneous w.
    #[inline(always)]
    pub(crate) fn place<R: Real<Scalar = f32>>(&self, image: &Image<R>, offset: f32) -> [R; 3] {
        let w = image.linear(self.camera.screen[2]);
        let usable = w.splat(0.0).lt(w);
        let inverse = w.splat(1.0) / R::select(usable, w, w.splat(1.0));
        let x = image.linear(self.camera.screen[0]) * inverse + offset;
        let y = image.linear(self.camera.screen[1]) * inverse + offset;
        [x, y, w]
    }

    /// Whether the image lies in the camera's triangle, or in its cell's rectangle: the paper's valid ones. One by one, as
    /// vectors of them are counted.
    pub(crate) fn is_valid(&self, image: &Image<f32>) -> bool {
        if self.patch.own.is_none() {
            return image.within([EDGE_TOLERANCE; 3]);
        }
        let offset = self.offset();
        let [x, y, w] = self.place(image, offset);
        let (right, bottom) = (self.patch.rect.width() as f32, self.patch.rect.height() as f32);
        let inside =
            0.0 <= x - offset && 0.0 <= y - offset && x < right + offset && y < bottom + offset;
        inside && w > 0.0
    }

    /// From the picture to the tile, which has a border.
    fn offset(&self) -> f32 {
        match self.pass.shape {
            SplatShape::Ellipse | SplatShape::Square1 => BORDER as f32,
            SplatShape::Square2 => BORDER as f32 - 0.5,
        }
    }

    /// The direction d(w) of the ray in scene space.
    #[inline(always)]
    pub(crate) fn direction<R: Real<Scalar = f32>>(&self, image: &Image<R>) -> [R; 3] {
        self.camera.direction.map(|form| image.linear(form))
    }

    /// The depth key: not negative. `d`: the ray's direction.
    #[inline(always)]
    pub(crate) fn depth<R: Real<Scalar = f32>>(&self, image: &Image<R>, d: [R; 3]) -> R {
        let mut depth = image.lambda * dot(d, d).sqrt();
        if self.pass.depth == DepthKey::PushBack {
            let [x, y, z] = self.camera.from_eye;
            let v = [image.linear(x), image.linear(y), image.linear(z)];
            depth = depth + dot(v, v).sqrt();
        }
        depth.max(image.lambda.splat(0.0))
    }
}
