//! Moving an object or a mirror builds nothing anew and leaves no trace of where it was before.

use std::sync::Arc;

use catoptric::Context;
use catoptric::geometry::{Mesh, Similarity};
use catoptric::image::Picture;
use catoptric::scene::PreparedScene;
use catoptric::scene::description::{Mirror, Scene};
use glam::{DVec3, Vec3};

use super::{
    BLUE, GREY, RED, looks, moved, object, prepared, rendered, rendered_with, scene, shape,
    share_within, turned,
};

const SURFELS: usize = 40_000;
/// Of a channel, linear; two pictures of a thing that was sampled twice are closer than this nearly everywhere.
const CLOSE: f32 = 0.02;

/// A ball as mirror, with a ground, a cube and a knot around it; the knot where `place` says.
fn knot_near_a_ball(place: Similarity) -> Scene {
    let objects = vec![
        object(
            "ground",
            shape("ground", 2),
            Similarity { scale: 6.0, ..Similarity::IDENTITY },
            GREY,
        ),
        object("cube", shape("cube", 12), moved(DVec3::new(-0.9, 0.0, 0.6)), BLUE),
        object("knot", shape("knot", 4000), place, RED),
    ];
    let mirror = (shape("sphere", 2000), moved(DVec3::new(0.0, 0.6, 0.0)));
    scene(mirror, objects, looks(DVec3::new(0.3, 1.4, 2.8), DVec3::new(0.1, 0.5, 0.0)))
}

/// The knot's positions, first and last.
fn places() -> [Similarity; 2] {
    [
        moved(DVec3::new(0.9, 0.5, 0.7)),
        turned(DVec3::new(1.0, 2.0, -0.5), 67.0, DVec3::new(0.55, 0.65, 0.95)),
    ]
}

fn picture(scene: &PreparedScene) -> Picture {
    rendered(scene, "c3rc", 160, 90).0
}

#[test]
fn a_hundred_moves_build_nothing_and_end_as_if_there_had_been_none() {
    let [first, last] = places();
    let cx = Context::default();
    let mut moving = prepared(&knot_near_a_ball(first), SURFELS);
    let builds = moving.tree_builds;
    assert_eq!(builds, 4, "one tree an object and mirror");
    let before = picture(&moving);
    let surfels = moving.surfels.clone();
    for i in 1..=100_u32 {
        let t = f64::from(i) / 100.0;
        // To and fro, and exactly to the end.
        let wave = (12.0 * t).sin() * (1.0 - t);
        let place = if i == 100 {
            last
        } else {
            turned(
                DVec3::new(wave, 1.0, t),
                67.0 * t + 90.0 * wave,
                DVec3::new(t, 0.6 + 0.2 * wave, 1.0),
            )
        };
        moving.place(2, &place);
        moving.shade(&cx).unwrap();
    }
    assert_eq!(moving.tree_builds, builds);
    assert!(
        moving.surfels.x == surfels.x
            && moving.surfels.y == surfels.y
            && moving.surfels.z == surfels.z
    );
    assert!(moving.surfels.normals == surfels.normals);
    assert!(moving.surfels.radiance != surfels.radiance, "light and shadows follow");

    let after = picture(&moving);
    let fresh = prepared(&knot_near_a_ball(last), SURFELS);
    assert_eq!(fresh.tree_builds, builds);
    assert!(after == picture(&fresh), "the path left a trace");
    assert!(share_within(&after, &before, CLOSE) < 0.93, "the move is not seen");
}

/// A mesh whose vertices were moved beforehand.
fn baked(mesh: &Mesh, transform: &Similarity) -> Arc<Mesh> {
    let positions = mesh.positions().iter().map(|p| transform.point(p.as_dvec3()).as_vec3());
    let normals = mesh.normals().iter().map(|n| transform.direction(n.as_dvec3()).as_vec3());
    let mesh = Mesh::new(positions.collect(), normals.collect(), vec![], mesh.triangles().to_vec());
    Arc::new(mesh.unwrap())
}

#[test]
fn a_moved_object_looks_like_one_made_there() {
    let [first, last] = places();
    let larger = Similarity { scale: 1.4, ..last };
    for place in [last, larger] {
        let mut moving = prepared(&knot_near_a_ball(first), SURFELS);
        let before = picture(&moving);
        moving.place(2, &place);
        moving.shade(&Context::default()).unwrap();
        let mut there = knot_near_a_ball(Similarity::IDENTITY);
        there.objects[2].mesh = baked(&there.objects[2].mesh, &place);
        let there = picture(&prepared(&there, SURFELS));
        // Sampled anew, so only nearly the same: a splat's edge here, a shadow's edge there.
        let share = share_within(&picture(&moving), &there, CLOSE);
        assert!(share >= 0.995, "{share} of the pixels are alike");
        let control = share_within(&before, &there, CLOSE);
        assert!(control < 0.93, "{control} are alike where it has not moved");
    }
}

#[test]
fn growing_is_as_exact_as_moving() {
    let alone = |scale: f64| {
        let place = Similarity { scale, ..places()[1] };
        let mut scene = knot_near_a_ball(place);
        // The other objects would have to share their surfels with a larger one.
        scene.objects.drain(..2);
        prepared(&scene, SURFELS)
    };
    let mut growing = alone(1.0);
    let before = picture(&growing);
    for scale in [0.5, 3.0, 1.4] {
        growing.place(0, &Similarity { scale, ..places()[1] });
        growing.shade(&Context::default()).unwrap();
    }
    assert_eq!(growing.tree_builds, 2, "one for the object, one for the mirror");
    let after = picture(&growing);
    assert!(after == picture(&alone(1.4)));
    assert!(share_within(&after, &before, CLOSE) < 0.97, "the growth is not seen");
}

/// A ball and a torus as mirrors, the torus where `place` says, with a ground and a cube.
fn two_mirrors(place: Similarity) -> Scene {
    let ground = Similarity { scale: 6.0, ..Similarity::IDENTITY };
    let objects = vec![
        object("ground", shape("ground", 2), ground, GREY),
        object("cube", shape("cube", 12), moved(DVec3::new(-0.9, 0.0, 0.6)), BLUE),
    ];
    let ball = (shape("sphere", 2000), moved(DVec3::new(0.0, 0.6, 0.0)));
    let mut scene =
        scene(ball, objects, looks(DVec3::new(0.3, 1.4, 2.8), DVec3::new(0.1, 0.5, 0.0)));
    scene.mirrors.push(Mirror {
        name: "torus".into(),
        mesh: shape("torus", 1000),
        source: None,
        transform: place,
        tint: Vec3::new(0.9, 0.8, 0.7),
        proxy: None,
    });
    scene
}

/// The torus's places, first and last; the middle of all mirrors is the same to the next unit.
fn mirror_places() -> [Similarity; 2] {
    let small = |place: Similarity| Similarity { scale: 0.4, ..place };
    [
        small(moved(DVec3::new(0.7, 0.5, 0.6))),
        small(turned(DVec3::new(1.0, 2.0, -0.5), 67.0, DVec3::new(-0.3, 0.75, 0.9))),
    ]
}

#[test]
fn a_moved_mirror_is_as_if_it_had_always_been_there() {
    let [first, last] = mirror_places();
    let mut moving = prepared(&two_mirrors(first), SURFELS);
    let fresh = prepared(&two_mirrors(last), SURFELS);
    assert_eq!(moving.origin, fresh.origin, "a coarser rounding would be no fault");
    let (builds, places) = (moving.tree_builds, moving.placement_version);
    let surfels = moving.surfels.clone();
    let pictures = |scene: &PreparedScene| {
        let triangles = rendered_with(scene, "c3rc", &[("cameras", "triangles")], 160, 90);
        [picture(scene), triangles.0, rendered(scene, "raytrace", 160, 90).0]
    };
    let before = pictures(&moving);
    moving.place_mirror(1, &last);
    let after = pictures(&moving);
    assert!(after == pictures(&fresh), "the path left a trace");
    for (after, before) in after.iter().zip(&before) {
        assert!(share_within(after, before, CLOSE) < 0.93, "the move is not seen");
    }
    assert_eq!(moving.tree_builds, builds);
    assert_ne!(moving.placement_version, places);
    assert!(moving.surfels.x == surfels.x && moving.surfels.radiance == surfels.radiance);

    for step in 1..20_u32 {
        let t = f64::from(step);
        moving.place_mirror(1, &turned(DVec3::new(1.0, t, 0.2), 40.0 * t, DVec3::new(t, 0.0, -t)));
    }
    moving.place_mirror(1, &first);
    assert!(pictures(&moving) == before, "to and fro is not as if it had stayed");
    assert_eq!(moving.mirror_clearance(), prepared(&two_mirrors(first), 100).mirror_clearance());
    assert_eq!(moving.tree_builds, builds);
}

#[test]
fn a_copy_goes_its_own_way() {
    let [first, last] = places();
    let mut own = prepared(&knot_near_a_ball(first), SURFELS);
    let before = picture(&own);
    let mut copy = own.clone();
    assert!(picture(&copy) == before);
    assert_eq!(copy.surfel_version, own.surfel_version, "the same surfels so far");
    copy.place(2, &last);
    copy.shade(&Context::default()).unwrap();
    assert!(picture(&own) == before, "the copy is moved, not what it was made of");
    own.place(2, &last);
    own.shade(&Context::default()).unwrap();
    assert_ne!(copy.surfel_version, own.surfel_version);
    assert!(picture(&copy) == picture(&own));
}
