//! The map against the rays.

use std::sync::Arc;

use glam::{DQuat, DVec3, Vec3};

use super::{Caster, SunMap};
use crate::accel::TriangleBvh;
use crate::accel::triangle_bvh::tests::Random;
use crate::geometry::{Mesh, Similarity};
use crate::scene::builtin;
use crate::scene::description::Light;
use crate::scene::shade::{Sun, SurfacePoint};

struct Thing {
    mesh: Arc<Mesh>,
    transform: Similarity,
    positions: Vec<Vec3>,
}

fn thing(name: &str, triangles: usize, at: [f64; 3], turn: f64, scale: f64) -> Thing {
    let mesh = Arc::new(builtin::shape(name, Some(triangles)).expect("it is built in"));
    let rotation = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), turn);
    let transform = Similarity { rotation, translation: at.into(), scale };
    let place = |p: &Vec3| transform.point(p.as_dvec3()).as_vec3();
    let positions = mesh.positions().iter().map(place).collect();
    Thing { mesh, transform, positions }
}

/// Fine, coarse and thin things over a floor and each other, none of them inside of another, and an open one.
fn things() -> Vec<Thing> {
    vec![
        thing("ground", 2, [0.0; 3], 0.0, 3.0),
        thing("ground", 2, [3.0, 0.0, 0.0], 0.0, 3.0),
        thing("sphere", 20_000, [0.5, 0.4, 0.0], 0.3, 0.4),
        thing("sphere", 200, [-0.6, 0.5, 0.6], 0.0, 0.3),
        thing("knot", 8_000, [-0.9, 1.1, -0.7], 0.5, 0.4),
        thing("torus", 3_000, [0.9, 0.5, 0.8], 1.0, 0.2),
        thing("cube", 12, [0.1, 0.3, 0.9], 0.0, 0.3),
        thing("cylinder", 400, [-0.2, 1.5, -0.2], 0.9, 0.2),
        thing("plane", 2, [0.3, 0.7, -0.9], 0.2, 0.4),
    ]
}

struct Made {
    bvh: TriangleBvh,
    light: Light,
    map: SunMap,
}

fn made(things: &[Thing], to_sun: Vec3) -> Made {
    let to_sun = to_sun.normalize_or(Vec3::Y);
    let light = Light { to_sun, sun: Vec3::ONE, ambient: Vec3::ZERO };
    let corners = |t: &Thing| -> Vec<[Vec3; 3]> {
        t.mesh.triangles().iter().map(|t2| t2.map(|i| t.positions[i as usize])).collect()
    };
    let bvh = TriangleBvh::build(&things.iter().flat_map(corners).collect::<Vec<_>>());
    let edges: Vec<_> = things.iter().map(|t| t.mesh.shared_edges()).collect();
    let casters: Vec<Caster> = things
        .iter()
        .zip(&edges)
        .map(|(t, edges)| Caster {
            positions: &t.positions,
            triangles: t.mesh.triangles(),
            edges,
            closed: t.mesh.is_closed_outward(),
        })
        .collect();
    let map = SunMap::new(&casters, to_sun, Sun::new(&bvh, &light).apart);
    Made { bvh, light, map }
}

/// How many points that face the sun the map leaves to the rays, decides rightly and decides wrongly, by whether they are
/// lit.
fn verdicts(things: &[Thing], made: &Made) -> (usize, [usize; 2], [usize; 2]) {
    let sun = Sun::new(&made.bvh, &made.light);
    let mut random = Random(7);
    let (mut open, mut right, mut wrong) = (0, [0; 2], [0; 2]);
    for thing in things {
        let triangles = thing.mesh.triangles();
        for _ in 0..20_000 {
            let mut pick = || random.unit();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
            let triangle = ((pick() * triangles.len() as f32) as usize).min(triangles.len() - 1);
            let (u, v) = (pick(), pick());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let weights = [1.0 - u - v, u, v];
            let mix = |list: &[Vec3]| -> Vec3 {
                (0..3).map(|k| list[triangles[triangle][k] as usize] * weights[k]).sum()
            };
            let position = mix(&thing.positions);
            let normal = mix(thing.mesh.normals()).as_dvec3();
            let normal = thing.transform.direction(normal).as_vec3().normalize_or(Vec3::Y);
            let facing = normal.dot(made.light.to_sun);
            if facing <= 0.0 {
                continue;
            }
            let lit = sun.visible_from(&SurfacePoint { position, normal, extent: 0.0 });
            match made.map.lights_point(position, facing) {
                None => open += 1,
                Some(said) if said == lit => right[usize::from(lit)] += 1,
                Some(_) => wrong[usize::from(lit)] += 1,
            }
        }
    }
    (open, right, wrong)
}

const SUNS: [Vec3; 4] =
    [Vec3::new(-0.75, 0.63, 0.14), Vec3::new(0.1, 1.0, -0.2), Vec3::new(1.0, 0.15, 0.3), Vec3::Y];

#[test]
fn what_the_map_says_the_rays_say() {
    let things = things();
    for to_sun in SUNS {
        let (open, right, wrong) = verdicts(&things, &made(&things, to_sun));
        assert_eq!(wrong, [0, 0], "of {right:?}, sun {to_sun}");
        assert!(right[0] > 2_000 && right[1] > 20_000, "{right:?}, sun {to_sun}");
        // The open plane among them is always left to the rays.
        assert!(open * 3 < right[0] + right[1], "{open} are left of {right:?}, sun {to_sun}");
    }
}

#[test]
fn without_outlines_it_would_be_wrong() {
    let things = things();
    let mut made = made(&things, SUNS[0]);
    for texel in &mut made.map.texels {
        // Where anything stands at all.
        texel.cover = texel.top;
    }
    assert!(verdicts(&things, &made).2[1] > 20);
}

#[test]
fn without_bounds_over_texels_it_would_be_wrong() {
    let things = things();
    let mut made = made(&things, SUNS[0]);
    for texel in &mut made.map.texels {
        texel.top -= 40.0 * made.map.unit;
    }
    assert!(verdicts(&things, &made).2[0] > 20);
}

#[test]
fn the_inside_of_something_closed_is_left_to_the_rays() {
    let things = [thing("sphere", 20_000, [0.0; 3], 0.0, 1.0)];
    let made = made(&things, Vec3::Y);
    assert_eq!(made.map.lights_point(Vec3::ZERO, 1.0), None);
    assert_eq!(made.map.lights_point(Vec3::Y * 2.0, 1.0), Some(true));
    assert_eq!(made.map.lights_point(Vec3::Y * -2.0, 1.0), Some(false));
    assert_eq!(made.map.lights_point(Vec3::X * 2.0, 1.0), Some(true));
}

#[test]
fn what_is_behind_a_floor_is_left_to_the_rays() {
    let things = [thing("ground", 2, [0.0; 3], 0.0, 6.0), thing("sphere", 200, [0.0; 3], 0.0, 0.5)];
    let made = made(&things, Vec3::Y);
    assert_eq!(made.map.lights_point(Vec3::new(2.0, -0.1, 0.0), 1.0), None);
    assert_eq!(made.map.lights_point(Vec3::new(2.0, 0.0, 0.0), 1.0), Some(true));
    assert_eq!(made.map.lights_point(Vec3::new(0.0, 0.6, 0.0), 1.0), Some(true));
}

#[test]
fn nothing_shades_nothing() {
    assert_eq!(SunMap::default().lights_point(Vec3::ONE, 0.5), Some(true));
    let floor = [thing("ground", 2, [0.0; 3], 0.0, 6.0)];
    assert_eq!(made(&floor, SUNS[0]).map.lights_point(Vec3::ZERO, 0.5), Some(true));
}
