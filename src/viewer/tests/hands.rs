//! What a user does, and what is to happen then.

use eframe::egui::{Key, Modifiers, PointerButton};
use egui_kittest::kittest::{NodeT as _, Queryable};

use super::super::settings::MirrorColors;
use super::super::worker::{Saved, Thing};
use super::*;
use crate::scene::file;
use crate::{Context, geometry::Similarity};

#[test]
fn a_scene_is_drawn_and_orbited() {
    let (_folder, path) = small();
    let mut hands = opened(&path, [400.0, 300.0], without_panel());
    hands.step();
    until_drawn(&mut hands);
    let (before, shots) = (viewer(&hands).eye, viewer(&hands).shots);
    let [from, to] = [on_canvas(&hands, 0.1, 0.9), on_canvas(&hands, 0.3, 0.9)];
    drag(&mut hands, PointerButton::Primary, from, to);
    let after = viewer(&hands).eye;
    let [old, new] = [before, after].map(|e| (e.position - e.target).length());
    assert!((old - new).abs() < 1e-9 && after.target == before.target, "an orbit");
    assert!((after.position - before.position).length() > 0.1);
    until_drawn(&mut hands);
    assert!(viewer(&hands).shots > shots);
    // Nothing moves any more: nothing is drawn any more.
    let shots = viewer(&hands).shots;
    for _ in 0..40 {
        std::thread::sleep(Duration::from_millis(10));
        hands.step();
    }
    assert_eq!(viewer(&hands).shots, shots);
}

#[test]
fn panning_zooming_flying_and_home() {
    let (_folder, path) = small();
    let mut hands = opened(&path, [400.0, 300.0], without_panel());
    hands.step();
    until_drawn(&mut hands);
    let home = viewer(&hands).eye;
    let [from, to] = [on_canvas(&hands, 0.1, 0.9), on_canvas(&hands, 0.3, 0.9)];
    drag(&mut hands, PointerButton::Secondary, from, to);
    assert_ne!(viewer(&hands).eye.target, home.target, "panned");
    let distance = |hands: &Hands<'_>| {
        let eye = viewer(hands).eye;
        (eye.position - eye.target).length()
    };
    let far = distance(&hands);
    hands.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: egui::vec2(0.0, 3.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: Modifiers::NONE,
    });
    for _ in 0..20 {
        hands.step();
    }
    assert!(distance(&hands) < 0.95 * far, "zoomed in");
    let before = viewer(&hands).eye;
    hands.key_down(Key::W);
    for _ in 0..5 {
        hands.step();
    }
    hands.key_up(Key::W);
    hands.step();
    let ahead = (before.target - before.position).normalize_or_zero();
    assert!((viewer(&hands).eye.position - before.position).dot(ahead) > 0.05, "flew ahead");
    hands.key_press(Key::Num5);
    hands.step();
    let eye = viewer(&hands).eye;
    assert!((eye.position - eye.target).normalize_or_zero().y > 0.99, "from above");
    hands.key_press(Key::Home);
    hands.step();
    assert_eq!(viewer(&hands).eye, home);
}

#[test]
fn what_is_clicked_is_selected_and_moves_with_its_handles() {
    let (_folder, path) = small();
    let mut hands = opened(&path, [400.0, 300.0], without_panel());
    hands.step();
    until_drawn(&mut hands);
    // The mirror stands in the middle.
    let at = on_canvas(&hands, 0.5, 0.45);
    click(&mut hands, at);
    until(&mut hands, "a selection", |v| v.selected.is_some());
    assert_eq!(viewer(&hands).selected, Some(Thing::Mirror(0)));
    viewer_mut(&mut hands).selected = Some(Thing::Object(0));
    hands.step();
    let before = Arc::clone(&viewer(&hands).placements);
    // The red ball's middle: the handle that moves it across the view.
    let eye = viewer(&hands).eye;
    let size = viewer(&hands).size;
    let view = crate::camera::Eye::new(eye.position, eye.target, eye.up, eye.fov_y, size);
    let px = view.and_then(|v| v.project_px(before[0].translation.as_vec3())).expect("in view");
    let from = on_canvas(&hands, px.x / size.width as f32, px.y / size.height as f32);
    drag(&mut hands, PointerButton::Primary, from, from + egui::vec2(-60.0, -20.0));
    let after = viewer(&hands).placements[0];
    let moved = after.translation - before[0].translation;
    assert!(moved.length() > 0.2 && moved.x < 0.0 && moved.y > 0.0, "{moved}");
    assert_eq!(viewer(&hands).eye, eye, "the view stays");
    assert_eq!(viewer(&hands).placements[1..], before[1..]);
    until_drawn(&mut hands);
    // It comes out in a new light, too: shadows follow.
    let shots = viewer(&hands).shots;
    until(&mut hands, "new shadows", |v| v.shots > shots);
    // A drag is one move.
    hands.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    hands.step();
    assert_eq!(viewer(&hands).placements, before, "undone");
    hands.key_press_modifiers(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
    hands.step();
    assert_eq!(viewer(&hands).placements[0], after, "made again");
    viewer_mut(&mut hands).put_all_back();
    assert_eq!(viewer(&hands).placements, before);
    hands.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    hands.step();
    assert_eq!(viewer(&hands).placements[0], after, "that can be undone, too");
    until_drawn(&mut hands);
}

#[test]
fn numbers_place_what_is_selected() {
    let (_folder, path) = small();
    let mut hands = opened(&path, [900.0, 1400.0], Settings::default());
    hands.step();
    until_drawn(&mut hands);
    let before = Arc::clone(&viewer(&hands).placements);
    viewer_mut(&mut hands).selected = Some(Thing::Object(0));
    hands.step();
    hands.step();
    assert_eq!(viewer(&hands).placements, before, "nothing moves by being shown");
    assert!(hands.query_by_label("put back").is_some_and(|b| b.accesskit_node().is_disabled()));
    // The ball's middle is at 1.1, 0.25, 0.6.
    let x = hands
        .get_all_by_role(egui::Role::SpinButton)
        .find(|n| n.accesskit_node().numeric_value().is_some_and(|v| (v - 1.1).abs() < 1e-3));
    x.expect("a field for x").click();
    hands.step();
    hands.step();
    hands.key_press_modifiers(Modifiers::COMMAND, Key::A);
    hands.event(egui::Event::Text("-0.75".into()));
    hands.step();
    hands.key_press(Key::Enter);
    for _ in 0..3 {
        hands.step();
    }
    let moved = viewer(&hands).placements[0].translation - before[0].translation;
    assert!((moved - glam::DVec3::new(-1.85, 0.0, 0.0)).length() < 1e-3, "{moved}");
    hands.get_by_label("put back").click();
    hands.step();
    hands.step();
    assert_eq!(viewer(&hands).placements, before);
    hands.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    hands.step();
    assert_ne!(viewer(&hands).placements, before, "undone");
    until_drawn(&mut hands);
}

#[test]
fn a_moved_mirror_is_drawn_as_if_it_had_always_been_there() {
    let (folder, path) = small();
    let mut hands = opened(&path, [400.0, 300.0], without_panel());
    hands.step();
    until_drawn(&mut hands);
    let at = Similarity {
        translation: glam::DVec3::new(-0.3, 0.7, 0.2),
        ..viewer(&hands).placements[2]
    };
    Arc::make_mut(&mut viewer_mut(&mut hands).placements)[2] = at;
    hands.step();
    until_drawn(&mut hands);
    let shots = viewer(&hands).shots;
    until(&mut hands, "new shadows", |v| v.shots > shots);
    let picture = folder.path().join("moved.png");
    viewer_mut(&mut hands).save(Saved::Picture, picture.clone());
    until(&mut hands, "a file", |_| picture.exists());
    // What is saved as a scene is the same picture, drawn by the library.
    let scene = viewer(&hands).as_placed().expect("a scene");
    let text = file::to_toml(&scene).expect("all meshes have names");
    let read = file::parse(
        &text,
        "saved",
        folder.path(),
        &crate::scene::load::ReadOptions::default(),
        &Context::default(),
    )
    .expect("it reads");
    let seen = crate::image::io::read_picture(&picture).expect("a picture");
    let drawn = drawn(&read, &hands, seen.width, seen.height);
    // Of eight bits, too.
    let again = folder.path().join("drawn.png");
    crate::image::io::write_picture(&again, &drawn).expect("it is written");
    let drawn = crate::image::io::read_picture(&again).expect("a picture");
    let side = |picture| crate::image::compare::Side { picture, planes: None };
    let all = crate::image::compare::Set::All;
    let found = crate::image::compare::compare(side(&seen), side(&drawn), &all).expect("one size");
    assert!(found.flip < 1e-3, "FLIP {}", found.flip);
}

/// A scene by the first method, as `render` draws it; of 8 bits a channel.
fn drawn(
    scene: &crate::scene::description::Scene,
    hands: &Hands<'_>,
    width: u32,
    height: u32,
) -> crate::image::Picture {
    let cx = Context::default();
    let options = viewer(hands).prepare;
    let ready = crate::scene::PreparedScene::new(scene, &options, &cx).expect("it is a scene");
    let eye = ready.eye_for(crate::camera::eye::ImageSize { width, height }).expect("a view");
    let side = viewer(hands).settings.sides[0].side();
    let method = crate::methods::method(side.method).expect("it is there");
    let mut renderer = crate::frame::Renderer::new();
    renderer.render(&ready, &eye, method, &side.params, false, &cx).expect("it is drawn");
    renderer.picture().clone()
}

#[test]
fn a_bad_file_says_so_and_the_scene_stays() {
    let (folder, path) = small();
    let mut hands = opened(&path, [400.0, 300.0], without_panel());
    hands.step();
    until_drawn(&mut hands);
    let bad = folder.path().join("bad.ply");
    std::fs::write(&bad, "ply\nformat ascii 1.0\nelement vertex 3\n").expect("it is written");
    drop_file(&mut hands, &bad);
    until(&mut hands, "a message", |v| v.message.as_ref().is_some_and(|(_, is_bad, _)| *is_bad));
    let (text, ..) = viewer(&hands).message.clone().expect("it is there");
    assert!(text.contains("bad.ply"), "{text}");
    let small = path.to_string_lossy().into_owned();
    assert_eq!(viewer(&hands).request.inputs, [small], "the command is still that of what is seen");
    assert_eq!(viewer(&hands).scene.as_ref().map(|s| s.name.as_str()), Some("small"));
    let before = viewer(&hands).shots;
    viewer_mut(&mut hands).eye.position.x += 0.2;
    until_drawn(&mut hands);
    assert!(viewer(&hands).shots > before, "it is still drawn");
    hands.key_press(Key::Escape);
    hands.step();
    assert!(viewer(&hands).message.is_none());
}

#[test]
fn saving_planes_touches_no_other_file() {
    let (folder, path) = small();
    let mut hands = opened(&path, [400.0, 300.0], without_panel());
    hands.step();
    until_drawn(&mut hands);
    let [picture, planes] = ["kept.png", "kept.exr"].map(|name| folder.path().join(name));
    std::fs::write(&picture, "mine").expect("it is written");
    viewer_mut(&mut hands).save(Saved::Planes, planes.clone());
    until(&mut hands, "a file", |_| planes.exists());
    let (seen, _) = crate::image::aov::read_aov(&planes).expect("it reads");
    assert!(seen.mirror.contains(&0));
    assert_eq!(std::fs::read(&picture).expect("it is there"), b"mine");
}

#[test]
fn a_dropped_scene_opens_with_its_own_view() {
    let (folder, path) = small();
    let mut hands = opened(&path, [400.0, 300.0], without_panel());
    hands.step();
    until_drawn(&mut hands);
    let other = folder.path().join("other.toml");
    let text =
        SCENE.replace("\"small\"", "\"other\"").replace("[0.0, 1.2, 3.0]", "[2.0, 1.5, 2.0]");
    std::fs::write(&other, text).expect("it is written");
    drop_file(&mut hands, &other);
    until(&mut hands, "the other scene", |v| v.scene.as_ref().is_some_and(|s| s.name == "other"));
    assert_eq!(viewer(&hands).eye.position, glam::DVec3::new(2.0, 1.5, 2.0));
    until_drawn(&mut hands);
}

#[test]
fn methods_are_changed_and_compared() {
    let (_folder, path) = small();
    let mut hands = opened(&path, [900.0, 600.0], Settings::default());
    hands.step();
    until_drawn(&mut hands);
    hands.get_by_label("method").scroll_to_me();
    hands.step();
    hands.get_by_role_and_label(egui::Role::ComboBox, "method").click();
    hands.step();
    hands.step();
    hands.get_by_role_and_label(egui::Role::Button, "raytrace").click();
    hands.step();
    until_drawn(&mut hands);
    let method =
        |hands: &Hands<'_>, i: usize| viewer(hands).display.as_ref().map(|d| d.reports[i].method);
    assert_eq!(method(&hands, 0), Some("raytrace"));
    hands.key_press(Key::C);
    hands.step();
    until_drawn(&mut hands);
    assert_eq!(method(&hands, 1), Some("raytrace"), "the right side's default");
    viewer_mut(&mut hands).settings.shown = super::super::settings::Shown::Flip;
    hands.step();
    until(&mut hands, "errors", |v| v.display.as_ref().is_some_and(|d| d.errors.is_some()));
    let errors = |hands: &Hands<'_>| viewer(hands).display.as_ref().and_then(|d| d.errors);
    let (rmse, psnr, flip) = errors(&hands).expect("they are there");
    assert_eq!((rmse, psnr, flip), (0.0, None, 0.0), "the same on both sides");
    // Beside the divider, too: they come after the picture.
    viewer_mut(&mut hands).settings.shown = super::super::settings::Shown::Divider;
    hands.step();
    until(&mut hands, "errors without a map", |v| {
        v.display.as_ref().is_some_and(|d| d.map.is_none() && d.errors.is_some())
    });
    hands.step();
    hands.get_by_label_contains("RMSE");
    viewer_mut(&mut hands).settings.shown = super::super::settings::Shown::Flip;
    viewer_mut(&mut hands).settings.sides[0].method = "c3rc".into();
    hands.step();
    until_drawn(&mut hands);
    until(&mut hands, "a difference", |v| {
        v.display.as_ref().and_then(|d| d.errors).is_some_and(|(rmse, ..)| rmse > 0.0)
    });
    assert!(errors(&hands).is_some_and(|(_, _, flip)| flip > 0.0 && flip < 0.2));
}

#[test]
fn loading_is_cancelled_by_its_button() {
    let (_folder, path) = small();
    let mut hands = opened(&path, [400.0, 300.0], without_panel());
    hands.step();
    until_drawn(&mut hands);
    assert!(hands.query_by_label("cancel").is_none());
    // Seconds of work.
    viewer_mut(&mut hands).prepare.surfels = 10_000_000;
    viewer_mut(&mut hands).prepare_again();
    until(&mut hands, "progress", |v| v.progress.is_some());
    hands.step();
    hands.get_by_label("cancel").click();
    until(&mut hands, "the end", |v| v.progress.is_none());
    let shown = viewer(&hands).prepared.as_ref().expect("something stays");
    assert!(shown.surfels < 1_000_000, "{} surfels", shown.surfels);
    let said = viewer(&hands).message.as_ref().map(|m| m.0.as_str());
    assert_eq!(said, Some("loading was cancelled"));
    // The next load is none of it.
    viewer_mut(&mut hands).prepare.surfels = 30_000;
    viewer_mut(&mut hands).prepare_again();
    until_drawn(&mut hands);
}

#[test]
fn slow_pictures_do_not_keep_others_waiting() {
    let (folder, path) = small();
    let mut hands = opened(&path, [400.0, 300.0], without_panel());
    hands.step();
    until_drawn(&mut hands);
    let rays = |hands: &mut Hands<'_>, spp: u32| {
        let side = &mut viewer_mut(hands).settings.sides[0];
        side.method = "raytrace".into();
        side.params.insert("spp".into(), spp.to_string());
    };
    // Minutes of work for a still picture, which another scene ends.
    rays(&mut hands, 65_536);
    for _ in 0..10 {
        hands.step();
        std::thread::sleep(Duration::from_millis(20));
    }
    let other = folder.path().join("other.toml");
    std::fs::write(&other, SCENE.replace("\"small\"", "\"other\"")).expect("it is written");
    drop_file(&mut hands, &other);
    until(&mut hands, "another scene", |v| v.prepared.as_ref().is_some_and(|p| p.name == "other"));
    // Moving ones end for newer ones, and are smaller from then on.
    let start = Instant::now();
    while viewer(&hands).scale() == 1.0 {
        assert!(start.elapsed() < PATIENCE, "a moving picture was never given up");
        viewer_mut(&mut hands).eye.position.x += 0.01;
        hands.step();
        std::thread::sleep(Duration::from_millis(20));
    }
    rays(&mut hands, 1);
    until_drawn(&mut hands);
}

#[test]
fn small_and_large_windows_are_drawn() {
    let (_folder, path) = small();
    let mut hands = opened(&path, [200.0, 150.0], Settings::default());
    hands.step();
    until_drawn(&mut hands);
    assert!(viewer(&hands).size.width >= 150, "there is a picture beside the panels");
    for size in [[3840.0, 2160.0], [160.0, 120.0], [1.0, 1.0], [640.0, 480.0]] {
        hands.set_size(size.into());
        hands.step();
        until_drawn(&mut hands);
    }
    // A storm: only the last has to come.
    for i in 0_u8..60 {
        let t = f32::from(i);
        hands.set_size(egui::vec2(300.0 + 11.0 * t, 700.0 - 7.0 * t));
        hands.step();
    }
    until_drawn(&mut hands);
}

#[test]
fn a_pixel_of_the_mirror_tells_what_it_shows() {
    let (_folder, path) = small();
    let settings = Settings { inspect: true, ..without_panel() };
    let mut hands = opened(&path, [400.0, 300.0], settings);
    hands.step();
    until_drawn(&mut hands);
    // The lower half of the ball shows the ground.
    let at = on_canvas(&hands, 0.5, 0.62);
    click(&mut hands, at);
    until(&mut hands, "a kept camera", |v| v.pinned.is_some());
    let kept = viewer(&hands).pinned.clone().expect("it is there");
    assert_eq!(kept.thing, Some(Thing::Mirror(0)));
    let shown = kept.reflected.expect("it is a mirror");
    assert_eq!(shown.object, Some(1), "the ground");
    let weights: f32 = shown.weights.iter().sum();
    assert!((weights - 1.0).abs() < 1e-4);
    assert!(shown.position.expect("known").y.abs() < 0.02, "on the ground: {:?}", shown.position);
    assert!(shown.lambda.expect("known") > 0.0 && shown.surfel.is_some());
    assert_eq!(shown.images, None, "blocks do not ask");
    let trace = kept.trace.expect("c3rc has cameras");
    assert!(trace.clouds.iter().any(|c| c.surfels.iter().any(|s| s.valid)));
    assert_eq!(viewer(&hands).selected, None, "no handles lie over it");
    hands.key_press(Key::Escape);
    hands.step();
    assert!(viewer(&hands).pinned.is_none() && viewer(&hands).probed.is_none(), "let go");
    // The pointer jumps there, and rests.
    let at = on_canvas(&hands, 0.5, 0.55);
    hands.event(egui::Event::PointerMoved(at));
    hands.step();
    until(&mut hands, "what is under the pointer", |v| {
        v.probed.as_ref().is_some_and(|p| p.trace.is_some() && !p.probe.pick)
    });
    // A new picture is asked anew.
    viewer_mut(&mut hands).probed = None;
    viewer_mut(&mut hands).eye.position.x += 0.05;
    until_drawn(&mut hands);
    until(&mut hands, "what is there now", |v| v.probed.is_some());
}

#[test]
fn classes_caustics_and_all_paths_are_shown() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bowl.toml");
    let bowl = SCENE.replacen("shape = \"sphere\"", "shape = \"bowl\"", 1);
    std::fs::write(&path, bowl).expect("it is written");
    let settings =
        Settings { paths: true, caustic: true, mirror: MirrorColors::Class, ..without_panel() };
    let mut hands = opened(&path, [400.0, 300.0], settings);
    hands.step();
    until_drawn(&mut hands);
    until(&mut hands, "classes", |v| v.display.as_ref().is_some_and(|d| d.map.is_some()));
    let rulings = viewer(&hands).display.as_ref().map_or(0, |d| d.caustic.len());
    assert!(rulings > 100, "a hollow mirror focuses: {rulings}");
    // On the ground, and on what the bowl shows.
    let mut counted = Vec::new();
    for (x, y) in [(0.2, 0.9), (0.5, 0.55)] {
        viewer_mut(&mut hands).pinned = None;
        let at = on_canvas(&hands, x, y);
        click(&mut hands, at);
        until(&mut hands, "a kept point", |v| v.pinned.is_some());
        let kept = viewer(&hands).pinned.clone().expect("it is there");
        let eye = viewer(&hands).eye.position;
        let point = kept.point.expect("something is seen there");
        for path in &kept.paths {
            let [a, b] = [path.mirror_point.distance(eye), path.mirror_point.distance(point)];
            assert!((a + b - path.length).abs() < 1e-6 * path.length, "{path:?}");
        }
        let seen = kept.paths.iter().filter(|path| !path.hidden).count();
        counted.push((kept.thing, kept.paths.len(), seen));
        hands.key_press(Key::Escape);
        hands.step();
    }
    assert_eq!(counted[0].0, Some(Thing::Object(1)), "the ground itself");
    assert!(counted.iter().any(|&(_, _, seen)| seen > 0), "{counted:?}");
    viewer_mut(&mut hands).settings.mirror = MirrorColors::Reflection;
    viewer_mut(&mut hands).settings.caustic = false;
    hands.step();
    until(&mut hands, "the reflection again", |v| {
        v.display.as_ref().is_some_and(|d| d.map.is_none() && d.caustic.is_empty())
    });
}

#[test]
fn without_a_file_dialog_something_happens_all_the_same() {
    use super::super::app::Chosen;
    use super::super::dialog::Kind;
    let (folder, path) = small();
    let mut hands = opened(&path, [300.0, 200.0], without_panel());
    hands.step();
    until_drawn(&mut hands);
    viewer_mut(&mut hands).chosen.0.send(Chosen::NoDialog(Kind::Open)).expect("it listens");
    hands.step();
    let message = viewer(&hands).message.clone().expect("it says so");
    assert!(message.1 && message.0.contains("no file dialog"), "{message:?}");
    viewer_mut(&mut hands).folder = folder.path().to_owned();
    viewer_mut(&mut hands).chosen.0.send(Chosen::NoDialog(Kind::Aov)).expect("it listens");
    let saved = folder.path().join("catoptric.exr");
    until(&mut hands, "a file", |_| saved.exists());
    // What is saved gets a name that no file has.
    let first = Kind::Picture.instead(folder.path()).expect("a name");
    assert_eq!(first, folder.path().join("catoptric.png"));
    std::fs::write(&first, b"taken").expect("it is written");
    let second = Kind::Picture.instead(folder.path());
    assert_eq!(second, Some(folder.path().join("catoptric-2.png")));
    assert_eq!(Kind::Scene.instead(folder.path()), Some(folder.path().join("scene.toml")));
    assert_eq!(Kind::Open.instead(folder.path()), None);
}
