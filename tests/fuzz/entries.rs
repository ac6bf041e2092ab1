//! What is fuzzed, by name: used by the targets here and by the replay on stable Rust (`tests/mutations`).
//!
//! Nothing of it may panic, hang, take more memory than it is allowed, or make a pixel that is no number. Errors are fine.

use std::cell::RefCell;
use std::path::Path;

use catoptric::Context;
use catoptric::context::MemoryLimit;
use catoptric::scene::environment::image::Mounting;
use catoptric::scene::load::{self, ReadOptions};
use catoptric::scene::prepared::{PrepareOptions, PreparedScene};
use catoptric::scene::scan::{self, CloudOptions};

#[path = "planner.rs"]
mod planner;

/// All targets.
#[allow(dead_code, reason = "the replay goes through them")]
pub const TARGETS: [&str; 9] =
    ["obj", "mtl", "ply", "stl", "gltf", "points", "panorama", "scene", "planner"];

/// Bytes that may be asked for; what is taken already does not count here.
const ALLOWED: u64 = 64 << 20;

/// Runs a target, and says whether the bytes were taken for something.
///
/// # Panics
/// If something is wrong with the program.
pub fn run(target: &str, bytes: &[u8]) -> bool {
    let limit = MemoryLimit { bytes: ALLOWED, taken: || 0 };
    let cx = Context::default().with_memory(Some(limit));
    match target {
        "obj" => model("a.obj", bytes, &cx),
        "ply" => model("a.ply", bytes, &cx),
        "stl" => model("a.stl", bytes, &cx),
        "gltf" => model(if bytes.starts_with(b"glTF") { "a.glb" } else { "a.gltf" }, bytes, &cx),
        "mtl" => materials(bytes, &cx),
        "points" => points(bytes, &cx),
        "panorama" => panorama(bytes, &cx),
        "scene" => scene(bytes, &cx),
        "planner" => planner::run(bytes).is_some(),
        other => panic!("there is no target {other}"),
    }
}

fn model(name: &str, bytes: &[u8], cx: &Context) -> bool {
    let options = ReadOptions::default();
    let Ok(model) = load::model_of_bytes(Path::new(name), bytes, &options, cx) else {
        return false;
    };
    assert!(!model.parts.is_empty(), "a model without parts");
    for part in &model.parts {
        // What was let in can be sampled.
        let paint = part.paint.clone();
        let paint = paint.unwrap_or(catoptric::scene::description::Paint::Vertex);
        if part.mesh.triangles().len() < 10_000 {
            let surfels = catoptric::scene::sample::sample(&part.mesh, &paint, 16, 1, cx);
            let surfels = surfels.expect("a checked mesh can be sampled");
            assert!(surfels.normals.iter().chain(&surfels.albedo).all(|v| v.is_finite()));
            assert!(surfels.x.iter().chain(&surfels.extent).all(|v| v.is_finite()));
        }
    }
    let merged = model.merged(Path::new(name));
    assert!(merged.is_ok(), "{merged:?}");
    true
}

/// A folder of this thread's own, in memory where the system has such a place.
fn in_folder(work: impl FnOnce(&Path) -> bool) -> bool {
    thread_local! {
        static FOLDER: RefCell<Option<tempfile::TempDir>> = const { RefCell::new(None) };
    }
    FOLDER.with_borrow_mut(|folder| {
        let folder = folder.get_or_insert_with(|| {
            let fast = tempfile::Builder::new().tempdir_in("/dev/shm");
            fast.or_else(|_| tempfile::tempdir()).expect("a folder")
        });
        work(folder.path())
    })
}

const PAINTED: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
    usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 2/2 4/1 3/3\n";

/// The materials of an OBJ file; the bytes are also there as a texture.
fn materials(bytes: &[u8], cx: &Context) -> bool {
    in_folder(|folder| {
        std::fs::write(folder.join("a.mtl"), bytes).expect("writable");
        std::fs::write(folder.join("a.png"), bytes).expect("writable");
        let text = PAINTED.as_bytes();
        let options = ReadOptions::default();
        let model = match load::model_of_bytes(&folder.join("a.obj"), text, &options, cx) {
            Ok(model) => model,
            // Only what does not go into the memory is refused: the rest is noted.
            Err(error) => {
                assert!(error.to_string().contains("--max-memory"), "{error}");
                return false;
            }
        };
        for part in &model.parts {
            let paint = part.paint.clone();
            let color = paint.map(|p| p.color(&part.mesh, 0, [0.2, 0.3, 0.5], 0.1));
            assert!(color.is_none_or(|c| c.is_finite()), "{color:?}");
        }
        model.parts.iter().any(|part| part.paint.is_some() || part.mirror.is_some())
    })
}

/// A cloud, of the format that the bytes begin as.
fn points(bytes: &[u8], cx: &Context) -> bool {
    let name = match bytes {
        [b'L', b'A', b'S', b'F', ..] if bytes.get(104).is_some_and(|f| f & 0x80 != 0) => "a.laz",
        [b'L', b'A', b'S', b'F', ..] => "a.las",
        [0x93, b'N', b'U', ..] => "a.npy",
        [b'p', b'l', b'y', ..] => "a.ply",
        _ => "a.xyz",
    };
    in_folder(|folder| {
        let path = folder.join(name);
        std::fs::write(&path, bytes).expect("writable");
        let Ok(cloud) = scan::cloud(&path, &CloudOptions::default(), cx) else { return false };
        let s = &cloud.surfels;
        assert!(s.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3), "unit normals");
        assert!(s.albedo.iter().all(|c| c.is_finite()), "colours");
        let numbers = s.x.iter().chain(&s.y).chain(&s.z).chain(&s.extent);
        assert!({ numbers }.all(|v| v.is_finite()), "places and extents");
        let mesh = scan::disks(s, 100, cloud.has_colors, cx);
        assert!(mesh.is_ok());
        true
    })
}

fn panorama(bytes: &[u8], cx: &Context) -> bool {
    in_folder(|folder| {
        let path = folder.join("a.png");
        std::fs::write(&path, bytes).expect("writable");
        let Ok(environment) = load::environment(&path, Mounting::default(), cx) else {
            return false;
        };
        let (to_sun, white) = (glam::Vec3::Y, glam::Vec3::ONE);
        let light = catoptric::scene::description::Light { to_sun, sun: white, ambient: white };
        for direction in [glam::Vec3::X, glam::Vec3::NEG_Y, glam::Vec3::NEG_Z] {
            assert!(environment.radiance(direction, &light).is_finite());
        }
        true
    })
}

/// A scene file in an empty folder; a small one is prepared, too.
fn scene(bytes: &[u8], cx: &Context) -> bool {
    let Ok(text) = str::from_utf8(bytes) else { return false };
    in_folder(|folder| {
        let options = ReadOptions::default();
        let Ok(scene) = catoptric::scene::file::parse(text, "a.toml", folder, &options, cx) else {
            return false;
        };
        let meshes = scene.mirrors.iter().map(|m| &m.mesh);
        let triangles: usize = meshes
            .chain(scene.objects.iter().map(|o| &o.mesh))
            .map(|mesh| mesh.triangles().len())
            .sum();
        if triangles < 20_000 {
            let options = PrepareOptions { surfels: 500, ..PrepareOptions::default() };
            let prepared = PreparedScene::new(&scene, &options, cx);
            assert!(prepared.is_ok(), "{:?}", prepared.err());
        }
        true
    })
}
