//! Reflected meshes: the objects' triangles with their vertices where they are seen.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::images::{Image, Reflecting};
use super::pieces::{Piece, reflected_part, whole};
use super::raster::{Drawing, Drawn, Hit};
use super::tessellate::{Goal, tessellate};
use super::{Done, zones};
use crate::error::Result;
use crate::image::{NONE, Reason};
use crate::plan::Reflection;
use crate::plan::search::{Grid, ReflectorPart};
use crate::scene::prepared::PreparedObject;
use crate::scene::shade::Sun;
use crate::visibility::Visibility;

/// What of an object is drawn.
pub(super) struct Mesh {
    /// By vertex; no vertex of a triangle that is not drawn as a whole is finite.
    images: Vec<Image>,
    /// What is drawn in parts.
    pieces: Vec<Piece>,
    /// The triangles are drawn as a whole, where their vertices are finite.
    whole: bool,
}

/// Where a part is in the picture, its corners in pixels; `None` if it is not.
fn window(part: &ReflectorPart, visibility: &Visibility) -> Option<[Vec2; 2]> {
    let width = visibility.size.width as usize;
    let pixels = (0..visibility.mirror_ids.len()).filter(|&pixel| part.owns(visibility, pixel));
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
    let mut coarse: Vec<(f32, &str)> = Vec::new();
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
            // A mirror that is not in the picture is not divided for, and shows nothing wrong.
            let drawn_straight = longest_px.is_infinite();
            let edge = longest_edge(reflecting, triangles, &images, visibility);
            if drawn_straight && edge > LONG_EDGE_PX {
                coarse.push((edge, &object.name));
            }
            Mesh { images, pieces, whole: true }
        });
    }
    if let Some((edge, name)) = coarse.iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
        let others = match coarse.len() {
            1 => String::new(),
            n => format!(" ({} more objects have such)", n - 1),
        };
        done.notes.push(format!(
            "edges of {name} have images of {edge:.0} pixels, drawn straight{others}: --tessellate 8 divides them"
        ));
    }
    Ok(list)
}

/// Longer straight images of edges are worth a note, pixels.
const LONG_EDGE_PX: f32 = 60.0;

/// The longest image of an edge within the picture, pixels.
fn longest_edge(
    reflecting: &Reflecting<'_>,
    triangles: &[[u32; 3]],
    images: &[Image],
    visibility: &Visibility,
) -> f32 {
    let size = Vec2::new(visibility.size.width as f32, visibility.size.height as f32);
    let px = |i: u32| {
        let image = &images[i as usize];
        let px = reflecting.pass.eye.project_px(image.place).filter(|_| image.height > 0.0)?;
        (px.cmpge(Vec2::ZERO).all() && px.cmple(size).all()).then_some(px)
    };
    let edge = |a: u32, b: u32| px(a).zip(px(b)).map_or(0.0, |(a, b)| a.distance(b));
    let longest = |t: &[u32; 3]| edge(t[0], t[1]).max(edge(t[1], t[2])).max(edge(t[2], t[0]));
    triangles.par_iter().map(longest).reduce(|| 0.0, f32::max)
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

/// Draws meshes on the pixels of the part.
pub(super) fn draw(
    reflecting: &Reflecting<'_>,
    meshes: &[Mesh],
    visibility: &Visibility,
    out: &mut Reflection,
) -> Result<()> {
    let (scene, eye) = (reflecting.scene, reflecting.pass.eye);
    let objects: Vec<Drawn> =
        meshes.iter().zip(&scene.objects).map(|(mesh, object)| mesh.drawn(object)).collect();
    let hits = reflecting.backend.rasterise(&Drawing {
        eye,
        scene,
        visibility,
        part: reflecting.part,
        objects: &objects,
        on_mirror: !reflecting.draws_virtual(),
    })?;
    let sun = Sun::new(&scene.triangles, &scene.light);
    let show = |hit: &Hit| {
        let shown = meshes[hit.object].show(&scene.objects[hit.object], hit.triangle, hit.weights);
        let radiance = scene.radiance_of(&sun, shown.triangle, shown.weights);
        Shown { pixel: hit.pixel, object: hit.object, radiance, ..shown }
    };
    let shown: Vec<Shown> = hits.par_iter().map(show).collect();
    shown.iter().for_each(|shown| describe(reflecting, shown, out));
    Ok(())
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
    /// The images for the rasteriser: those of whole triangles are in the reflected region, those of pieces may be on its edge.
    fn drawn(&self, object: &PreparedObject) -> Drawn {
        let reflected = |i: &Image| if i.height > 0.0 { i.place } else { Vec3::NAN };
        let cut = || self.pieces.par_iter().flat_map_iter(|p| p.corners.iter().map(|c| &c.image));
        let whole: &[[u32; 3]] = if self.whole { object.mesh.triangles() } else { &[] };
        let base = u32::try_from(self.images.len()).expect("fewer than 2^32 vertices");
        let pieces =
            (0..).take(self.pieces.len()).map(|k: u32| [0, 1, 2].map(|c| base + 3 * k + c));
        Drawn {
            places: self.images.par_iter().map(reflected).chain(cut().map(|i| i.place)).collect(),
            distances: self.images.par_iter().chain(cut()).map(|i| i.distance).collect(),
            triangles: whole.iter().copied().chain(pieces).collect(),
        }
    }

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
