//! Triangles between images: which of them each pixel shows.

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;

use crate::camera::Eye;
use crate::plan::search::ReflectorPart;
use crate::scene::prepared::PreparedScene;
use crate::visibility::{NONE_ID, RayWeights, Scratch, SurfaceMesh, Visibility};

/// The images of an object's vertices and of its pieces' corners, and the triangles between them.
pub(crate) struct Drawn {
    /// Where the images are, scene space; what is not finite is not drawn, nor are its triangles.
    pub(crate) places: Vec<Vec3>,
    /// How far what they show is from its reflection point, scene units.
    pub(crate) distances: Vec<f32>,
    /// Indices of both.
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// What is drawn of one part of a mirror.
pub(crate) struct Drawing<'a> {
    pub(crate) eye: &'a Eye,
    pub(crate) scene: &'a PreparedScene,
    pub(crate) visibility: &'a Visibility,
    pub(crate) part: &'a ReflectorPart,
    /// In the objects' order.
    pub(crate) objects: &'a [Drawn],
    /// The images are on the mirror (Roger & Holzschuch section 3.3.6): the nearest to its reflection point is seen, everything is
    /// linear over the picture, and what is behind the mirror's own back faces is not seen. Otherwise they are where the points
    /// seem to be.
    pub(crate) on_mirror: bool,
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    pub(crate) pixel: usize,
    pub(crate) object: usize,
    /// Of the object's drawn triangles.
    pub(crate) triangle: usize,
    /// Of its corners.
    pub(crate) weights: [f32; 3],
}

/// Reflection points are between a convex reflector's front and its frontmost back faces: a hair on top for the facets.
pub(crate) const BACK_SLACK: f32 = 1.001;

impl Drawing<'_> {
    /// The part's triangles that face away from the eye; of the frontmost only those in front can be seen.
    pub(crate) fn back_faces(&self) -> Vec<[u32; 3]> {
        let (part, mirror) = (self.part, &self.scene.mirrors[self.part.mirror]);
        let own = [part.triangles.start, part.triangles.end]
            .map(|t| (t - mirror.first_triangle) as usize);
        let away = |t: &&[u32; 3]| {
            let [a, b, c] = t.map(|i| mirror.positions[i as usize]);
            (b - a).cross(c - a).dot(self.eye.position - a) < 0.0
        };
        mirror.mesh.triangles()[own[0]..own[1]].iter().filter(away).copied().collect()
    }

    /// Whether a hit is in front of the mirror's back faces, whose depths are given by pixel.
    fn is_before(&self, backs: &[f32], hit: &Hit) -> bool {
        let object = &self.objects[hit.object];
        let depths =
            object.triangles[hit.triangle].map(|i| depth(self.eye, object.places[i as usize]));
        let own: f32 = (0..3).map(|k| depths[k] * hit.weights[k]).sum();
        own <= backs[hit.pixel] * BACK_SLACK
    }

    /// The nearest hits in front of the back faces at a few pixels (rising), where the nearest of all is behind them.
    fn before_the_backs(&self, backs: &[f32], pixels: &[usize]) -> Vec<Hit> {
        let width = self.eye.size.width as usize;
        let mut found: Vec<Option<(f32, Hit)>> = vec![None; pixels.len()];
        for (k, object) in self.objects.iter().enumerate() {
            for (i, corners) in object.triangles.iter().enumerate() {
                let places = corners.map(|c| object.places[c as usize]);
                let Some([low, high]) = window(self.eye, places) else { continue };
                let first = pixels.partition_point(|&pixel| middle(pixel, width).y < low.y);
                for (at, &pixel) in pixels[first..].iter().enumerate() {
                    let px = middle(pixel, width);
                    if px.y > high.y {
                        break;
                    }
                    if px.x < low.x || px.x > high.x {
                        continue;
                    }
                    let Some(weights) = linear_weights(self.eye, places, px) else { continue };
                    let distances = corners.map(|c| object.distances[c as usize]);
                    let distance = (0..3).map(|k| distances[k] * weights[k]).sum::<f32>();
                    let hit = Hit { pixel, object: k, triangle: i, weights };
                    let best = &mut found[first + at];
                    let nearer = best.is_none_or(|(least, _)| distance < least);
                    let inside = weights.iter().all(|&w| w >= 0.0);
                    if inside && nearer && self.is_before(backs, &hit) {
                        *best = Some((distance, hit));
                    }
                }
            }
        }
        found.into_iter().flatten().map(|(_, hit)| hit).collect()
    }

    /// The largest distance of an image.
    pub(crate) fn farthest(&self) -> f32 {
        let distances = self.objects.iter().flat_map(|object| &object.distances);
        distances.copied().filter(|d| d.is_finite()).fold(f32::MIN_POSITIVE, f32::max)
    }
}

/// On the CPU.
pub(crate) fn rasterise(drawing: &Drawing<'_>) -> Vec<Hit> {
    let Drawing { eye, visibility, on_mirror, .. } = *drawing;
    let per_distance = 1.0 / drawing.farthest();
    let moved: Vec<Vec<Vec3>> = if on_mirror {
        let place =
            |(&place, &distance): (&Vec3, &f32)| ordered(eye, place, per_distance * distance);
        let object = |o: &Drawn| o.places.par_iter().zip(&o.distances).map(place).collect();
        drawing.objects.iter().map(object).collect()
    } else {
        Vec::new()
    };
    let surfaces: Vec<SurfaceMesh<'_>> = drawing
        .objects
        .iter()
        .enumerate()
        .map(|(i, object)| SurfaceMesh {
            positions: moved.get(i).unwrap_or(&object.places),
            triangles: &object.triangles,
            encloses: None,
        })
        .collect();
    let mut seen = Visibility::default();
    seen.update(eye, &surfaces, &[], &mut Scratch::default());
    let backs = if on_mirror { back_depth(drawing) } else { Vec::new() };
    let width = visibility.size.width as usize;
    let nearest = |pixel: usize| {
        let id = seen.mirror_ids[pixel];
        if id == NONE_ID || !drawing.part.owns(visibility, pixel) {
            return None;
        }
        let (object, triangle) = seen.locate(id)?;
        let px = middle(pixel, width);
        let corners = surfaces[object].corners(triangle);
        let weights = if on_mirror {
            linear_weights(eye, corners, px)?
        } else {
            RayWeights::new(eye, corners).at(px.as_dvec2())?
        };
        Some(Hit { pixel, object, triangle, weights })
    };
    let pixels = (0..seen.mirror_ids.len()).into_par_iter().with_min_len(width);
    let hits: Vec<Hit> = pixels.filter_map(nearest).collect();
    if backs.is_empty() {
        return hits;
    }
    let (mut hits, behind): (Vec<Hit>, Vec<Hit>) =
        hits.into_iter().partition(|hit| drawing.is_before(&backs, hit));
    if !behind.is_empty() {
        let pixels: Vec<usize> = behind.iter().map(|hit| hit.pixel).collect();
        hits.extend(drawing.before_the_backs(&backs, &pixels));
        hits.sort_unstable_by_key(|hit| hit.pixel);
    }
    hits
}

/// Of a pixel.
fn middle(pixel: usize, width: usize) -> Vec2 {
    Vec2::new((pixel % width) as f32 + 0.5, (pixel / width) as f32 + 0.5)
}

/// Where a triangle is in the picture, its corners in pixels; `None` if it is not drawn.
fn window(eye: &Eye, places: [Vec3; 3]) -> Option<[Vec2; 2]> {
    let [a, b, c] = places.map(|p| eye.project_px(p).filter(|px| px.is_finite()));
    let (a, b, c) = (a?, b?, c?);
    Some([a.min(b).min(c), a.max(b).max(c)])
}

fn depth(eye: &Eye, p: Vec3) -> f32 {
    (p - eye.position).dot(eye.forward)
}

/// Where a point on the mirror goes for the rasteriser, so that it orders by distance, linear over the picture: to a depth of
/// 1 / (2 - `distance`), `distance` a share of the largest.
fn ordered(eye: &Eye, place: Vec3, distance: f32) -> Vec3 {
    let along = depth(eye, place);
    if along <= 0.0 {
        return Vec3::NAN;
    }
    eye.position + (place - eye.position) / (along * (2.0 - distance))
}

/// The depth of the part's frontmost back faces by pixel (Roger & Holzschuch section 3.3.6).
fn back_depth(drawing: &Drawing<'_>) -> Vec<f32> {
    let triangles = drawing.back_faces();
    let positions = &drawing.scene.mirrors[drawing.part.mirror].positions;
    let mut seen = Visibility::default();
    let surface = SurfaceMesh { positions, triangles: &triangles, encloses: None };
    seen.update(drawing.eye, &[surface], &[], &mut Scratch::default());
    seen.mirror_depth
}

/// The weights of a triangle's corners that are linear over the picture.
fn linear_weights(eye: &Eye, corners: [Vec3; 3], px: Vec2) -> Option<[f32; 3]> {
    let [a, b, c] = corners.map(|p| eye.project_px(p).map(Vec2::as_dvec2));
    let (a, b, c, p): (DVec2, DVec2, DVec2, DVec2) = (a?, b?, c?, px.as_dvec2());
    let area = (b - a).perp_dot(c - a);
    let weights = [(b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)];
    #[expect(clippy::cast_possible_truncation, reason = "weights are f32 everywhere")]
    let weights = weights.map(|w| (w / area) as f32);
    weights.iter().all(|w| w.is_finite()).then_some(weights)
}
