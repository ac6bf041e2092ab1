use super::*;
use std::fs;
use std::sync::Arc;

const EYE: &str = "[eye]\nposition = [0, 1, 3]\ntarget = [0, 0.5, 0]\n";
const MIRROR: &str = "[[mirror]]\nshape = \"sphere\"\n";

fn scene(text: &str) -> Result<Scene> {
    parse(text, "test.toml", Path::new(""), &ReadOptions::default(), &Context::default())
}

fn complaint(text: &str) -> String {
    let error = scene(text).unwrap_err();
    let Error::Input { name, remedy, .. } = &error else { panic!("{error}") };
    assert!(name == "test.toml" && !remedy.is_empty());
    let text = error.to_string();
    assert!(!text.contains('\n'), "{text}");
    text.strip_prefix("test.toml: ").unwrap().to_owned()
}

#[test]
fn every_key_arrives() {
    let text = r##"
        name = "all"
        [eye]
        position = [1, 2.5, 3]
        target = [0, 0.5, -1]
        up = [0, 0, 5]
        fov_y_deg = 60
        [light]
        to_sun = [0, 3, 4]
        sun = [2, 1.5, 1]
        ambient = "#ff8000"
        [environment]
        kind = "sky"
        zenith = [0.1, 0.2, 0.3]
        horizon = [0.4, 0.5, 0.6]
        ground = [0, 0, 0]
        [[mirror]]
        name = "ball"
        shape = "sphere"
        triangles = 64
        tint = [1, 0.9, 0.8]
        scale = 2
        translate = [1, 0, -1]
        rotate_deg = { axis = [0, 0, 2], angle = 90 }
        [[object]]
        name = "floor"
        shape = "plane"
        density = 0.25
        pattern = { kind = "rings", colors = ["#ffffff", [0, 0, 1]], period = 0.5 }
        fit = { diagonal = 3, base = [1, 2, 3] }
        [[object]]
        shape = "sphere"
        color = [0.1, 0.2, 0.3]
    "##;
    let scene = scene(text).unwrap();
    assert_eq!(scene.name, "all");
    assert_eq!(
        scene.eye,
        EyeDescription {
            position: DVec3::new(1.0, 2.5, 3.0),
            target: DVec3::new(0.0, 0.5, -1.0),
            up: DVec3::Z,
            fov_y: 60.0_f64.to_radians(),
        }
    );
    assert!((scene.light.to_sun - Vec3::new(0.0, 0.6, 0.8)).length() < 1e-7);
    assert_eq!(scene.light.sun, Vec3::new(2.0, 1.5, 1.0));
    // 128/255 in sRGB is 0.21586 in linear light.
    assert!((scene.light.ambient - Vec3::new(1.0, 0.215_86, 0.0)).length() < 1e-5);
    assert_eq!(
        scene.environment,
        Environment::Sky {
            zenith: Vec3::new(0.1, 0.2, 0.3),
            horizon: Vec3::new(0.4, 0.5, 0.6),
            ground: Vec3::ZERO,
        }
    );
    let [mirror] = &scene.mirrors[..] else { panic!() };
    assert_eq!((mirror.name.as_str(), mirror.tint), ("ball", Vec3::new(1.0, 0.9, 0.8)));
    // x becomes R(2x) + t, and R turns x to y.
    let moved = mirror.transform.point(DVec3::new(1.0, 0.0, 0.5));
    assert!((moved - DVec3::new(1.0, 2.0, 0.0)).length() < 1e-12, "{moved}");
    let [floor, ball] = &scene.objects[..] else { panic!() };
    assert_eq!((floor.name.as_str(), floor.density), ("floor", 0.25));
    assert_eq!(
        floor.paint,
        Paint::Pattern { kind: PatternKind::Rings, colors: [Vec3::ONE, Vec3::Z], period: 0.5 }
    );
    let (min, max) = crate::scene::fit::world_bounds(&floor.mesh, &floor.transform);
    assert!(((max - min).length() - 3.0).abs() < 1e-12);
    let bottom = DVec3::new(0.5 * (min.x + max.x), min.y, 0.5 * (min.z + max.z));
    assert!((bottom - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-12);
    assert_eq!((ball.name.as_str(), ball.density), ("sphere", 1.0));
    assert_eq!(ball.paint, Paint::Constant(Vec3::new(0.1, 0.2, 0.3)));
    assert!(ball.mesh.triangles().len() > mirror.mesh.triangles().len());
}

#[test]
fn what_is_not_said_has_a_default() {
    let scene = scene(&format!("{EYE}{MIRROR}[[object]]\nshape = \"plane\"\n")).unwrap();
    assert_eq!(scene.name, "test");
    assert_eq!(scene.eye.up, DVec3::Y);
    assert_eq!(scene.eye.fov_y, 45.0_f64.to_radians());
    assert_eq!(scene.mirrors[0].transform, Similarity::IDENTITY);
    assert_eq!(scene.mirrors[0].tint, Vec3::ONE);
    assert_eq!(scene.objects[0].paint, Paint::Constant(LIGHT_GREY));
    assert_eq!(scene.environment, DEFAULT_SKY);
    assert_eq!(scene.light, default_light());
    assert!(scene.light.to_sun.is_normalized());

    let text = format!("{EYE}{MIRROR}[environment]\nkind = \"constant\"\ncolor = [1, 2, 3]\n");
    assert_eq!(
        self::scene(&text).unwrap().environment,
        Environment::Constant(Vec3::new(1.0, 2.0, 3.0))
    );
}

#[test]
fn the_example_of_the_documentation_is_right() {
    let source = include_str!("../file.rs");
    let lines = source.lines().map_while(|l| l.strip_prefix("//!")).map(str::trim_start);
    let example: Vec<&str> =
        lines.skip_while(|l| *l != "```toml").skip(1).take_while(|l| *l != "```").collect();
    assert!(example.len() > 20);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("bunny.ply"), TRIANGLE).unwrap();
    let scene = parse(
        &example.join("\n"),
        "doc",
        folder.path(),
        &ReadOptions::default(),
        &Context::default(),
    )
    .unwrap();
    assert_eq!((scene.mirrors.len(), scene.objects.len()), (1, 1));
    assert_eq!(scene.objects[0].transform.scale, 0.5);
}

const TRIANGLE: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
    property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
    property list uchar int vertex_indices\nend_header\n0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n3 0 1 2\n";

#[test]
fn files_are_relative_shared_and_named() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("models")).unwrap();
    fs::write(folder.path().join("models/tri.ply"), TRIANGLE).unwrap();
    let text = format!(
        "{EYE}[[mirror]]\nfile = \"models/tri.ply\"\n[[mirror]]\nshape = \"sphere\"\ntriangles = 80\n\
         [[object]]\nfile = \"models/../models/tri.ply\"\n[[object]]\nname = \"tri\"\nshape = \"sphere\"\n\
         [[object]]\nshape = \"sphere\"\n"
    );
    let path = folder.path().join("my scene.toml");
    fs::write(&path, text).unwrap();
    let scene = read(&path, &ReadOptions::default(), &Context::default()).unwrap();
    assert_eq!(scene.name, "my scene");
    let names: Vec<&str> = scene.mirrors.iter().map(|m| m.name.as_str()).collect();
    // The given name "tri" stays; the mirror that would have had it gives way.
    assert_eq!(names, ["tri-2", "sphere"]);
    let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["tri-3", "tri", "sphere-2"]);
    assert!(Arc::ptr_eq(&scene.mirrors[0].mesh, &scene.objects[0].mesh));
    assert!(Arc::ptr_eq(&scene.objects[1].mesh, &scene.objects[2].mesh));
    assert!(!Arc::ptr_eq(&scene.mirrors[1].mesh, &scene.objects[1].mesh));
    assert_eq!(scene.objects[0].paint, Paint::Vertex);

    let error = parse(
        &format!("{EYE}[[mirror]]\nfile = \"none.ply\"\n"),
        "scene",
        folder.path(),
        &ReadOptions::default(),
        &Context::default(),
    );
    let error = error.unwrap_err().to_string();
    assert!(error.contains("line ") && error.contains("none.ply does not exist"), "{error}");
    for (name, bytes, wanted) in [
        ("no.toml", None, "does not exist"),
        ("a.toml", Some(&b""[..]), "is empty"),
        ("b.toml", Some(b"\xff"), "UTF-8"),
    ] {
        let path = folder.path().join(name);
        if let Some(bytes) = bytes {
            fs::write(&path, bytes).unwrap();
        }
        let error =
            read(&path, &ReadOptions::default(), &Context::default()).unwrap_err().to_string();
        assert!(error.contains(wanted) && error.contains(name), "{error}");
    }
}

#[test]
fn bad_scenes() {
    let object = "[[object]]\nshape = \"plane\"\n";
    for (text, wanted) in [
        // Unknown keys name themselves, their line and what is allowed.
        (
            format!("{EYE}{MIRROR}colour = 1\n"),
            "line 6: unknown field `colour`, expected one of `name`, `shape`, `file`, `part`, `triangles`, `tint`,",
        ),
        (
            format!("{EYE}postion = 1\n{MIRROR}"),
            "line 4: unknown field `postion`, expected one of `position`, `target`, `up`, `fov_y_deg`",
        ),
        (
            format!("camera = 1\n{EYE}{MIRROR}"),
            "line 1: unknown field `camera`, expected one of `name`, `eye`, `light`, `environment`, `mirror`, `object`",
        ),
        (format!("{EYE}{MIRROR}{object}tint = 1\n"), "line 8: unknown field `tint`"),
        (
            format!("{EYE}{MIRROR}fit = {{ diagonal = 1, base = [0,0,0], top = 1 }}\n"),
            "line 6: unknown field `top`, expected `diagonal` or `base`",
        ),
        (
            format!(
                "{EYE}{MIRROR}[environment]\nkind = \"constant\"\ncolor = [0,0,0]\nzenith = [0,0,0]\n"
            ),
            "line 6: a constant environment has color and nothing else",
        ),
        (
            format!("{EYE}{MIRROR}[environment]\nkind = \"fog\"\n"),
            "line 7: unknown variant `fog`, expected one of `sky`, `constant`, `image`",
        ),
        (format!("{EYE}{MIRROR}[light]\nmoon = 1\n"), "line 7: unknown field `moon`"),
        (
            format!("{EYE}{MIRROR}[environment]\nkind = \"constant\"\n"),
            "line 6: a constant environment has color and nothing else",
        ),
        (
            format!("{EYE}{MIRROR}[environment]\nkind = \"sky\"\ncolor = [0,0,0]\n"),
            "line 6: a sky has zenith, horizon and ground instead of color",
        ),
        (
            format!("{EYE}{MIRROR}[environment]\nkind = \"sky\"\nzenit = [0,0,0]\n"),
            "line 8: unknown field `zenit`, expected one of `kind`, `zenith`,",
        ),
        (
            format!("{EYE}{MIRROR}[environment]\nkind = \"sky\"\nzenith = [0,0]\n"),
            "line 8: invalid length 2",
        ),
        // Syntax.
        (format!("{EYE}{MIRROR}shape ="), "line 6: "),
        (format!("{EYE}{MIRROR}{MIRROR}shape = \"a\"\n"), "line 8: duplicate key"),
        ("nonsense".into(), "line 1: "),
        ("\0\0".into(), "line 1: "),
        // Eye.
        (MIRROR.into(), "line 1: missing field `eye`"),
        ("[eye]\nposition = [0, 1, 3]\n".into(), "line 1: missing field `target`"),
        (
            format!("[eye]\nposition = [0, 1, 3]\ntarget = [0, 1, 3]\n{MIRROR}"),
            "line 1: the eye's position and target coincide",
        ),
        (
            format!("[eye]\nposition = [0, 1, 0]\ntarget = [0, 0, 0]\n{MIRROR}"),
            "line 1: the eye's up is parallel to its view",
        ),
        (
            format!("[eye]\nposition = [0, nan, 0]\ntarget = [0, 0, 0]\n{MIRROR}"),
            "line 2: [0.0, NaN, 0.0] is not finite",
        ),
        (
            format!("[eye]\nposition = [0, 1]\ntarget = [0, 0, 0]\n{MIRROR}"),
            "line 2: has 2 values instead of 3",
        ),
        (
            format!("[eye]\nposition = [0, 1, 2, 3]\ntarget = [0, 0, 0]\n{MIRROR}"),
            "line 2: has 4 values instead of 3",
        ),
        (format!("{EYE}up = [0, 0, 0]\n{MIRROR}"), "line 4: [0.0, 0.0, 0.0] has no direction"),
        (
            format!("{EYE}fov_y_deg = 180\n{MIRROR}"),
            "line 4: a field of view of 180 degrees is not between 0 and 180",
        ),
        (
            format!("{EYE}fov_y_deg = 0\n{MIRROR}"),
            "line 4: a field of view of 0 degrees is not between 0 and 180",
        ),
        (
            format!("{EYE}fov_y_deg = nan\n{MIRROR}"),
            "line 4: a field of view of NaN degrees is not between 0 and 180",
        ),
        (format!("{EYE}up = [0, 1, 0, 0]\n{MIRROR}"), "line 4: has 4 values instead of 3"),
        // Mirrors and objects.
        (EYE.into(), "has no mirror"),
        (format!("{EYE}[[mirror]]\n"), "line 4: has neither shape nor file"),
        (format!("{EYE}{MIRROR}file = \"a.ply\"\n"), "line 4: has both shape and file"),
        (
            format!("{EYE}{MIRROR}triangles = 0\n"),
            "line 6: 0 triangles are not between 1 and 50000000",
        ),
        (
            format!("{EYE}{MIRROR}triangles = 50000001\n"),
            "line 6: 50000001 triangles are not between",
        ),
        (
            format!("{EYE}[[mirror]]\nfile = \"a.ply\"\ntriangles = 5\n"),
            "line 4: triangles cannot be chosen for a file",
        ),
        (
            format!("{EYE}[[mirror]]\nshape = \"ball\"\n"),
            "line 4: there is no built-in shape \"ball\"; the shapes are ",
        ),
        (format!("{EYE}{MIRROR}scale = 0\n"), "line 6: 0 is not a positive number"),
        (format!("{EYE}{MIRROR}scale = inf\n"), "line 6: inf is not a positive number"),
        (
            format!("{EYE}{MIRROR}translate = [0, 0, inf]\n"),
            "line 6: [0.0, 0.0, inf] is not finite",
        ),
        (
            format!("{EYE}{MIRROR}rotate_deg = {{ axis = [0, 0, 0], angle = 1 }}\n"),
            "line 6: [0.0, 0.0, 0.0] has no direction",
        ),
        (
            format!("{EYE}{MIRROR}rotate_deg = {{ axis = [0, 0, 1], angle = inf }}\n"),
            "line 6: inf is not a finite number",
        ),
        (
            format!("{EYE}{MIRROR}fit = {{ diagonal = -1, base = [0, 0, 0] }}\n"),
            "line 6: -1 is not a positive number",
        ),
        (
            format!("{EYE}{MIRROR}scale = 1\nfit = {{ diagonal = 1, base = [0, 0, 0] }}\n"),
            "line 4: fit already says",
        ),
        (
            format!(
                "{EYE}{MIRROR}translate = [0, 0, 0]\nfit = {{ diagonal = 1, base = [0, 0, 0] }}\n"
            ),
            "line 4: fit already says",
        ),
        (format!("{EYE}{MIRROR}name = \"\"\n"), "line 6: the name is empty"),
        (
            format!("{EYE}{MIRROR}name = \"a\"\n{object}name = \"a\"\n"),
            "line 7: the name \"a\" is used twice",
        ),
        (
            format!("{EYE}{MIRROR}tint = [1, -1, 1]\n"),
            "line 6: the colour [1, -1, 1] is negative or not finite",
        ),
        (
            format!("{EYE}{MIRROR}tint = [1, 1, 1e300]\n"),
            "line 6: the colour [1, 1, inf] is negative or not finite",
        ),
        (
            format!("{EYE}{MIRROR}tint = \"#12345\"\n"),
            "line 6: invalid value: string \"#12345\", expected a colour",
        ),
        (format!("{EYE}{MIRROR}tint = \"#12345g\"\n"), "line 6: invalid value"),
        (format!("{EYE}{MIRROR}tint = \"#123é5\"\n"), "line 6: invalid value"),
        (format!("{EYE}{MIRROR}tint = [1, 1]\n"), "line 6: invalid length 2, expected a colour"),
        (
            format!("{EYE}{MIRROR}tint = [1, 1, 1, 1]\n"),
            "line 6: invalid length 4, expected a colour",
        ),
        (
            format!("{EYE}{MIRROR}tint = 1\n"),
            "line 6: invalid type: integer `1`, expected a colour",
        ),
        (format!("{EYE}{MIRROR}{object}density = 0\n"), "line 8: 0 is not a positive number"),
        (
            format!(
                "{EYE}{MIRROR}{object}color = [1,1,1]\npattern = {{ kind = \"rings\", colors = [[1,1,1], [0,0,0]], period = 1 }}\n"
            ),
            "line 6: has both color and pattern",
        ),
        (
            format!(
                "{EYE}{MIRROR}{object}pattern = {{ kind = \"dots\", colors = [[1,1,1], [0,0,0]], period = 1 }}\n"
            ),
            "line 8: unknown variant `dots`, expected one of `checker`, `stripes`, `rings`",
        ),
        (
            format!(
                "{EYE}{MIRROR}{object}pattern = {{ kind = \"rings\", colors = [[1,1,1], [0,0,0], [1,0,0]], period = 1 }}\n"
            ),
            "line 8: has 3 values instead of 2",
        ),
        (
            format!(
                "{EYE}{MIRROR}{object}pattern = {{ kind = \"rings\", colors = [[1,1,1], [0,0,0]], period = 0 }}\n"
            ),
            "line 8: 0 is not a positive number",
        ),
    ] {
        let found = complaint(&text);
        assert!(found.starts_with(wanted), "{text}\n  gives {found}\n  instead of {wanted}");
    }
}
