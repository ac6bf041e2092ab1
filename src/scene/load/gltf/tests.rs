use std::io::Cursor;
use std::path::Path;

use base64::Engine as _;
use glam::{Vec2, Vec3};
use serde_json::{Value, json};

use crate::context::{Context, MemoryLimit};
use crate::scene::description::Paint;
use crate::scene::load::{Model, ReadOptions, model_of_bytes};

fn data(bytes: &[u8], kind: &str) -> String {
    let text = base64::engine::general_purpose::STANDARD.encode(bytes);
    format!("data:{kind};base64,{text}")
}

fn floats(list: &[f32]) -> Vec<u8> {
    list.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A unit square in the xy plane, its texture coordinates, the indices of its triangles, and a red value to replace.
fn buffer() -> Vec<u8> {
    let mut bytes = floats(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]); // 0..48
    bytes.extend(floats(&[0., 1., 1., 1., 1., 0., 0., 0.])); // 48..80
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes())); // 80..92
    bytes.extend([2u8, 0, 0, 0]); // 92..96: a sparse index
    bytes.extend(floats(&[1.0, 1.0, 0.5])); // 96..108: its value
    bytes
}

/// White above, black below.
fn picture() -> Vec<u8> {
    let texture =
        image::RgbImage::from_fn(2, 2, |_, y| image::Rgb([if y == 0 { 255 } else { 0 }; 3]));
    let mut bytes = Cursor::new(Vec::new());
    texture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// A textured square, a mirror moved aside, the square once more mirrored and tinted, and a camera.
fn scene() -> Value {
    let view = |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0, 3] }],
        "nodes": [
            { "name": "things", "translation": [10, 0, 0], "children": [1, 2] },
            { "name": "board", "mesh": 0 },
            { "name": "glass", "mesh": 1, "translation": [0, 0, -2], "scale": [-2, 2, 2] },
            { "camera": 0, "translation": [10, 1, 5] },
        ],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }],
        "meshes": [
            { "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 0 }] },
            { "primitives": [{ "attributes": { "POSITION": 3 }, "indices": 2, "material": 1 }] },
        ],
        "materials": [
            { "pbrMetallicRoughness": { "baseColorFactor": [1, 0.5, 0.25, 1], "metallicFactor": 0, "baseColorTexture": { "index": 0 } } },
            { "pbrMetallicRoughness": { "baseColorFactor": [0.9, 0.8, 0.7, 1], "metallicFactor": 1, "roughnessFactor": 0.05 } },
        ],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "wrapS": 33071, "wrapT": 33071 }],
        "images": [{ "uri": data(&picture(), "image/png") }],
        "buffers": [{ "byteLength": 108, "uri": data(&buffer(), "application/octet-stream") }],
        "bufferViews": [view(0, 48), view(48, 32), view(80, 12), view(92, 1), view(96, 12)],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR" },
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0.5],
              "sparse": { "count": 1, "indices": { "bufferView": 3, "componentType": 5121 }, "values": { "bufferView": 4 } } },
        ],
    })
}

fn read_in(folder: &Path, value: &Value, outside: bool) -> Result<Model, String> {
    let limit = MemoryLimit { bytes: 1 << 30, taken: || 0 };
    let cx = Context::default().with_memory(Some(limit));
    let bytes = serde_json::to_vec(value).unwrap();
    let options = ReadOptions { outside, ..ReadOptions::default() };
    model_of_bytes(&folder.join("a.gltf"), &bytes, &options, &cx).map_err(|e| e.to_string())
}

fn read(value: &Value) -> Result<Model, String> {
    read_in(Path::new("nowhere"), value, false)
}

#[test]
fn a_scene_with_a_mirror_a_texture_and_a_camera() {
    let model = read(&scene()).unwrap();
    assert_eq!(model.notes, Vec::<String>::new());
    let [board, glass] = &model.parts[..] else { panic!("{:?}", model.parts) };
    assert_eq!((board.name.as_str(), glass.name.as_str()), ("board", "glass"));
    assert_eq!(board.mesh.positions()[2], Vec3::new(11.0, 1.0, 0.0));
    let paint = board.paint.clone().unwrap();
    let at = |v: f32| paint.color(&board.mesh, 0, [1.0 - v, 0.0, v], 0.0);
    assert_eq!((at(0.25), at(0.75)), (Vec3::ZERO, Vec3::new(1.0, 0.5, 0.25)));
    assert_eq!(glass.mirror, Some(Vec3::new(0.9, 0.8, 0.7)));
    // Mirrored by its scale: turned over, it still faces the camera; its third corner was replaced.
    assert_eq!(glass.mesh.positions()[2], Vec3::new(8.0, 2.0, -1.0));
    let [a, b, c] = glass.mesh.corners(1);
    assert!((b - a).cross(c - a).z > 0.0);
    let eye = model.eye.unwrap();
    assert_eq!((eye.position.as_vec3(), eye.fov_y), (Vec3::new(10.0, 1.0, 5.0), 0.5));
    assert!(eye.target.z < 0.0 && eye.target.x == 10.0, "in front of the mirror: {}", eye.target);
}

#[test]
fn texture_transforms_move_the_picture() {
    let mut value = scene();
    // Upside down about the middle.
    let transform = json!({ "offset": [1, 1], "rotation": std::f64::consts::PI });
    value["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({ "KHR_texture_transform": transform });
    value["extensionsUsed"] = json!(["KHR_texture_transform"]);
    let model = read(&value).unwrap();
    let Some(Paint::Materials(materials)) = &model.parts[0].paint else { panic!() };
    let color = materials.color(0, [0.75, 0.0, 0.25], 0.0);
    assert!(color.abs_diff_eq(Vec3::new(1.0, 0.5, 0.25), 1e-5), "{color}");
    assert_eq!(materials.list()[0].texture.as_ref().unwrap().size(), Vec2::splat(2.0));
}

#[test]
fn glb_is_the_same() {
    let mut value = scene();
    let mut chunk = buffer();
    value["buffers"][0] = json!({ "byteLength": chunk.len() });
    let mut text = serde_json::to_vec(&value).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    chunk.resize(chunk.len().next_multiple_of(4), 0);
    let total = u32::try_from(12 + 8 + text.len() + 8 + chunk.len()).unwrap();
    let mut bytes = b"glTF".to_vec();
    bytes.extend([2, total].iter().flat_map(|v| v.to_le_bytes()));
    for (kind, part) in [(b"JSON", &text), (b"BIN\0", &chunk)] {
        bytes.extend(u32::try_from(part.len()).unwrap().to_le_bytes());
        bytes.extend(kind);
        bytes.extend(part);
    }
    let of = |bytes: &[u8]| {
        let (options, cx) = (ReadOptions::default(), Context::default());
        model_of_bytes(Path::new("a.glb"), bytes, &options, &cx)
    };
    let (model, same) = (of(&bytes).unwrap(), read(&scene()).unwrap());
    assert_eq!(model.parts[1].mesh, same.parts[1].mesh);
    assert_eq!(model.parts[0].paint, same.parts[0].paint);
    for end in 0..bytes.len() {
        assert!(of(&bytes[..end]).is_err(), "cut at {end}");
    }
}

#[test]
fn many_nodes_become_one_thing() {
    let mut value = scene();
    let more: Vec<Value> = (0..20).map(|_| json!({ "mesh": 0 })).collect();
    value["nodes"].as_array_mut().unwrap().extend(more);
    value["scenes"][0]["nodes"] = (0..24).filter(|i| ![1, 2].contains(i)).collect();
    let model = read(&value).unwrap();
    let names: Vec<&str> = model.parts.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["diffuse", "glass"]);
    assert_eq!(model.parts[0].mesh.triangles().len(), 42);
}

#[test]
fn files_are_taken_from_the_folder_only() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    std::fs::write(folder.path().join("b.bin"), buffer()).unwrap();
    std::fs::write(inner.join("my b.bin"), buffer()).unwrap();
    let with = |uri: &str| {
        let mut value = scene();
        value["buffers"][0]["uri"] = uri.into();
        value
    };
    assert!(read_in(&inner, &with("my%20b.bin"), false).is_ok());
    let refused = read_in(&inner, &with("../b.bin"), false).unwrap_err();
    assert!(refused.contains("buffer 0: ../b.bin lies outside"), "{refused}");
    assert!(read_in(&inner, &with("../b.bin"), true).is_ok());
    let missing = read_in(&inner, &with("c.bin"), false).unwrap_err();
    assert!(missing.contains("c.bin does not exist"), "{missing}");
}

#[test]
fn what_is_wrong_is_named() {
    let complaint = |change: &dyn Fn(&mut Value)| {
        let mut value = scene();
        change(&mut value);
        read(&value).err().unwrap_or_default()
    };
    let set = |path: &'static str, to: Value| {
        move |value: &mut Value| *value.pointer_mut(path).expect("it is there") = to.clone()
    };
    for (path, to, wanted) in [
        ("/accessors/0/count", json!(5), "accessor 0: promises 5 elements"),
        ("/accessors/0/count", json!(1 << 20), "accessor 0: promises"),
        ("/accessors/0/byteOffset", json!(u64::MAX - 7), "accessor 0: promises"),
        ("/accessors/0/type", json!("VEC2"), "accessor 0: has 2 components where 3"),
        ("/accessors/2/componentType", json!(5126), "accessor 2: has indices that are no integers"),
        ("/bufferViews/1/byteStride", json!(4), "accessor 1: has elements of 8 bytes, 4 apart"),
        ("/bufferViews/0/byteLength", json!(47), "accessor 0: promises"),
        ("/bufferViews/3/byteOffset", json!(98), "accessor 3: replaces element 128"),
        ("/buffers/0/byteLength", json!(109), "buffer 0: has 108 bytes, but the file promises 109"),
        ("/buffers/0/uri", json!("data:x;base64,?"), "buffer 0: has data that is not base64"),
        ("/nodes/1/mesh", json!(7), "is not valid glTF"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(9), "names an accessor that"),
        ("/images/0", json!({}), "images[0]: has neither data nor a name"),
        ("/images/0", json!({ "bufferView": 0 }), "images[0]: has no mimeType"),
    ] {
        let found = match path {
            "/accessors/0/byteOffset" | "/bufferViews/1/byteStride" => complaint(&|value| {
                let (parent, key) = path.rsplit_once('/').unwrap();
                value.pointer_mut(parent).unwrap()[key] = to.clone();
            }),
            _ => complaint(&set(path, to.clone())),
        };
        assert!(found.contains(wanted), "{path} = {to}:\n  {found}\n  instead of {wanted}");
    }
    // Whose data have no place of their own then.
    let compressed = complaint(&|v| {
        v["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
        v["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    });
    assert!(compressed.contains("without compression"), "{compressed}");
    let old = complaint(&|v| {
        v["asset"]["version"] = json!("1.0");
        v["nodes"] = json!({});
    });
    assert!(old.contains("is glTF 1.0, which is not supported"), "{old}");
    let binary = [b"glTF".as_slice(), &[1, 0, 0, 0, 20, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]].concat();
    let path = Path::new("a.glb");
    let old = model_of_bytes(path, &binary, &ReadOptions::default(), &Context::default());
    assert!(old.unwrap_err().to_string().contains("is glTF 1.0"));
    let lines = complaint(&|v| {
        v["meshes"][0]["primitives"][0]["mode"] = json!(1);
        v["meshes"][1]["primitives"][0]["mode"] = json!(0);
    });
    assert!(lines.contains("has no faces"), "{lines}");
}

#[test]
fn circles_and_crowds_end() {
    let mut value = scene();
    value["nodes"][1]["children"] = json!([0]);
    assert_eq!(read(&value).unwrap().parts.len(), 2);
    // A thousand nodes show a mesh of many vertices: refused before it is made.
    let mut value = scene();
    let zeros = json!({ "componentType": 5126, "count": 1 << 20, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0],
        "sparse": value["accessors"][3]["sparse"] });
    value["accessors"][3] = zeros;
    let nodes: Vec<Value> = (0..1000).map(|_| json!({ "mesh": 1 })).collect();
    value["nodes"] = nodes.into();
    value["scenes"][0]["nodes"] = (0..1000).collect();
    let refused = read(&value).unwrap_err();
    assert!(refused.contains("1048576000 vertices need about"), "{refused}");
}
