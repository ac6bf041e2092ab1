//! glTF 2.0 and GLB through the `gltf` crate: the nodes of the default scene, where they stand, with base colours and
//! textures; polished metal becomes a mirror, the first camera the eye.
//!
//! Of the materials, base colour, metalness and roughness count; alpha, emission, skins, morph targets, animations and
//! lights are left out.

use std::collections::BTreeSet;
use std::path::Path;

use glam::{DMat4, DVec3, Mat4, Vec2, Vec3, Vec4};
use gltf::Gltf;
use gltf::mesh::{Mode, Primitive, Semantic};

use self::accessor::Numbers;
use self::materials::Palette;
use super::model::{Assembly, Model, Part};
use super::nearby::Nearby;
use super::{GET_IT_AGAIN, REPAIR, STAGE, defect};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::MeshDefect;
use crate::scene::description::EyeDescription;
use crate::scene::library::unique;

mod accessor;
mod buffers;
mod check;
mod materials;

/// As many nodes stay things of their own; more of them become one, which is culled faster.
const MOST_PARTS: usize = 16;
/// Bytes a vertex while the file is read: positions, normals, colours and texture coordinates, twice.
const VERTEX_BYTES: u64 = 160;

/// Reads a glTF or GLB file.
pub(super) fn read(path: &Path, bytes: &[u8], outside: bool, cx: &Context) -> Result<Model> {
    let mut file =
        Gltf::from_slice_without_validation(bytes).map_err(|e| unreadable(path, bytes, &e))?;
    check::check(path, file.as_json())?;
    let nearby = Nearby::of(path, outside);
    let buffers = buffers::read(path, &mut file, nearby, cx)?;
    let numbers = Numbers { path, buffers: &buffers, cx };
    let placed = nodes(&file);
    check_size(path, &placed, cx)?;
    let mut palette = Palette::read(path, &file, &buffers, nearby, cx)?;

    let mut pieces: Vec<(String, Option<usize>, Assembly)> = Vec::new();
    let mut skipped = false;
    for (done, (node, to_world)) in placed.iter().enumerate() {
        cx.step(STAGE, done as f64 / placed.len() as f64)?;
        let Some(mesh) = node.mesh() else { continue };
        let plain = || format!("node-{}", node.index());
        let name = node.name().or(mesh.name()).map_or_else(plain, str::to_owned);
        for primitive in mesh.primitives() {
            let Some(piece) = triangles(&numbers, &primitive, to_world, &palette)? else {
                skipped = true;
                continue;
            };
            // What of a node is diffuse stays together, as does each of its mirrors' materials.
            let mirror = palette.mirror(&primitive).map(|(material, _)| material);
            match pieces.iter_mut().find(|(n, m, _)| *n == name && *m == mirror) {
                Some((.., all)) => all.append(piece).map_err(|d| defect(path, d))?,
                None => pieces.push((name.clone(), mirror, piece)),
            }
        }
    }
    if skipped {
        palette.notes.push(format!("{}: its points and lines are not shown", path.display()));
    }
    let parts = parts(path, pieces, &palette)?;
    if parts.is_empty() {
        return Err(super::no_faces(path));
    }
    Ok(Model { eye: eye(&placed, &parts), parts, notes: palette.notes })
}

/// Those that can be drawn, with the names that nothing else has.
fn parts(
    path: &Path,
    pieces: Vec<(String, Option<usize>, Assembly)>,
    palette: &Palette,
) -> Result<Vec<Part>> {
    let merges = pieces.iter().filter(|(_, mirror, _)| mirror.is_none()).count() > MOST_PARTS;
    let mut kept: Vec<(String, Option<usize>, Assembly)> = Vec::new();
    for (name, mirror, piece) in pieces {
        match kept.iter_mut().find(|(_, m, _)| merges && *m == mirror) {
            Some((.., all)) => all.append(piece).map_err(|d| defect(path, d))?,
            None if merges && mirror.is_none() => kept.push(("diffuse".into(), mirror, piece)),
            None => kept.push((name, mirror, piece)),
        }
    }
    let (mut parts, mut taken) = (Vec::new(), Vec::new());
    for (name, mirror, piece) in kept {
        let name = unique(&name, &taken);
        let tint = mirror.map(|material| palette.tint(material));
        let piece = if tint.is_some() {
            Assembly { of_triangle: vec![], uv: vec![], materials: vec![], ..piece }
        } else {
            piece
        };
        match piece.part(name.clone(), tint) {
            Ok(part) => {
                taken.push(name);
                parts.push(part);
            }
            // Nothing to be seen: others may be.
            Err(MeshDefect::Empty | MeshDefect::ZeroArea) => {}
            Err(d) => return Err(defect(path, d)),
        }
    }
    Ok(parts)
}

fn unreadable(path: &Path, bytes: &[u8], error: &gltf::Error) -> Error {
    if is_version_1(bytes) {
        let problem = "is glTF 1.0, which is not supported";
        return Error::file(path, "", problem, "export or convert it to glTF 2.0");
    }
    let error = one_line(&error.to_string());
    Error::file(path, "", format!("is not a glTF file that can be read: {error}"), GET_IT_AGAIN)
}

fn is_version_1(bytes: &[u8]) -> bool {
    if bytes.starts_with(b"glTF") {
        return bytes.get(4..8) == Some(&[1, 0, 0, 0]);
    }
    let file = serde_json::from_slice::<serde_json::Value>(bytes).unwrap_or_default();
    let version = &file["asset"]["version"];
    version.as_str().is_some_and(|text| text.starts_with("1.")) || version.as_f64() == Some(1.0)
}

/// What others say, as part of a message of one line.
fn one_line(text: &str) -> String {
    text.split_whitespace().take(40).collect::<Vec<_>>().join(" ")
}

type Placed<'a> = (gltf::Node<'a>, DMat4);

/// All nodes of the scene with their places, each once: a damaged file may go in circles.
fn nodes(file: &Gltf) -> Vec<Placed<'_>> {
    let scene = file.default_scene().or_else(|| file.scenes().next());
    let mut open: Vec<Placed<'_>> = match scene {
        Some(scene) => scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect(),
        None => file.nodes().map(|node| (node, DMat4::IDENTITY)).collect(),
    };
    open.reverse();
    let (mut seen, mut all) = (BTreeSet::new(), Vec::new());
    while let Some((node, parent)) = open.pop() {
        if !seen.insert(node.index()) {
            continue;
        }
        let own = Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
        let to_world = parent * own;
        let children: Vec<Placed<'_>> = node.children().map(|child| (child, to_world)).collect();
        open.extend(children.into_iter().rev());
        all.push((node, to_world));
    }
    all
}

/// A small file may show the same mesh very often.
fn check_size(path: &Path, placed: &[Placed<'_>], cx: &Context) -> Result<()> {
    let vertices = |p: Primitive<'_>| {
        let indices = p.indices().map_or(0, |i| i.count() as u64);
        let positions = p.get(&Semantic::Positions).map_or(0, |p| p.count() as u64);
        indices.max(positions)
    };
    let meshes = placed.iter().filter_map(|(node, _)| node.mesh());
    let total = meshes.flat_map(|m| m.primitives()).map(vertices).fold(0, u64::saturating_add);
    let what = format!("{total} vertices");
    cx.room_for(&path.display().to_string(), &what, total.saturating_mul(VERTEX_BYTES))
}

/// A primitive in its place; `None` if it has no triangles.
fn triangles(
    numbers: &Numbers<'_>,
    primitive: &Primitive<'_>,
    to_world: &DMat4,
    palette: &Palette,
) -> Result<Option<Assembly>> {
    let Some(positions) = primitive.get(&Semantic::Positions) else { return Ok(None) };
    let mode = primitive.mode();
    if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
        return Ok(None);
    }
    let positions = numbers.vectors::<3>(&positions)?;
    let count = positions.len();
    let vertices = |semantic: &Semantic| -> Result<Vec<Vec3>> {
        let Some(accessor) = primitive.get(semantic) else { return Ok(Vec::new()) };
        let mut list: Vec<Vec3> =
            numbers.vectors::<3>(&accessor)?.into_iter().map(Vec3::from_array).collect();
        list.resize(count, if *semantic == Semantic::Normals { Vec3::ZERO } else { Vec3::ONE });
        Ok(list)
    };
    let (normals, colors) = (vertices(&Semantic::Normals)?, vertices(&Semantic::Colors(0))?);
    let indices: Vec<u32> = match primitive.indices() {
        Some(accessor) => numbers.indices(&accessor)?,
        None => (0..u32::try_from(count).unwrap_or(u32::MAX)).collect(),
    };
    if let Some(index) = indices.iter().find(|&&i| i as usize >= count) {
        let problem = format!("names vertex {index}, but there are {count} vertices");
        let place = format!("primitive {}", primitive.index());
        return Err(Error::file(numbers.path, place, problem, REPAIR));
    }
    let corners = corners(mode, &indices, to_world.determinant() < 0.0);
    let uv = match palette.coordinates(primitive) {
        Some((set, transform)) => match primitive.get(&Semantic::TexCoords(set)) {
            Some(accessor) => {
                let all = numbers.vectors::<2>(&accessor)?;
                let at = |i: u32| {
                    let uv = all.get(i as usize).copied().unwrap_or_default();
                    transform.transform_point2(Vec2::from_array(uv))
                };
                corners.iter().map(|t| t.map(at)).collect()
            }
            None => Vec::new(),
        },
        None => Vec::new(),
    };
    let to_normals = to_world.inverse().transpose();
    let piece = Assembly {
        positions: positions
            .into_iter()
            .map(|p| to_world.transform_point3(Vec3::from_array(p).as_dvec3()).as_vec3())
            .collect(),
        normals: normals
            .into_iter()
            .map(|n| {
                let turned = to_normals.transform_vector3(n.as_dvec3()).normalize_or(DVec3::ZERO);
                turned.as_vec3()
            })
            .collect(),
        colors: colors.into_iter().map(|c| c.clamp(Vec3::ZERO, Vec3::ONE)).collect(),
        of_triangle: vec![0; corners.len()],
        triangles: corners,
        uv,
        materials: vec![palette.material(primitive)],
    };
    if let Some(vertex) = piece.not_finite() {
        return Err(defect(numbers.path, MeshDefect::NotFinite { vertex }));
    }
    Ok(Some(piece))
}

/// The corners of the triangles that indices stand for; a mirroring turns them over.
fn corners(mode: Mode, indices: &[u32], mirrored: bool) -> Vec<[u32; 3]> {
    let triples: Vec<[u32; 3]> = match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })
            .collect(),
        Mode::TriangleFan => indices.windows(2).skip(1).map(|t| [indices[0], t[0], t[1]]).collect(),
        _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    };
    if mirrored { triples.into_iter().map(|[a, b, c]| [a, c, b]).collect() } else { triples }
}

/// What the first camera with a perspective sees.
fn eye(placed: &[Placed<'_>], parts: &[Part]) -> Option<EyeDescription> {
    let camera = |(node, to_world): &Placed<'_>| match node.camera()?.projection() {
        gltf::camera::Projection::Perspective(p) => Some((f64::from(p.yfov()), *to_world)),
        gltf::camera::Projection::Orthographic(_) => None,
    };
    let (fov_y, to_world) = placed.iter().find_map(camera)?;
    let position = to_world.transform_point3(DVec3::ZERO);
    let forward = to_world.transform_vector3(DVec3::NEG_Z).try_normalize()?;
    let up = to_world.transform_vector3(DVec3::Y).try_normalize()?;
    // The target is what an orbit turns about: as far away as the mirrors, or else everything.
    let mirrors = parts.iter().filter(|p| p.mirror.is_some());
    let nearest = |distance: f64, part: &Part| {
        let center = part.mesh.bounds().center().as_dvec3();
        distance.min((center - position).dot(forward).max(0.0))
    };
    let of_mirrors = mirrors.fold(f64::INFINITY, nearest);
    let distance =
        if of_mirrors.is_finite() { of_mirrors } else { parts.iter().fold(f64::INFINITY, nearest) };
    let distance = if distance.is_finite() && distance > 1e-3 { distance } else { 1.0 };
    let good = fov_y > 0.0 && fov_y < std::f64::consts::PI && position.abs().max_element() < 1e15;
    good.then_some(EyeDescription { position, target: position + forward * distance, up, fov_y })
}

/// A linear RGBA factor without its alpha.
fn rgb(factor: [f32; 4]) -> Vec3 {
    let color = Vec4::from_array(factor).truncate().clamp(Vec3::ZERO, Vec3::ONE);
    if color.is_finite() { color } else { Vec3::ONE }
}

#[cfg(test)]
mod tests;
