//! Reflected meshes: the objects' triangles with their vertices where they are seen.

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::images::{Image, Reflecting};
use super::pieces::{Piece, reflected_part, whole};
use super::tessellate::{Goal, tessellate};
use super::{Done, zones};
use crate::camera::Eye;
use crate::error::Result;
use crate::image::{NONE, Reason};
use crate::plan::Reflection;
use crate::plan::search::{Grid, ReflectorPart};
use crate::scene::prepared::PreparedObject;
use crate::scene::shade::Sun;
use crate::visibility::{NONE_ID, RayWeights, Scratch, SurfaceMesh, Visibility};

/// What of an object is drawn.
pub(super) struct Mesh {
    /// By vertex; no vertex of a triangle that is not drawn as a whole is finite.
    images: Vec<Image>,
    /// What is drawn in parts.
    pieces: Vec<Piece>,
    /// The triangles are drawn as a whole, where their vertices are finite.
    whole: bool,
}

/// Whether the centre of a pixel shows the part.
pub(super) fn owns(part: &ReflectorPart, visibility: &Visibility, pixel: usize) -> bool {
    part.triangles.contains(&visibility.mirror_ids[pixel])
}

/// Where a part is in the picture, its corners in pixels; `None` if it is not.
fn window(part: &ReflectorPart, visibility: &Visibility) -> Option<[Vec2; 2]> {
    let width = visibility.size.width as usize;
    let pixels = (0..visibility.mirror_ids.len()).filter(|&pixel| owns(part, visibility, pixel));
    pixels
        .map(|pixel| Vec2::new((pixel % width) as f32, (pixel / width) as f32))
        .map(|corner| [corner, corner + 1.0])
        .reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
}

/// The reflected meshes of all objects.
pub(super) fn meshes(
    reflecting: &Reflecting<'_>,
    longest_px: f32,
    visibility: &Visibility,
    done: &mut Done,
) -> Result<Vec<Mesh>> {
    let window = longest_px.is_finite().then(|| window(reflecting.part, visibility)).flatten();
    done.notes.extend(zones::notes(reflecting)?);
    let objects = reflecting.scene.objects.iter().enumerate();
    let mut list = Vec::new();
    for (i, object) in objects {
        let images = match reflecting.pass.grids.get(i) {
            Some(grid) => by_grid(reflecting, object, grid, done)?,
            None => reflecting.images(&object.positions, done)?,
        };
        let triangles = object.mesh.triangles();
        let (first, positions) = (object.first_triangle, &object.positions);
        list.push(if let Some(window) = window {
            let goal = Goal { longest_px, window };
            let own = (&positions[..], images);
            let pieces = tessellate(reflecting, first, triangles, own, goal, done)?;
            let mut cut = Vec::with_capacity(pieces.len());
            let eye = reflecting.pass.eye;
            let kept = pieces.iter().filter(|piece| goal.keeps(piece, eye));
            kept.for_each(|piece| reflected_part(piece, &mut cut));
            Mesh { images: Vec::new(), pieces: cut, whole: false }
        } else {
            let (mut pieces, at) = (Vec::new(), |i: u32| images[i as usize]);
            for (k, corners) in (0..).zip(triangles) {
                let images = corners.map(at);
                let seen = images.iter().filter(|image| image.height > 0.0).count();
                if seen == 1 || seen == 2 {
                    reflected_part(&whole(first + k, images), &mut pieces);
                }
            }
            Mesh { images, pieces, whole: true }
        });
    }
    Ok(list)
}

/// The vertices' images between those of the corners of their cells (Estalella et al. section 5).
fn by_grid(
    reflecting: &Reflecting<'_>,
    object: &PreparedObject,
    grid: &Grid,
    done: &mut Done,
) -> Result<Vec<Image>> {
    let place = |corner: &Vec3| object.to_scene.point(corner.as_dvec3()).as_vec3();
    let corners: Vec<Vec3> = grid.corners.par_iter().map(place).collect();
    let images = reflecting.images(&corners, done)?;
    let between = |(corners, [x, y, z]): &([u32; 8], [f32; 3])| {
        let none = Image { place: Vec3::ZERO, height: 0.0, distance: 0.0, steps: 0.0 };
        (0..8).fold(none, |sum, k| {
            let along = |bit: usize, t: f32| if k >> bit & 1 == 1 { t } else { 1.0 - t };
            let weight = along(0, *x) * along(1, *y) * along(2, *z);
            let image = images[corners[k] as usize];
            Image {
                place: sum.place + image.place * weight,
                height: sum.height + image.height * weight,
                distance: sum.distance + image.distance * weight,
                steps: sum.steps + image.steps * weight,
            }
        })
    };
    Ok(grid.vertices.par_iter().map(between).collect())
}

/// Where images go for the rasteriser, so that it orders them as the method does.
struct Placing<'a> {
    eye: &'a Eye,
    /// Virtual vertices are where they seem to be. Reflection points are ordered by their distance from the vertex, which is to
    /// be linear over the picture: 1/depth = 2 - `per_distance` · distance.
    per_distance: Option<f32>,
}

impl Placing<'_> {
    fn place(&self, image: &Image) -> Vec3 {
        if image.height <= 0.0 {
            return Vec3::NAN;
        }
        self.place_cut(image)
    }

    /// Also on the edge of the reflected region.
    fn place_cut(&self, image: &Image) -> Vec3 {
        let Some(per_distance) = self.per_distance else { return image.place };
        let offset = image.place - self.eye.position;
        let depth = offset.dot(self.eye.forward);
        if depth <= 0.0 {
            return Vec3::NAN;
        }
        self.eye.position + offset / (depth * (2.0 - per_distance * image.distance))
    }
}

/// Draws meshes on the pixels of the part.
pub(super) fn draw(
    reflecting: &Reflecting<'_>,
    meshes: &[Mesh],
    visibility: &Visibility,
    out: &mut Reflection,
) {
    let (scene, eye) = (reflecting.scene, reflecting.pass.eye);
    let images = meshes.iter().flat_map(|mesh| {
        let corners = mesh.pieces.iter().flat_map(|p| p.corners.iter().map(|c| &c.image));
        mesh.images.iter().chain(corners)
    });
    let farthest = images.map(|i| i.distance).filter(|d| d.is_finite()).fold(0.0, f32::max);
    let affine = !reflecting.draws_virtual();
    let placing =
        Placing { eye, per_distance: affine.then(|| 1.0 / farthest.max(f32::MIN_POSITIVE)) };
    let positions: Vec<Vec<Vec3>> = meshes
        .iter()
        .map(|mesh| {
            let corner = |c: &super::pieces::Corner| placing.place_cut(&c.image);
            let pieces = mesh.pieces.par_iter().flat_map_iter(|p| p.corners.iter().map(corner));
            mesh.images.par_iter().map(|i| placing.place(i)).chain(pieces).collect()
        })
        .collect();
    let triangles: Vec<Vec<[u32; 3]>> = meshes
        .iter()
        .zip(&scene.objects)
        .map(|(mesh, object)| {
            let whole: &[[u32; 3]] = if mesh.whole { object.mesh.triangles() } else { &[] };
            let base = u32::try_from(mesh.images.len()).expect("fewer than 2^32 vertices");
            let pieces =
                (0..).take(mesh.pieces.len()).map(|k: u32| [0, 1, 2].map(|c| base + 3 * k + c));
            whole.iter().copied().chain(pieces).collect()
        })
        .collect();
    let surfaces: Vec<SurfaceMesh<'_>> = positions
        .iter()
        .zip(&triangles)
        .map(|(positions, triangles)| SurfaceMesh { positions, triangles })
        .collect();
    let mut seen = Visibility::default();
    seen.update(eye, &surfaces, &[], &mut Scratch::default());
    let backs = if affine { back_faces(reflecting) } else { Vec::new() };

    let sun = Sun::new(&scene.triangles, &scene.light);
    let width = visibility.size.width as usize;
    let shown: Vec<Shown> = (0..seen.mirror_ids.len())
        .into_par_iter()
        .with_min_len(width)
        .filter_map(|pixel| {
            let id = seen.mirror_ids[pixel];
            if id == NONE_ID || !owns(reflecting.part, visibility, pixel) {
                return None;
            }
            let (object, triangle) = seen.locate(id)?;
            let px = Vec2::new((pixel % width) as f32 + 0.5, (pixel / width) as f32 + 0.5);
            let corners = surfaces[object].corners(triangle);
            let weights = if affine {
                affine_weights(eye, corners, px)
            } else {
                RayWeights::new(eye, corners).at(px.as_dvec2())
            }?;
            let shown = meshes[object].show(&scene.objects[object], triangle, weights);
            let depth = |p: Vec3| (p - eye.position).dot(eye.forward);
            let hidden =
                backs.get(pixel).is_some_and(|&back| depth(shown.image.place) > back * BACK_SLACK);
            (!hidden).then(|| Shown {
                pixel,
                object,
                radiance: scene.radiance_of(&sun, shown.triangle, shown.weights),
                ..shown
            })
        })
        .collect();
    for shown in shown {
        describe(reflecting, &shown, out);
    }
}

/// Reflection points are between a convex reflector's front and its frontmost back faces: a hair on top for the facets.
const BACK_SLACK: f32 = 1.001;

/// The depth of the part's frontmost triangles that face away from the eye (Roger & Holzschuch section 3.3.6).
fn back_faces(reflecting: &Reflecting<'_>) -> Vec<f32> {
    let (scene, part, eye) = (reflecting.scene, reflecting.part, reflecting.pass.eye);
    let mirror = &scene.mirrors[part.mirror];
    let own =
        part.triangles.start - mirror.first_triangle..part.triangles.end - mirror.first_triangle;
    let triangles = &mirror.mesh.triangles()[own.start as usize..own.end as usize];
    let away = |t: &&[u32; 3]| {
        let [a, b, c] = t.map(|i| mirror.positions[i as usize]);
        (b - a).cross(c - a).dot(eye.position - a) < 0.0
    };
    let triangles: Vec<[u32; 3]> = triangles.iter().filter(away).copied().collect();
    let surface = SurfaceMesh { positions: &mirror.positions, triangles: &triangles };
    let mut seen = Visibility::default();
    seen.update(eye, &[surface], &[], &mut Scratch::default());
    seen.mirror_depth
}

/// What a pixel shows.
struct Shown {
    pixel: usize,
    object: usize,
    /// Over all objects.
    triangle: u32,
    weights: [f32; 3],
    /// Between those of the corners.
    image: Image,
    radiance: Vec3,
}

impl Mesh {
    /// What is seen at weights of one of the drawn triangles.
    fn show(&self, object: &PreparedObject, drawn: usize, weights: [f32; 3]) -> Shown {
        let count = if self.whole { object.mesh.triangles().len() } else { 0 };
        let (triangle, images, own) = if drawn < count {
            let corners = object.mesh.triangles()[drawn];
            let triangle = object.first_triangle + u32::try_from(drawn).unwrap_or(0);
            (triangle, corners.map(|i| self.images[i as usize]), weights)
        } else {
            let piece = &self.pieces[drawn - count];
            (piece.parent, piece.corners.map(|c| c.image), piece.parent_weights(weights))
        };
        let mean = |of: fn(&Image) -> f32| (0..3).map(|k| of(&images[k]) * weights[k]).sum();
        Shown {
            pixel: 0,
            object: 0,
            triangle,
            weights: own,
            image: Image {
                place: (0..3).map(|k| images[k].place * weights[k]).sum(),
                height: mean(|image| image.height),
                distance: mean(|image| image.distance),
                steps: mean(|image| image.steps),
            },
            radiance: Vec3::ZERO,
        }
    }
}

/// The weights of a triangle's corners that are linear over the picture.
fn affine_weights(eye: &Eye, corners: [Vec3; 3], px: Vec2) -> Option<[f32; 3]> {
    let [a, b, c] = corners.map(|p| eye.project_px(p).map(Vec2::as_dvec2));
    let (a, b, c, p): (DVec2, DVec2, DVec2, DVec2) = (a?, b?, c?, px.as_dvec2());
    let area = (b - a).perp_dot(c - a);
    let weights = [(b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)];
    #[expect(clippy::cast_possible_truncation, reason = "weights are f32 everywhere")]
    let weights = weights.map(|w| (w / area) as f32);
    weights.iter().all(|w| w.is_finite()).then_some(weights)
}

fn describe(reflecting: &Reflecting<'_>, shown: &Shown, out: &mut Reflection) {
    let scene = reflecting.scene;
    out.radiance[shown.pixel] = shown.radiance;
    out.coverage[shown.pixel] = 1.0;
    if let Some(planes) = out.planes.as_deref_mut() {
        let i = shown.pixel;
        let (position, normal) = scene.surface_at(shown.triangle, shown.weights);
        planes.position[i] = (position.as_dvec3() + scene.origin).as_vec3().to_array();
        planes.normal[i] = normal.to_array();
        planes.lambda[i] = shown.image.distance;
        planes.steps[i] = shown.image.rounded_steps();
        planes.object[i] = u32::try_from(shown.object).unwrap_or(NONE);
        planes.coverage[i] = 1.0;
        planes.reason[i] = Reason::Object as u32;
    }
}
