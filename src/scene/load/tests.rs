use std::sync::atomic::Ordering;

use glam::Vec3;

use super::*;
use crate::geometry::Mesh;

mod environment;
mod obj;
mod ply;
mod stl;

fn load(name: &str, bytes: &[u8]) -> Result<Mesh> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    mesh(&path, &Context::default())
}

/// All of a file as one mesh.
fn mesh(path: &Path, cx: &Context) -> Result<Mesh> {
    let part = model(path, &ReadOptions::default(), cx)?.merged(path)?;
    Ok((*part.mesh).clone())
}

/// The error's place and problem, which must come with the file's name and a remedy.
fn complaint(name: &str, bytes: &[u8]) -> String {
    match load(name, bytes) {
        Err(Error::Input { name: named, place, problem, remedy }) => {
            assert!(named.ends_with(name) && !remedy.is_empty());
            assert!(!(place.clone() + &problem + &remedy).contains('\n'), "{problem}");
            if place.is_empty() { problem } else { format!("{place}: {problem}") }
        }
        other => panic!("{name}: {other:?}"),
    }
}

/// A tent of four corners, with normals and colours: a quad folded along 0–2 and a triangle.
const POSITIONS: [[f32; 3]; 4] =
    [[0.0, 0.5, -1.0], [1.0, 0.0, 0.25], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]];
const COLORS: [[u8; 3]; 4] = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [51, 102, 204]];
const POLYGONS: [&[u32]; 2] = [&[0, 1, 2, 3], &[2, 1, 3]];

fn normals() -> [[f32; 3]; 4] {
    [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]
}

/// What every file of the tent must give.
#[expect(clippy::cast_possible_truncation, reason = "rounded to the stored precision")]
fn tent(with_normals: bool, with_colors: bool) -> Mesh {
    // sRGB by the standard's own formula, in f64.
    let linear = |v: u8| {
        let v = f64::from(v) / 255.0;
        let l = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
        l as f32
    };
    Mesh::new(
        POSITIONS.map(Vec3::from_array).to_vec(),
        if with_normals { normals().map(Vec3::from_array).to_vec() } else { vec![] },
        if with_colors { COLORS.map(|c| Vec3::from_array(c.map(linear))).to_vec() } else { vec![] },
        vec![[0, 1, 2], [0, 2, 3], [2, 1, 3]],
    )
    .unwrap()
}

/// Equal but for rounding in the colours.
fn assert_same(found: &Mesh, wanted: &Mesh, what: &str) {
    assert_eq!(found.positions(), wanted.positions(), "{what}");
    assert_eq!(found.normals(), wanted.normals(), "{what}");
    assert_eq!(found.triangles(), wanted.triangles(), "{what}");
    assert_eq!(found.colors().len(), wanted.colors().len(), "{what}");
    for (f, w) in found.colors().iter().zip(wanted.colors()) {
        assert!((f - w).abs().max_element() < 1e-6, "{what}: {f} is not {w}");
    }
}

#[test]
fn files_that_are_no_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let fail =
        |name: &str| mesh(&folder.path().join(name), &Context::default()).unwrap_err().to_string();
    assert!(fail("none.obj").contains("does not exist"));
    assert!(fail("none.ply").contains("does not exist"));
    fs::create_dir(folder.path().join("folder.ply")).unwrap();
    assert!(fail("folder.ply").contains("is a folder"));
    for name in ["a.obj", "a.ply", "a.stl", "a.gltf", "a.glb"] {
        assert_eq!(complaint(name, b""), "is empty");
    }
    for name in ["a.3ds", "ply", "a.ply.gz"] {
        assert!(complaint(name, b"solid").contains("kind"), "{name}");
    }
    let unknown = load("a.3ds", b"solid").unwrap_err().to_string();
    assert!(unknown.contains(".txt and .npy"), "{unknown}");
}

#[test]
fn loading_can_be_cancelled() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in [
        ("a.ply", ply::written("ascii", "float", None, ply::FACES)),
        ("a.obj", obj::written("f 1 2 3\n", true)),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let cx = Context::default();
        assert!(mesh(&path, &cx).is_ok());
        cx.cancel_flag().store(true, Ordering::Relaxed);
        assert!(matches!(mesh(&path, &cx), Err(Error::Cancelled)));
    }
}
