//! Options with values that make no sense, and places that cannot be written.

use super::{Folder, SMALL};

#[test]
fn options_of_every_command_that_prepares_a_scene() {
    let folder = Folder::new();
    for (options, expected) in [
        ("--surfels 0", "--surfels: 0 is not between 1 and"),
        ("--surfels -5", "--surfels"),
        ("--surfels 99999999999999999999", "--surfels"),
        ("--surfels many", "--surfels"),
        ("--leaf 0", "--leaf: 0 is not a leaf size; choose 1 or more"),
        ("--leaf -1", "--leaf"),
        ("--leaf-size nan", "--leaf-size: NaN is not between 0 and 1; "),
        ("--leaf-size -0.1", "--leaf-size: -0.1 is not between 0 and 1; "),
        ("--leaf-size inf", "--leaf-size: inf is not between 0 and 1; "),
        ("--threads 0", "--threads"),
        ("--threads 100000", "--threads"),
        ("--threads -1", "--threads"),
        ("--seed -1", "--seed"),
        ("--eye nan,0,0", "--eye"),
        ("--eye 1,2", "--eye"),
        ("--eye 1,2,3,4", "--eye"),
        ("--eye 1e30,0,0", "--eye: is not finite, or beyond 1e15; "),
        ("--eye 1,2,3 --target 1,2,3", "--eye: the eye and its target coincide"),
        ("--target inf,0,0", "--target"),
        ("--fov 0", "--fov: 0 degrees are not between 0 and 180; "),
        ("--fov 180", "--fov: 180 degrees"),
        ("--fov -5", "--fov: -5 degrees"),
        ("--fov nan", "--fov: NaN degrees"),
        ("--fov wide", "--fov"),
        ("--size 0x10", "--size"),
        ("--size 10x0", "--size"),
        ("--size 1000000x1000000", "each side must be from 1 to 16384 pixels"),
        ("--size 99999999999x1", "--size"),
        ("--size -1x10", "--size"),
        ("--size 640", "give width x height in pixels, such as 1280x720"),
        ("--mirror pot", "--mirror: there is no built-in shape \"pot\"; the shapes are teapot"),
        ("--object pot", "--object: there is no built-in shape \"pot\"; the shapes are teapot"),
        ("--nonsense", "--nonsense"),
    ] {
        for command in ["render", "info", "bench layer"] {
            folder.refused(&format!("{command} {options}"), &[expected]);
        }
    }
}

#[test]
fn options_of_methods() {
    let folder = Folder::new();
    for (options, expected) in [
        ("--quality good", "--quality"),
        ("--quality best --preset paper", "--preset"),
        ("--method magic", "--method: there is no method \"magic\"; use one of c3rc, raytrace"),
        ("--preset magic", "--preset: c3rc has no preset \"magic\"; use paper"),
        (
            "--method raytrace --preset paper",
            "--preset: raytrace has no preset \"paper\"; leave it out",
        ),
        ("--test sphere", "--test: \"sphere\" is not a choice; use one of none, interval"),
        (
            "--splat round",
            "--splat: \"round\" is not a choice; use one of ellipse, square1, square2",
        ),
        ("--cameras rows", "--cameras: \"rows\" is not a choice; use one of triangles, cells"),
        (
            "--cameras cells --test paper",
            "--test paper: goes with triangles only; use --cameras triangles, or another --test",
        ),
        ("--ray-scale unit", "--ray-scale unit: goes with triangles only; "),
        ("--method raytrace --spp 0", "--spp: \"0\" is not a whole number from 1 to 65536"),
        ("--method raytrace --spp 1.5", "--spp: \"1.5\" is not a whole number"),
        ("--method raytrace --spp 4000000000", "--spp: \"4000000000\" is not a whole number"),
        ("--spp 4", "--spp: c3rc has no such parameter; leave it out or use --method raytrace"),
        ("--method raytrace --test slab", "--test: raytrace has no such parameter; leave it out"),
        ("--backend magic", "--backend"),
        ("--gpu-path magic", "--gpu-path"),
        ("--backend cpu --adapter 0", "--adapter: is for --backend gpu; leave one of the two out"),
        ("--repeat 0", "--repeat"),
        ("--repeat -1", "--repeat"),
        ("--repeat 1000000000", "--repeat"),
    ] {
        for command in ["render", "bench layer"] {
            folder.refused(&format!("{command} {SMALL} {options}"), &[expected]);
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn more_than_the_memory_holds() {
    let folder = Folder::new();
    // 236 GB of surfels: where there is so much memory, the rule itself is tested beside its code.
    let memory = std::fs::read_to_string("/proc/meminfo").unwrap();
    let total = memory.lines().next().unwrap().split_whitespace().nth(1).unwrap();
    if total.parse::<u64>().unwrap() < 200_000_000 {
        let line = "render --surfels 2147483647 --size 16x9";
        folder.refused(line, &["--surfels: 2147483647 surfels need about 279.17 GB of memory"]);
    }
}

#[test]
fn places_that_cannot_be_written() {
    let folder = Folder::new();
    folder.write("file", "");
    std::fs::create_dir(folder.path("folder.png")).unwrap();
    std::fs::create_dir(folder.path("folder.exr")).unwrap();
    for (options, expected) in [
        (
            "-o none/a.png",
            "none/a.png: cannot be written: its folder does not exist; create the folder",
        ),
        ("-o file/a.png", "file/a.png: cannot be written: "),
        ("-o folder.png", "folder.png: cannot be written: it names a folder; "),
        ("-o .", ".: not a picture format"),
        (
            "-o a.jpg",
            "a.jpg: not a picture format that can be written; name a file that ends in .png",
        ),
        ("-o a", "a: not a picture format"),
        ("--aov none/a.exr", "none/a.exr: cannot be written"),
        ("--aov a.png", "a.png: planes are written as EXR only; "),
        ("--aov folder.exr", "folder.exr: cannot be written: it names a folder"),
        ("--json none/a.json", "none/a.json: cannot be written"),
        ("--json folder.png", "folder.png: cannot be written: it names a folder"),
        ("-o a.exr --aov a.exr", "--aov: names the same file as --output; give another name"),
        ("-o a.png --json a.png", "--json: names the same file as --output; "),
        ("--aov a.exr --json a.exr", "--json: names the same file as --aov; "),
    ] {
        folder.refused(&format!("render {SMALL} {options}"), &[expected]);
    }
    folder.refused(&format!("info {SMALL} --json none/a"), &["none/a: cannot be written"]);
    folder.refused(&format!("bench layer {SMALL} --json none/a"), &["none/a: cannot be written"]);
}

#[test]
fn an_output_that_is_refused_keeps_the_old_file() {
    let folder = Folder::new();
    folder.write("old.png", "precious").write("old.json", "precious");
    folder.refused(&format!("render {SMALL} --leaf 0 -o old.png --json old.json"), &["--leaf"]);
    assert_eq!(folder.read("old.png"), b"precious");
    assert_eq!(folder.read("old.json"), b"precious");
}

#[test]
fn comparisons_that_make_no_sense() {
    let folder = Folder::new();
    folder.good(&format!("render {SMALL} -o a.png --aov a.exr"));
    folder.good("render --size 80x90 --surfels 20000 -o b.png");
    let cut = &folder.read("a.png")[..900];
    folder.write("cut.png", cut).write("void.png", "").write("text.png", "no picture");
    for (options, expected) in [
        ("a.png b.png", ["a.png", "80"]),
        ("a.png a.png --where everything", ["--where", "all, mirror, object or object=NAME"]),
        ("a.png a.png --where mirror", ["a.png", "AOV file"]),
        ("a.exr a.exr --where object=cow", ["no object \"cow\"", "it has: "]),
        ("a.png none.png", ["none.png: does not exist", "check the name"]),
        ("a.png cut.png", ["cut.png: ", "damaged or truncated"]),
        ("void.png a.png", ["void.png: the file is empty", "write it again"]),
        ("text.png a.png", ["text.png: not a picture", "give a PNG, EXR, HDR or JPEG file"]),
        ("a.png a.png --aov-b b.png", ["b.png", "EXR"]),
        ("a.png a.png --json none/a.json", ["none/a.json", "cannot be written"]),
        ("a.png a.png --heatmap a.txt", ["a.txt", ".png, .exr or .hdr"]),
        (
            "a.png a.png --heatmap c.png --json c.png",
            ["--heatmap", "names the same file as --json"],
        ),
        ("a.png", ["<B>", "--help"]),
    ] {
        folder.refused(&format!("compare {options}"), &expected);
    }
}

#[test]
fn an_unknown_instruction_set() {
    let folder = Folder::new();
    let mut command = folder.command(["info", "knot"]);
    command.env("CATOPTRIC_SIMD", "avx3");
    let run = folder.finish(command);
    let expected = "error: CATOPTRIC_SIMD: \"avx3\" is not an instruction set; unset it, or choose sse2, sse4.2, avx2 or avx512\n";
    assert_eq!((run.code, run.err.as_str()), (Some(2), expected));
}

#[test]
fn the_layer_of_rays_against_rays() {
    let folder = Folder::new();
    let expected = "--method: raytrace is what the layer is compared with; choose another method";
    folder.refused(&format!("bench layer {SMALL} --method raytrace"), &[expected]);
}

#[test]
fn orbits() {
    let folder = Folder::new();
    for (options, expected) in [
        ("--frames 0", "--frames"),
        ("--frames -3", "--frames"),
        ("--orbit 10", "--frames"),
        ("--frames 3 --orbit nan", "--orbit: they do not make a view; "),
        ("--frames 3 --orbit round", "--orbit"),
        ("--frames 3 --repeat 3", "--repeat"),
        ("--frames 3 --aov a.exr", "--aov"),
    ] {
        folder.refused(&format!("render {SMALL} {options} -o a.png"), &[expected]);
    }
}
