//! Blocks against what they stand for: exact rays, every surfel, layers in order.

use fearless_simd::dispatch;
use glam::{DVec3, Vec2, Vec3, Vec4};

use super::beam::{Beam, Place, Rays};
use super::blend::{Side, blend};
use super::block::{BLOCK, Block, GROUP, GROUPS, LANES, SIDE};
use super::close::{self, Layer, Tile};
use super::seen::{AT_ONCE, Room, Seen, key};
use super::splats::{FARTHER, FORM, PER_HALF, RADIANCE, SIZE as HALF_SIZE, Splats, WEIGHT, WIDE};
use super::walk::Walk;
use crate::camera::Eye;
use crate::camera::eye::ImageSize;
use crate::camera::mirror_ray::{RayScale, RaySource, reflected_ray};
use crate::context::Context;
use crate::error::Error;
use crate::frame::Renderer;
use crate::geometry::lanes::simd_level;
use crate::methods::{FrameInput, Method, Params, c3rc::C3rc};
use crate::plan::{GatherCounts, Pass, Plan, Reflection};
use crate::scene::description::{Environment, EyeDescription};
use crate::scene::{GivenSurfels, PreparedScene, builtin};
use crate::visibility::mirror_rays::{AREA, RayField, TILE, TILE_PX};

const SIZE: ImageSize = ImageSize { width: 160, height: 120 };

/// A mirror over a floor of surfels, which it partly hides from itself.
fn scene(mirror: &str) -> (PreparedScene, Eye) {
    let at =
        |i: u16| Vec3::new(f32::from(i % 150) * 0.04 - 3.0, -0.9, f32::from(i / 150) * 0.04 - 3.0);
    let floor: Vec<Vec3> = (0..22_500).map(at).collect();
    let (normals, radiance) = (vec![Vec3::Y; floor.len()], vec![Vec3::X; floor.len()]);
    let given = GivenSurfels { positions: &floor, normals: &normals, radiance: &radiance };
    let eye = EyeDescription {
        position: DVec3::new(0.3, 1.1, 3.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
        fov_y: 0.7,
    };
    let mirror = builtin::shape(mirror, Some(1000)).unwrap();
    let sky = Environment::Constant(Vec3::ONE);
    let scene = PreparedScene::from_surfels(mirror, given, eye, sky).unwrap();
    let eye = scene.eye_for(SIZE).unwrap();
    (scene, eye)
}

/// Calls `f` with all beams of a view, the corner of their block in the picture, and the pixels that were left.
fn beams(scene: &PreparedScene, eye: &Eye, mut f: impl FnMut(&Beam, [usize; 2], &[u32; GROUPS])) {
    let mut beam = Beam::empty();
    let mut renderer = Renderer::new();
    renderer.see(scene, eye);
    let mut field = RayField::new();
    let tile = TILE_PX as usize;
    for top in (0..SIZE.height).step_by(tile) {
        for left in (0..SIZE.width).step_by(tile) {
            let origin = [left, top];
            let shown = dispatch!(simd_level(), simd => field.enter(simd, eye, renderer.visibility(), origin));
            field.fill(eye, scene, &shown);
            for y in (0..TILE).step_by(BLOCK) {
                for x in (0..TILE).step_by(BLOCK) {
                    let mut block = Block::new(&shown, [x, y]);
                    while let Some(at) = block.seed() {
                        let tangent = field.tangent(eye, scene, at);
                        dispatch!(simd_level(), simd => beam.aim(simd, eye, &field, &tangent, &block, at));
                        f(&beam, [left as usize + x, top as usize + y], &block.left);
                        block.take(&beam.pixels);
                    }
                }
            }
        }
    }
}

/// How far, in shares of the distance, a beam's rays are from those of the pixels that `moved` away.
fn farthest_off(mirror: &str, moved: f32) -> (f32, usize) {
    let (scene, eye) = scene(mirror);
    let mut renderer = Renderer::new();
    renderer.see(&scene, &eye);
    let (mut most, mut rays) = (0.0f32, 0);
    beams(&scene, &eye, |beam, [left, top], open| {
        assert_ne!(beam.pixels, [0; GROUPS], "a beam has its first pixel");
        let twice = beam.pixels.iter().zip(open).any(|(own, open)| own & !open != 0);
        assert!(!twice, "no pixel is in two beams");
        let all = (0..GROUPS * LANES).map(|i| (i / LANES, i % LANES));
        for (group, lane) in all.filter(|(group, lane)| beam.pixels[*group] >> lane & 1 != 0) {
            let x = left + group % SIDE * GROUP + lane % GROUP;
            let y = top + group / SIDE * GROUP + lane / GROUP;
            let own = &beam.rays[group];
            let id = renderer.visibility().mirror_ids[y * SIZE.width as usize + x];
            let px = Vec2::new(x as f32 + 0.5 + moved, y as f32 + 0.5);
            let triangle = scene.mirror_triangle(id);
            let (source, scale) = (RaySource::Surface, RayScale::EyeDistance);
            let (from, along) = reflected_ray(&eye, px, &triangle, source, scale).unwrap();
            let [u, v, a] = beam.axes;
            let begin = a.dot(from - beam.origin);
            assert!((begin - own.begin[lane]).abs() < 1e-3 || moved != 0.0);
            for s in [0.5f32, 4.0] {
                let [bu, bv] = [0, 1].map(|k| own.start[k][lane] + s * own.slope[k][lane]);
                let place = beam.origin + u * bu + v * bv + a * s;
                let off = (place - from).reject_from(along).length();
                most = most.max(off / (place - from).length());
                rays += 1;
            }
        }
    });
    (most, rays)
}

#[test]
fn every_pixel_has_its_exact_ray() {
    for mirror in ["sphere", "teapot", "bowl", "wave"] {
        let (off, rays) = farthest_off(mirror, 0.0);
        assert!(rays > 2000 && off < 1e-4, "{mirror}: {off} off in {rays}");
        let (off, _) = farthest_off(mirror, 0.5);
        assert!(off > 1e-3, "{mirror}: half a pixel is to be seen, not {off}");
    }
}

/// With a walk over the floor's tree, all surfels of it.
fn walk_floor(scene: &PreparedScene, beam: &Beam, f: impl FnOnce(&mut Walk<'_>)) {
    let cloud = &scene.clouds[0];
    let mut walk = Walk {
        beam,
        frame: beam.frame(&Place::new(&cloud.to_scene)),
        cloud,
        surfels: &scene.surfels,
        looks: &scene.looks,
        range: [beam.first, f32::MAX],
        detail: 0.0,
        front_only: false,
        hides: false,
    };
    f(&mut walk);
}

/// The surfels of the floor that a beam finds by its tree, or by looking at all.
fn found(scene: &PreparedScene, beam: &Beam, by_tree: bool) -> Vec<u32> {
    let mut room = Room::default();
    let mut seen = dispatch!(simd_level(), simd => Seen::new(simd, &mut room, beam, 0.1));
    // So that nothing is left out for being hidden.
    seen.until = usize::MAX;
    let mut counts = GatherCounts::default();
    dispatch!(simd_level(), simd => walk_floor(scene, beam, |walk| match by_tree {
        true => walk.run(simd, &mut seen, &mut counts),
        false => walk.look_at_all(simd, &mut seen, &mut counts),
    }));
    let mut list: Vec<u32> =
        seen.order.iter().map(|key| seen.splats.surfel(super::seen::index(*key))).collect();
    list.sort_unstable();
    list
}

#[test]
fn the_tree_leaves_out_nothing_that_is_seen() {
    let (mut beams_that_see, mut all) = (0, 0);
    for mirror in ["sphere", "teapot", "bowl"] {
        let (scene, eye) = scene(mirror);
        let mut n = 0;
        beams(&scene, &eye, |beam, _, _| {
            n += 1;
            let wanted = found(&scene, beam, false);
            let found = found(&scene, beam, true);
            let lacks: Vec<_> = wanted.iter().filter(|s| !found.contains(s)).collect();
            assert!(found == wanted, "{mirror}, beam {n}: lacks {lacks:?} of {}", wanted.len());
            beams_that_see += usize::from(!wanted.is_empty());
            all += wanted.len();
        });
    }
    assert!(beams_that_see > 100 && all > 2000, "{beams_that_see} beams, {all} surfels");
}

#[test]
fn groups_leave_out_nothing_that_they_see() {
    let (mut seen_at_all, mut spared) = (0, 0);
    for mirror in ["sphere", "teapot", "bowl"] {
        let (scene, eye) = scene(mirror);
        beams(&scene, &eye, |beam, _, _| {
            let mut room = Room::default();
            dispatch!(simd_level(), simd => {
                let mut seen = Seen::new(simd, &mut room, beam, 0.1);
                walk_floor(&scene, beam, |walk| walk.run(simd, &mut seen, &mut GatherCounts::default()));
                seen.sort();
                let all = vec![u16::MAX; seen.order.len().next_multiple_of(AT_ONCE)];
                let all = &all[..seen.order.len() / AT_ONCE * AT_ONCE];
                // Whole ones only: behind the last of them there are no splats to be named.
                let order = &seen.order[..all.len()];
                for group in (0..GROUPS).filter(|group| beam.pixels[*group] != 0) {
                    let some: Vec<u16> = order.iter().map(|key| seen.splats.groups(super::seen::index(*key))).collect();
                    let few = blend(simd, beam, group, seen.splats, order, &some, false);
                    let whole = blend(simd, beam, group, seen.splats, order, all, false);
                    for lane in (0..LANES).filter(|lane| beam.pixels[group] >> lane & 1 != 0) {
                        // A splat that just does not reach a pixel may weigh a rounding there.
                        let off = (few.value(lane) - whole.value(lane)).abs().max_element();
                        assert!(off < 1e-6 && (few.full[lane] - whole.full[lane]).abs() < 1e-6, "{mirror}");
                        seen_at_all += usize::from(few.shown[lane] > 0.5);
                    }
                    spared += some.iter().filter(|groups| **groups >> group & 1 == 0).count();
                }
            });
        });
    }
    assert!(seen_at_all > 5000 && spared > 20_000, "{seen_at_all} pixels, {spared} spared");
}

/// How far steps from pixel to pixel are, in the mean, from what a beam has for them: with its bend, and without.
fn steps_off(mirror: &str) -> [f64; 2] {
    let (scene, eye) = scene(mirror);
    let (mut off, mut count) = ([0.0; 2], 0);
    beams(&scene, &eye, |beam, _, _| {
        let bend = dispatch!(simd_level(), simd => beam.bend(simd));
        if beam.pixels.iter().map(|p| p.count_ones()).sum::<u32>() < 100 {
            return;
        }
        for group in 0..GROUPS {
            // From the second to the third pixel of the second row.
            let lanes = [GROUP + 1, GROUP + 2];
            if lanes.iter().any(|lane| beam.pixels[group] >> lane & 1 == 0) {
                continue;
            }
            let x = (group % SIDE * GROUP) as f32 + 1.5 - beam.at[0];
            let y = (group / SIDE * GROUP) as f32 + 1.0 - beam.at[1];
            for k in 0..2 {
                let slope = &beam.rays[group].slope[k];
                let true_step = slope[lanes[1]] - slope[lanes[0]];
                let straight = beam.step_per_s[k][0];
                let [xx, xy, _] = bend.slope[k];
                for (off, step) in off.iter_mut().zip([straight + xx * x + xy * y, straight]) {
                    *off += f64::from((step - true_step).abs());
                }
            }
            count += 1;
        }
    });
    assert!(count > 100, "{mirror}: {count}");
    off.map(|off| off / f64::from(count))
}

#[test]
fn steps_bend_with_the_mirror() {
    // Triangles of other mirrors are small: a step differs from one to the next.
    let [bent, straight] = steps_off("sphere");
    assert!(bent < 0.6 * straight, "{bent} and {straight}");
}

/// What a surface's splats of one size (half of it in pixels) tell of a pixel whose middle lies so many pixels inside its edge.
fn at_edge(inside: f64, half: f64) -> Side<f64> {
    let mut side = Side { total: 0.0, about: [0.0; 2], size: 0.0 };
    let steps = 200;
    for (x, y) in (0..steps * steps).map(|i| (i % steps, i / steps)) {
        let [x, y] = [x, y].map(|i| (f64::from(i) + 0.5) / f64::from(steps) * 2.0 - 1.0);
        let kernel = (1.0 - x * x - y * y).max(0.0).powi(2);
        if x * half > -inside {
            side.total += kernel;
            side.about[0] += kernel * x;
        }
    }
    // All of the kernel is 1.
    let each = 4.0 / f64::from(steps * steps) * 3.0 / std::f64::consts::PI;
    Side {
        total: side.total * each,
        about: [side.about[0] * each, 0.0],
        size: side.total * each * half,
    }
}

#[test]
fn coverage_is_that_of_an_edge() {
    for half in [1.5, 2.0, 4.0] {
        for i in -10..=10 {
            let inside = f64::from(i) * 0.1;
            let truth = |inside: f64| (0.5 + inside).clamp(0.0, 1.0);
            let found = covered(&at_edge(inside, half));
            // Edges of large splats lie a little farther out.
            let out = if half > 2.0 { 0.3 * half } else { 0.0 };
            let [least, most] = [truth(inside) - 0.18, truth(inside + out) + 0.18];
            assert!(least < found && found < most, "{half} px, {inside} px inside: {found}");
        }
    }
    // What large splats cover is blurred over them.
    let blurred = at_edge(-1.0, 4.0);
    assert!(blurred.total > 0.2 && covered(&blurred) < 0.02, "{blurred:?}");
    // In a surface, where splats happen to lie apart.
    assert_eq!(covered(&Side { total: 0.7, about: [0.05, 0.0], size: 1.05 }), 1.0);
    // A thin thing, or nearly nothing.
    assert_eq!(covered(&Side { total: 0.125, about: [0.0; 2], size: 0.125 }), 0.125);
    assert_eq!(covered(&Side { total: 0.0, about: [0.0; 2], size: 0.0 }), 0.0);
}

fn covered(side: &Side<f64>) -> f64 {
    #[expect(clippy::cast_possible_truncation, reason = "as it is used")]
    let of = |x: f64| x as f32;
    let Side { total, about: [u, v], size } = *side;
    let side = Side { total: of(total), about: [of(u), of(v)], size: of(size) };
    f64::from(side.covered())
}

/// A beam of parallel rays a unit apart, and round splats in it: u, v, radius, weight in the middle, depth. From numbers on they
/// hide, and are seen from behind.
fn drawn(list: &[[f32; 5]], first_hider: u32, first_back: u32) -> super::blend::Blended {
    const COLORS: [Vec3; 4] = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
    let (scene, eye) = scene("plane");
    let mut beam = None;
    beams(&scene, &eye, |b, _, _| beam = Some(b.clone()));
    let mut beam = beam.unwrap();
    beam.pixels = [0; GROUPS];
    beam.pixels[0] = 0xffff;
    beam.rays[0] = Rays::default();
    for lane in 0..LANES {
        beam.rays[0].start[0][lane] = (lane % GROUP) as f32;
        beam.rays[0].start[1][lane] = (lane / GROUP) as f32;
    }
    let mut splats = Splats::default();
    let mut order = Vec::new();
    for (i, &[u, v, radius, weight, depth]) in list.iter().enumerate() {
        let form = 1.0 / (radius * radius);
        let surfel = u32::try_from(i).unwrap();
        splats.push([u, v, depth], surfel, |batch| {
            batch.shows = surfel < first_hider;
            batch.back = u32::from(surfel >= first_back);
            (batch.early, batch.from) = if batch.shows { (0, 0.0) } else { (1, 0.1) };
            let value = &mut batch.value;
            value[WEIGHT][0] = weight;
            (value[FARTHER][0], value[HALF_SIZE][0]) = (depth - 0.5, 1.0);
            (value[FORM][0], value[FORM + 1][0], value[FORM + 2][0]) = (form, 0.0, form);
            (value[PER_HALF][0], value[PER_HALF + 1][0]) = (1.0 / radius, 1.0 / radius);
            for (k, channel) in COLORS[i].to_array().into_iter().enumerate() {
                value[RADIANCE + k][0] = channel;
            }
        });
        order.push(key(depth, i * WIDE));
    }
    order.sort_unstable();
    let mut groups = vec![1u16; order.len()];
    groups.resize(AT_ONCE, 0);
    dispatch!(simd_level(), simd => blend(simd, &beam, 0, &splats, &order, &groups, true))
}

#[test]
fn the_nearest_fill_a_pixel_and_the_rest_shows_through() {
    let parts =
        [[1.0, 1.0, 0.4, 9.0, 3.0], [1.0, 1.0, 0.4, 0.125, 1.0], [1.0, 1.0, 0.4, 0.125, 2.0]];
    // What one of the two covers, and both.
    let of = |total: f32| Side { total, about: [0.0; 2], size: total }.covered();
    let [one, both] = [of(0.125), of(0.25)];
    assert!(0.1 < one && one < both && both < 0.9, "{one} and {both}");
    let lane = GROUP + 1;
    let is = |list: &[[f32; 5]], hider: u32, back: u32, color: [f32; 3], shown: f32| {
        let done = drawn(list, hider, back);
        let off = (done.value(lane).truncate() - Vec3::from_array(color)).abs().max_element();
        assert!(off < 1e-6 && (done.shown[lane] - shown).abs() < 1e-6, "{done:?}");
        assert!((0..LANES).all(|l| l == lane || done.full[l] == 0.0), "its neighbours are empty");
        done
    };
    let done = is(&parts, 9, 9, [1.0 - both, one, both - one], 1.0);
    assert_eq!(done.first[lane].to_bits() as usize, WIDE, "the nearest");
    is(&parts[1..2], 9, 9, [one, 0.0, 0.0], one);
    // The last two are a mirror's: they hide and show nothing.
    is(&parts, 1, 9, [1.0 - both, 0.0, 0.0], 1.0 - both);
    // A mirror hides nothing nearer than its clearance.
    let near = [[1.0, 1.0, 0.4, 9.0, 3.0], [1.0, 1.0, 0.4, 9.0, 0.05]];
    is(&near, 1, 9, [1.0, 0.0, 0.0], 1.0);
    // One surface, and its other side: this covers no more of the pixel, however near it is.
    let sides = [[1.0, 1.0, 0.4, 0.125, 1.0], [1.0, 1.0, 0.4, 0.125, 1.1]];
    is(&sides, 9, 9, [both * 0.5, both * 0.5, 0.0], both);
    is(&sides, 9, 1, [one, 0.0, 0.0], one);
    // Where the front is full, that is known, and up to where.
    let done = drawn(&[[1.5, 1.5, 99.0, 9.0, 2.0], [1.0, 1.0, 0.4, 9.0, 3.0]], 9, 9);
    assert_eq!(done.full_from, 2.0);
}

#[test]
fn gaps_are_closed_and_edges_stay() {
    let size = ImageSize { width: 2 * TILE_PX, height: TILE_PX };
    // All rows are alike.
    let tile = |row: &[f32; TILE]| {
        let mut tile = Tile { value: [Vec4::ZERO; AREA], layer: [Layer::default(); AREA] };
        for i in 0..AREA {
            let full = row[i % TILE];
            tile.value[i] = Vec4::new(full, 0.0, 0.0, full);
            let near = if full > 0.0 { 1.0 } else { 0.0 };
            tile.layer[i] = Layer { open: 1.0 - full, near, behind: 0.0 };
        }
        Some(Box::new(tile))
    };
    let mut first = [0.0; TILE];
    first[..5].copy_from_slice(&[1.0, 0.5, 1.0, 0.5, 0.0]);
    // A gap on a tile's last column, and the picture's end.
    (first[TILE - 2], first[TILE - 1]) = (1.0, 0.5);
    let mut second = [0.0; TILE];
    (second[0], second[TILE - 1]) = (1.0, 0.5);
    let tiles = [tile(&first), tile(&second)];
    let picture = close::Picture { size, tiles: &tiles };
    let near =
        |x: usize, w: f32| (picture.closed([x, 0]) - Vec4::new(w, 0.0, 0.0, w)).length() < 1e-6;
    assert!(near(1, 1.0), "a gap: {}", picture.closed([1, 0]));
    assert!(near(3, 0.5), "an edge: {}", picture.closed([3, 0]));
    assert!(near(0, 1.0) && near(4, 0.0), "full and empty ones stay");
    assert!(near(TILE - 1, 1.0), "between two tiles");
    assert!(near(2 * TILE - 1, 0.5), "at the picture's end");
}

#[test]
fn blocks_are_drawn_where_they_can_be() {
    let (scene, eye) = scene("sphere");
    let mut renderer = Renderer::new();
    renderer.see(&scene, &eye);
    let frame = FrameInput { scene: &scene, eye: &eye, visibility: renderer.visibility() };
    for (settings, gathers, blocks) in [
        (&[][..], true, true),
        (&[], false, false),
        (&[("splat", "square2")], true, false),
        (&[("test", "sweep")], true, false),
        (&[("depth", "push-back")], true, false),
        (&[("roots", "first")], true, false),
        (&[("cameras", "cells")], true, false),
    ] {
        let mut params = Params::defaults(C3rc.info().params);
        for (name, value) in settings {
            params.set(C3rc.info().param(name), value).unwrap();
        }
        let mut plan = Plan { gathers, ..Plan::default() };
        let made: crate::methods::Made = std::sync::Arc::new(());
        C3rc.plan(frame, &made, &params, &mut plan).unwrap();
        assert_eq!(matches!(plan.passes[0], Pass::Gather(_)), blocks, "{settings:?}");
    }
    // They stop when they are to.
    let cancel = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(true));
    let settings = super::CameraSettings {
        ray_scale: RayScale::EyeDistance,
        shape: crate::plan::SplatShape::Ellipse,
        detail: 2.0,
        mirror_occlusion: true,
    };
    let kernel = super::Kernel { frame, settings };
    let gather = |cx: &Context| {
        let mut out = Reflection::default();
        crate::plan::GatherKernel::gather(&kernel, &mut out, cx).map(|done| (done, out))
    };
    assert!(matches!(gather(&Context::cancelled_by(cancel)), Err(Error::Cancelled)));
    let (done, out) = gather(&Context::default()).unwrap();
    let counts = done.surfels.unwrap();
    assert!(counts.valid > 1000 && counts.valid <= counts.projections, "{counts:?}");
    let covered = out.coverage.iter().filter(|c| **c > 0.5).count();
    assert!(covered > 500, "{covered} pixels show the floor");
}
