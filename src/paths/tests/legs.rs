//! What hides paths.

use super::*;
use crate::scene::description::{Object, Paint};

fn object(name: &str, translation: DVec3, scale: f64) -> Object {
    Object {
        name: name.into(),
        mesh: Arc::new(builtin::shape(name, None).unwrap()),
        source: None,
        points: None,
        transform: Similarity { translation, scale, ..Similarity::IDENTITY },
        paint: Paint::Constant(glam::Vec3::ONE),
        density: 1.0,
    }
}

fn legs(scene: &Scene, points: &[DVec3]) -> Vec<Vec<[Occluder; 2]>> {
    let paths = PathScene::new(scene);
    let finder = finder(&paths, RayScale::EyeDistance);
    let set = finder.find(points, &Context::default()).unwrap();
    let list = |i| set.of(i).iter().map(|p| [p.eye_leg, p.point_leg]).collect();
    (0..points.len()).map(list).collect()
}

#[test]
fn objects_hide_the_leg_that_they_stand_in() {
    use Occluder::{None, Object};
    let place =
        Similarity { translation: DVec3::new(0.0, -2.0, 0.0), scale: 4.0, ..Similarity::IDENTITY };
    let mut plain = scene(&[("plane", 8, place)]);
    let point = DVec3::new(-0.9, -0.4, 2.0);
    // Where the plane z = 0 reflects it.
    let p = EYE + (point * DVec3::new(1.0, 1.0, -1.0) - EYE) * (EYE.z / (EYE.z + point.z));
    assert_eq!(legs(&plain, &[point]), [[[None, None]]]);
    for (at, expected) in [
        (EYE.lerp(p, 0.5), [Object, None]),
        (p.lerp(point, 0.5), [None, Object]),
        (EYE + DVec3::Y, [None, None]),
        // Behind the mirror, and beyond the point.
        (p - DVec3::Z, [None, None]),
        (p + (point - p) * 1.4, [None, None]),
    ] {
        plain.objects = vec![object("cube", at - DVec3::Y * 0.05, 0.1)];
        assert_eq!(legs(&plain, &[point]), [[expected]], "{at}");
    }
    // A point on an object is not hidden by it.
    plain.objects = vec![object("plane", point - DVec3::Y * 0.5, 1.0)];
    assert_eq!(legs(&plain, &[point]), [[[None, None]]]);
}

#[test]
fn mirrors_hide_paths_by_themselves_and_each_other() {
    use Occluder::{Mirror, None};
    let place =
        Similarity { translation: DVec3::new(0.0, -2.0, 0.0), scale: 4.0, ..Similarity::IDENTITY };
    let point = DVec3::new(-0.9, -0.4, 2.0);
    let p = EYE + (point * DVec3::new(1.0, 1.0, -1.0) - EYE) * (EYE.z / (EYE.z + point.z));
    for (at, expected) in [(EYE.lerp(p, 0.5), [Mirror, None]), (p.lerp(point, 0.5), [None, Mirror])]
    {
        let small = Similarity { translation: at, scale: 0.1, ..Similarity::IDENTITY };
        let both = scene(&[("plane", 8, place), ("sphere", 200, small)]);
        let paths = PathScene::new(&both);
        let finder = finder(&paths, RayScale::EyeDistance);
        let set = finder.find(&[point], &Context::default()).unwrap();
        let of_plane: Vec<&Path> = set.of(0).iter().filter(|p| p.mirror == 0).collect();
        let [path] = of_plane[..] else { panic!("{of_plane:?}") };
        assert_eq!([path.eye_leg, path.point_leg], expected, "{at}");
        assert!(path.is_occluded());
    }
    // A sphere hides none of its own paths from outside, but for what its facets do near its silhouette; a torus does.
    let mut random = Random::new(1);
    let points: Vec<DVec3> = (0..2_000).map(|_| random.point(3.0)).collect();
    let hidden = |name: &str, points: &[DVec3]| {
        let all = legs(&scene(&[(name, 4_000, Similarity::IDENTITY)]), points);
        let all: Vec<_> = all.into_iter().flatten().collect();
        let count = all.iter().filter(|legs| **legs != [None, None]).count();
        (count, all.len())
    };
    let outside: Vec<DVec3> = points.iter().filter(|p| p.length() > 1.1).copied().collect();
    let (count, all) = hidden("sphere", &outside);
    assert!(count * 100 < all && all > 1_000, "{count} of {all}");
    let (count, all) = hidden("torus", &points);
    assert!(count * 10 > all && count < all, "{count} of {all}");
}

#[test]
fn without_occlusion_nothing_is_looked_up() {
    let scene = shape("torus", 500);
    let options = PathOptions { occlusion: false, ..PathOptions::default() };
    let finder = PathFinder::new(&scene, EYE, options).unwrap();
    let mut random = Random::new(1);
    let points: Vec<DVec3> = (0..500).map(|_| random.point(3.0)).collect();
    let set = finder.find(&points, &Context::default()).unwrap();
    assert!((0..500).flat_map(|i| set.of(i)).all(|p| !p.is_occluded()));
}
