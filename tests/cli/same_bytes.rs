//! The same bytes from every run, number of threads and instruction set.

use super::Folder;

/// The built-in scene: several objects, some of them touching the mirror.
fn files(method: &str, threads: u32, simd: Option<&str>) -> (Vec<u8>, Vec<u8>, String) {
    let folder = Folder::new();
    let line = format!(
        "render default --method {method} --threads {threads} --size 320x180 --surfels 60000 \
         -o a.png --aov a.exr --json a.json"
    );
    let mut command = folder.command(line.split_whitespace());
    command.env_remove("CATOPTRIC_SIMD");
    if let Some(simd) = simd {
        command.env("CATOPTRIC_SIMD", simd);
    }
    let run = folder.finish(command);
    assert_eq!(run.code, Some(0), "{}: {}", run.line, run.err);
    let figures = folder.json("a.json");
    assert_eq!(figures["threads"], threads);
    let simd = figures["simd"].as_str().unwrap().to_owned();
    (folder.read("a.png"), folder.read("a.exr"), simd)
}

fn same(method: &str) {
    let (png, exr, best) = files(method, 1, None);
    for (threads, simd) in
        [(1, None), (2, None), (5, None), (1, Some("avx2")), (2, Some("sse4.2")), (2, Some("sse2"))]
    {
        let found = files(method, threads, simd);
        let what = format!("{method}, {threads} threads, {simd:?} instead of {best}");
        assert!(found.0 == png, "{what}: another picture");
        assert!(found.1 == exr, "{what}: other AOVs");
        // Else two runs of the same instruction set would have been compared.
        if cfg!(target_arch = "x86_64") && simd == Some("sse2") {
            assert_eq!(found.2, "sse2");
        }
    }
}

#[test]
fn by_three_ray_cameras() {
    same("c3rc --cameras triangles --splat square2 --detail 0");
}

#[test]
fn with_level_of_detail() {
    same("c3rc --cameras triangles --splat ellipse --detail 4");
    same("c3rc --cameras triangles --splat square2 --detail 1");
}

#[test]
fn with_cells() {
    same("c3rc --quality best");
    same("c3rc --cameras cells --splat square1");
    same("c3rc");
}

#[test]
fn by_rays() {
    same("raytrace");
}

#[test]
fn another_seed_gives_other_bytes() {
    let folder = Folder::new();
    let line = "render default --size 320x180 --surfels 60000";
    folder.good(&format!("{line} --seed 1 -o a.png"));
    folder.good(&format!("{line} --seed 2 -o b.png"));
    assert!(folder.read("a.png") != folder.read("b.png"));
}
