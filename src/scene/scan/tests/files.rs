//! Clouds from files.

use super::*;

fn read(name: &str, bytes: &[u8]) -> Result<PointCloud> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    cloud(&path, &CloudOptions::default(), &Context::default())
}

#[test]
fn colours_become_linear_by_what_they_are() {
    let rows =
        |tail: &str| (0..20).map(|i| format!("{} {} 0 {tail}\n", i % 5, i / 5)).collect::<String>();
    let color = |text: &str| {
        let found = read("a.xyz", rows(text).as_bytes()).unwrap();
        assert!(found.has_colors && !found.has_normals, "{text}");
        found.surfels.albedo[0]
    };
    let near = |a: Vec3, b: [f32; 3]| assert!(a.abs_diff_eq(Vec3::from_array(b), 1e-4), "{a}");
    near(color("255 188 0"), [1.0, 0.502_886_5, 0.0]);
    near(color("65535 48316 0"), [1.0, 0.502_886_5, 0.0]);
    near(color("1 0.5 0"), [1.0, 0.5, 0.0]);
    near(color("7 255 188 0"), [1.0, 0.502_886_5, 0.0]);
    near(color("12"), [1.0, 1.0, 1.0]);
    let with_normals = read("a.xyz", rows("255 0 0 0 0.6 -0.8").as_bytes()).unwrap();
    assert!(with_normals.has_normals && with_normals.has_colors);
    near(with_normals.surfels.normals[3], [0.0, 0.6, -0.8]);
    near(with_normals.surfels.albedo[3], [1.0, 0.0, 0.0]);
    let plain = read("a.xyz", rows("").as_bytes()).unwrap();
    assert!(!plain.has_colors && plain.surfels.albedo[0] == Vec3::ONE);
}
