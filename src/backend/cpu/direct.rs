//! The final picture: what the eye sees directly, with the reflected layer on the mirrors, antialiased.
//!
//! A pixel is the average of its samples in linear light. Every sample is clamped to the display range
//! *before* that: next to something brighter than white, an edge would otherwise be as jagged as without
//! antialiasing, since a fifth of the pixel would already turn all of it white.

use fearless_simd::dispatch;
use glam::{DVec2, Vec3};
use rayon::prelude::*;

use crate::camera::Eye;
use crate::geometry::lanes::simd_level;
use crate::visibility::{RayWeights, SAMPLE_EIGHTHS, SAMPLES, SurfaceMesh, Visibility};

/// A point of an object that the eye sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the object.
    pub object: usize,
    /// Index of the triangle within it.
    pub triangle: usize,
    /// Barycentric weights in that triangle; not negative, sum 1.
    pub weights: [f32; 3],
    /// The same point in scene space.
    pub point: Vec3,
}

/// What surfaces and sky look like: the scene's side of [`compose`]. Colours are linear RGB.
pub trait Appearance: Sync {
    /// Reflectance at a point: asked for at every sample, so that patterns are antialiased as well.
    fn albedo(&self, hit: &Hit) -> Vec3;

    /// The light that the reflectance is multiplied by: asked for once for every object that a pixel
    /// shows, since it may cost a shadow ray.
    fn light(&self, hit: &Hit) -> Vec3;

    /// Radiance from a direction (unit, scene space, away from the eye).
    fn sky(&self, direction: Vec3) -> Vec3;

    /// Factor of what a mirror reflects.
    fn tint(&self, mirror: usize) -> Vec3;
}

/// What [`compose`] puts together.
#[derive(Clone, Copy, Debug)]
pub struct DirectView<'a> {
    /// As given to [`Visibility::update`].
    pub eye: &'a Eye,
    /// As given to [`Visibility::update`].
    pub mirrors: &'a [SurfaceMesh<'a>],
    /// As given to [`Visibility::update`].
    pub objects: &'a [SurfaceMesh<'a>],
    /// What they look like from the eye.
    pub visibility: &'a Visibility,
    /// Per pixel: what the mirror at its centre reflects, linear RGB with the tint applied. Read where
    /// `visibility.mirror_ids` is set.
    pub reflection: &'a [Vec3],
    /// The display's white, to which every channel of every sample is clamped; infinity for pictures that
    /// keep brighter values.
    pub white: f32,
}

/// Puts the picture together: `out` is row by row from the top left, linear RGB.
///
/// Objects get one reflectance a sample and one light; the sky gets one value. A mirror's samples get the
/// pixel's own reflection, or, if another surface is at its centre, the mean of the neighbours that show
/// the mirror at theirs, or, if there are none, the sky by the triangle's flat reflection.
///
/// # Panics
/// If a plane has another size than the picture, or the surfaces are not those of the visibility.
pub fn compose(view: &DirectView, appearance: &impl Appearance, out: &mut [Vec3]) {
    let pixels = view.visibility.size.pixels();
    assert_eq!((view.reflection.len(), out.len()), (pixels, pixels), "planes of one size");
    let width = view.visibility.size.width as usize;
    let level = simd_level();
    out.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        // By the best instructions that there are: most of it is tracing shadow rays.
        dispatch!(level, _ => {
            let mut painter = Painter { view, appearance, last: None };
            for (x, pixel) in row.iter_mut().enumerate() {
                *pixel = painter.pixel(x, y);
            }
        });
    });
}

/// What one sample shows.
#[derive(Clone, Copy, PartialEq)]
struct Seen {
    /// `None` for the sky.
    surface: Option<usize>,
    triangle: usize,
    id: u32,
}

/// The samples of a pixel that show one surface: one bit each.
#[derive(Clone, Copy)]
struct Group(usize);

/// For each [`Group`]: the mean position of its samples in the pixel (px), and the sample nearest to it.
const MIDDLES: [([f64; 2], usize); 1 << SAMPLES] = {
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

impl Group {
    fn of(seen: &[Seen; SAMPLES], surface: Option<usize>) -> Self {
        Self((0..SAMPLES).fold(0, |bits, s| bits | usize::from(seen[s].surface == surface) << s))
    }

    fn members(self) -> impl Iterator<Item = usize> {
        (0..SAMPLES).filter(move |s| self.0 >> s & 1 == 1)
    }

    fn count(self) -> f32 {
        self.0.count_ones() as f32
    }

    /// Mean position of its samples of a pixel, px.
    fn middle_px(self, pixel: [usize; 2]) -> DVec2 {
        DVec2::from(MIDDLES[self.0].0) + DVec2::new(pixel[0] as f64, pixel[1] as f64)
    }

    /// The sample nearest to that.
    fn middle_sample(self) -> usize {
        MIDDLES[self.0].1
    }
}

/// Computes pixels one after the other.
struct Painter<'a, A> {
    view: &'a DirectView<'a>,
    appearance: &'a A,
    /// The object triangle met last: neighbouring samples mostly meet the same.
    last: Option<Met>,
}

struct Met {
    id: u32,
    corners: [Vec3; 3],
    rays: RayWeights,
}

impl<A: Appearance> Painter<'_, A> {
    #[inline(always)]
    fn pixel(&mut self, x: usize, y: usize) -> Vec3 {
        let visibility = self.view.visibility;
        let at = y * visibility.size.width as usize + x;
        let ids = visibility.samples[at];
        let same = ids.iter().all(|&id| id == ids[0]);
        if same && ids[0] < visibility.mirror_triangles() {
            return self.displayed(self.view.reflection[at]);
        }
        let center = self.seen(ids[0]);
        let seen = if same { [center; SAMPLES] } else { ids.map(|id| self.seen(id)) };
        let mut sum = Vec3::ZERO;
        let mut done = 0;
        for (sample, Seen { surface, triangle, .. }) in seen.into_iter().enumerate() {
            if done >> sample & 1 == 1 {
                continue;
            }
            let group = Group::of(&seen, surface);
            done |= group.0;
            sum += match surface {
                None => self.sky(group.middle_px([x, y])) * group.count(),
                Some(mirror) if mirror < visibility.mirrors() => {
                    let value = if center.surface == surface {
                        self.displayed(self.view.reflection[at])
                    } else if let Some(borrowed) = self.neighbours([x, y], mirror) {
                        borrowed
                    } else {
                        self.reflected_sky(group.middle_px([x, y]), mirror, triangle)
                    };
                    value * group.count()
                }
                Some(surface) => self.object([x, y], &seen, group, surface - visibility.mirrors()),
            };
        }
        sum / SAMPLES as f32
    }

    #[inline(always)]
    fn seen(&self, id: u32) -> Seen {
        let (surface, triangle) = self.view.visibility.locate(id).unzip();
        Seen { surface, triangle: triangle.unwrap_or(0), id }
    }

    fn displayed(&self, radiance: Vec3) -> Vec3 {
        radiance.clamp(Vec3::ZERO, Vec3::splat(self.view.white))
    }

    /// The unit direction of the view ray.
    fn direction(&self, px: DVec2) -> Vec3 {
        self.view.eye.ray_through_px(px.as_vec2()).normalize_or(self.view.eye.forward)
    }

    fn sky(&self, px: DVec2) -> Vec3 {
        self.displayed(self.appearance.sky(self.direction(px)))
    }

    /// The mean of the reflections at those of the neighbouring pixels that show the mirror at their
    /// centres.
    fn neighbours(&self, [x, y]: [usize; 2], mirror: usize) -> Option<Vec3> {
        let visibility = self.view.visibility;
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
    fn reflected_sky(&self, px: DVec2, mirror: usize, triangle: usize) -> Vec3 {
        let direction = self.direction(px);
        let [a, b, c] = self.view.mirrors[mirror].corners(triangle);
        // Relative to their size, since products of small f32 lengths underflow.
        let [ab, ac] = [b - a, c - a].map(|side| side.normalize_or_zero());
        let normal = ab.cross(ac).normalize_or(-direction);
        let reflected = direction.reflect(normal);
        self.displayed(self.appearance.sky(reflected) * self.appearance.tint(mirror))
    }

    /// The sum of a group's samples on an object.
    #[inline(always)]
    fn object(
        &mut self,
        pixel: [usize; 2],
        seen: &[Seen; SAMPLES],
        group: Group,
        object: usize,
    ) -> Vec3 {
        let lit = self.hit(seen[group.middle_sample()], object, group.middle_px(pixel));
        let light = self.appearance.light(&lit);
        let mut sum = Vec3::ZERO;
        for sample in group.members() {
            let px = Group(1 << sample).middle_px(pixel);
            let hit = self.hit(seen[sample], object, px);
            sum += self.displayed(self.appearance.albedo(&hit) * light);
        }
        sum
    }

    /// Where the view ray through `px` meets the triangle. Where the ray passes it, which it does by less
    /// than a pixel, its negative weights are taken for zero.
    #[inline(always)]
    fn hit(&mut self, Seen { triangle, id, .. }: Seen, object: usize, px: DVec2) -> Hit {
        let view = self.view;
        let met = match &self.last {
            Some(last) if last.id == id => last,
            _ => {
                let corners = view.objects[object].corners(triangle);
                self.last.insert(Met { id, corners, rays: RayWeights::new(view.eye, corners) })
            }
        };
        let mut weights = met.rays.at(px).unwrap_or([1.0 / 3.0; 3]);
        if weights[0].min(weights[1]).min(weights[2]) < 0.0 {
            let inside = weights.map(|w| w.max(0.0));
            weights = inside.map(|w| w / (inside[0] + inside[1] + inside[2]));
        }
        let point =
            met.corners[0] * weights[0] + met.corners[1] * weights[1] + met.corners[2] * weights[2];
        Hit { object, triangle, weights, point }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec2, vec2, vec3};

    use super::*;
    use crate::camera::eye::ImageSize;
    use crate::visibility::{NONE_ID, Scratch};

    const SIZE: ImageSize = ImageSize { width: 24, height: 16 };
    const SUN: f32 = 50.0;

    /// Objects show their position, lit by a bright light; the sky shows its direction.
    struct Plain;

    impl Appearance for Plain {
        fn albedo(&self, hit: &Hit) -> Vec3 {
            hit.point.abs()
        }
        fn light(&self, _: &Hit) -> Vec3 {
            Vec3::splat(SUN)
        }
        fn sky(&self, direction: Vec3) -> Vec3 {
            direction.max(Vec3::ZERO)
        }
        fn tint(&self, _: usize) -> Vec3 {
            vec3(0.5, 0.25, 0.125)
        }
    }

    fn eye() -> Eye {
        Eye::new(DVec3::Z, DVec3::ZERO, DVec3::Y, 1.0, SIZE).unwrap()
    }

    fn composed(
        mirror: Option<[Vec3; 3]>,
        object: Option<[Vec3; 3]>,
        reflection: Vec3,
        white: f32,
    ) -> (Visibility, Vec<Vec3>) {
        let eye = eye();
        let mesh = |corners: &Option<[Vec3; 3]>| corners.map(|c| c.to_vec()).unwrap_or_default();
        let (mirror_points, object_points) = (mesh(&mirror), mesh(&object));
        let of =
            |points: &[Vec3]| -> &[[u32; 3]] { if points.is_empty() { &[] } else { &[[0, 1, 2]] } };
        let mirrors = [SurfaceMesh { positions: &mirror_points, triangles: of(&mirror_points) }];
        let objects = [SurfaceMesh { positions: &object_points, triangles: of(&object_points) }];
        let mut visibility = Visibility::default();
        visibility.update(&eye, &mirrors, &objects, &mut Scratch::default());
        let reflected: Vec<Vec3> = visibility
            .mirror_ids
            .iter()
            .map(|&id| if id == NONE_ID { Vec3::NAN } else { reflection })
            .collect();
        let view = DirectView {
            eye: &eye,
            mirrors: &mirrors,
            objects: &objects,
            visibility: &visibility,
            reflection: &reflected,
            white,
        };
        let mut out = vec![Vec3::NAN; SIZE.pixels()];
        compose(&view, &Plain, &mut out);
        (visibility, out)
    }

    /// On the plane z = 0, as seen at these picture positions.
    fn at(px: [Vec2; 3]) -> [Vec3; 3] {
        px.map(|p| eye().position + eye().ray_through_px(p))
    }

    const HALF: [Vec2; 3] = [vec2(-30.0, -9.0), vec2(40.0, 7.0), vec2(-20.0, 60.0)];

    #[test]
    fn edges_are_shares_of_display_values() {
        // The object lies at z = -9, so that it is white in z, where the sky is black.
        let far = at(HALF).map(|p| DVec3::Z.as_vec3() + (p - DVec3::Z.as_vec3()) * 10.0);
        let (visibility, out) = composed(None, Some(far), Vec3::ZERO, 1.0);
        let mut partial = 0;
        for (ids, value) in visibility.samples.iter().zip(&out) {
            let share = ids.iter().filter(|&&id| id == 0).count() as f32 / SAMPLES as f32;
            partial += usize::from(share > 0.0 && share < 1.0);
            assert!((value.z - share).abs() < 1e-6, "{value} {share}");
        }
        assert!(partial > 5, "{partial}");
    }

    #[test]
    fn objects_show_the_point_on_the_ray() {
        let (visibility, out) = composed(None, Some(at(HALF)), Vec3::ZERO, f32::INFINITY);
        let mut inside = 0;
        for (pixel, (ids, value)) in visibility.samples.iter().zip(&out).enumerate() {
            if *ids == [0; SAMPLES] {
                let px = vec2((pixel % 24) as f32 + 0.5, (pixel / 24) as f32 + 0.5);
                let point = eye().position + eye().ray_through_px(px);
                // The mean of |x| over a symmetric pattern, where no axis crosses the pixel.
                let point = point.abs() * SUN;
                assert!(value.abs_diff_eq(point, 2e-3 * SUN / 2.0), "{px}: {value} {point}");
                inside += 1;
            }
        }
        assert!(inside > 50);
    }

    #[test]
    fn mirrors_show_their_own_or_their_neighbours_reflection() {
        let tone = vec3(0.2, 0.3, 0.4);
        let (visibility, out) = composed(Some(at(HALF)), None, tone, 1.0);
        let (mut own, mut borrowed) = (0, 0);
        for (pixel, (ids, value)) in visibility.samples.iter().zip(&out).enumerate() {
            let share = ids.iter().filter(|&&id| id == 0).count() as f32 / SAMPLES as f32;
            if visibility.mirror_ids[pixel] == 0 {
                own += 1;
            } else if share > 0.0 {
                borrowed += 1;
            }
            // In z the sky is black.
            assert!((value.z - 0.4 * share).abs() < 1e-6, "{value} {share}");
        }
        assert!(own > 50 && borrowed > 2, "{own} {borrowed}");
    }

    #[test]
    fn a_lone_mirror_sample_reflects_the_sky() {
        // Over the sample (3, 1)/8 of pixel (5, 5) only, and tilted: it sends the view upwards and left.
        let [a, b, c] = at([vec2(5.3, 5.05), vec2(5.45, 5.05), vec2(5.375, 5.2)]);
        let tilted = [a, b, c - (c - eye().position) * 0.01];
        let (visibility, out) = composed(Some(tilted), None, Vec3::ZERO, 1.0);
        assert_eq!(visibility.samples[5 * 24 + 5], [NONE_ID, 0, NONE_ID, NONE_ID, NONE_ID]);
        let px = vec2(5.375, 5.125);
        let view = eye().ray_through_px(px).normalize_or(Vec3::ZERO);
        let normal = (tilted[1] - tilted[0]).cross(tilted[2] - tilted[0]).normalize_or(Vec3::ZERO);
        let mirrored = Plain.sky(view.reflect(normal)) * vec3(0.5, 0.25, 0.125);
        assert!(mirrored.z > 0.1 || mirrored.y > 0.1 || mirrored.x > 0.1);
        let others = [vec2(4.0, 4.0), vec2(7.0, 3.0), vec2(5.0, 7.0), vec2(1.0, 5.0)];
        let middle = others.iter().sum::<Vec2>() / 32.0;
        let sky = eye().ray_through_px(vec2(5.0, 5.0) + middle).normalize_or(Vec3::ZERO);
        let expected = (mirrored + Plain.sky(sky) * 4.0) / 5.0;
        let found = out[5 * 24 + 5];
        assert!(found.abs_diff_eq(expected, 1e-5), "{found} {expected}");
    }
}
