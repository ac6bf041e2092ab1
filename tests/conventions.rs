//! Handedness, winding and the order of pixels: what `src/lib.rs` promises, and that the whole pipeline
//! agrees with it.

use catoptric::Context;
use catoptric::camera::Eye;
use catoptric::camera::eye::ImageSize;
use catoptric::frame::Renderer;
use catoptric::geometry::Mesh;
use catoptric::image::NONE;
use catoptric::methods::{Params, method};
use catoptric::scene::description::{Environment, EyeDescription};
use catoptric::scene::{GivenSurfels, PreparedScene, builtin};
use catoptric::visibility::{NONE_ID, Scratch, SurfaceMesh, Visibility};
use glam::{DVec3, Vec2, Vec3};

const SIZE: ImageSize = ImageSize { width: 160, height: 90 };
/// The eye looks along -z from here.
const EYE: EyeDescription = EyeDescription {
    position: DVec3::new(0.0, 0.0, 5.0),
    target: DVec3::ZERO,
    up: DVec3::Y,
    fov_y: 0.8,
};

fn eye() -> Eye {
    Eye::new(EYE.position, EYE.target, EYE.up, EYE.fov_y, SIZE).expect("a view")
}

#[test]
fn an_eye_along_minus_z_has_x_to_its_right() {
    let eye = eye();
    assert_eq!((eye.right, eye.up, eye.forward), (Vec3::X, Vec3::Y, Vec3::NEG_Z));
    assert_eq!(eye.right.cross(eye.up), -eye.forward, "right-handed");
}

#[test]
fn pixel_0_0_is_at_the_top_left() {
    let eye = eye();
    let first = eye.ray_through_px(Vec2::splat(0.5));
    assert!(first.x < 0.0 && first.y > 0.0 && first.z < 0.0, "{first}");
    let middle = eye.project_px(Vec3::ZERO).expect("in front");
    assert_eq!(middle, Vec2::new(80.0, 45.0));
    let right_and_up = eye.project_px(Vec3::new(0.1, 0.1, 0.0)).expect("in front");
    assert!(right_and_up.x > middle.x && right_and_up.y < middle.y, "{right_and_up}");

    // A mirror in the corner to the left and up is seen in the first pixel, and not in the last ones.
    let corner = [Vec3::new(-9.0, -4.0, 0.0), Vec3::new(4.0, 9.0, 0.0), Vec3::new(-9.0, 9.0, 0.0)];
    let mirror = SurfaceMesh { positions: &corner, triangles: &[[0, 1, 2]], encloses: None };
    let mut seen = Visibility::default();
    seen.update(&eye, &[mirror], &[], &mut Scratch::default());
    let id = |x: u32, y: u32| seen.mirror_ids[(y * SIZE.width + x) as usize];
    assert_eq!([id(0, 0), id(159, 0), id(0, 89), id(159, 89)], [0, NONE_ID, NONE_ID, NONE_ID]);
}

#[test]
fn counter_clockwise_triangles_have_normals_towards_the_viewer() {
    let eye = eye();
    let positions = vec![Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.3), Vec3::Y];
    for (triangle, towards) in [([0, 1, 2], true), ([0, 2, 1], false)] {
        let mesh = Mesh::new(positions.clone(), vec![], vec![], vec![triangle]).expect("a mesh");
        let [a, b, c] = mesh.corners(0).map(|p| eye.project_px(p).expect("in front"));
        // In the picture y runs downward: what turns counter-clockwise has a negative area there.
        let counter_clockwise = (b - a).perp_dot(c - a) < 0.0;
        assert_eq!(counter_clockwise, towards);
        for (position, normal) in mesh.positions().iter().zip(mesh.normals()) {
            assert_eq!(normal.dot(eye.position - position) > 0.0, towards);
        }
    }
}

#[test]
fn built_in_shapes_wind_as_their_normals_point() {
    for name in builtin::SHAPES {
        let mesh = builtin::shape(name, None).expect("built in");
        for (t, triangle) in mesh.triangles().iter().enumerate() {
            let [a, b, c] = mesh.corners(t);
            let normal: Vec3 = triangle.iter().map(|&i| mesh.normals()[i as usize]).sum();
            assert!((b - a).cross(c - a).dot(normal) >= 0.0, "{name}, triangle {t}");
        }
    }
}

/// A mirror in the plane z = 0 that faces the eye, and a patch of surfels before it, to the right and up.
#[test]
fn a_reflection_lies_where_a_mirror_puts_it() {
    let far = 3.0;
    let corners =
        [(-far, -far), (far, -far), (far, far), (-far, far)].map(|(x, y)| Vec3::new(x, y, 0.0));
    let mirror =
        Mesh::new(corners.to_vec(), vec![], vec![], vec![[0, 1, 2], [0, 2, 3]]).expect("a mesh");
    let height = 1.0;
    let center = Vec3::new(0.8, 0.5, height);
    let offset = |i: u16| (f32::from(i) - 24.5) * 0.01;
    let square = |i: u16| center + Vec3::new(offset(i % 50), offset(i / 50), 0.0);
    let positions: Vec<Vec3> = (0..2500).map(square).collect();
    let radiance = Vec3::new(0.5, 0.25, 0.125);
    let surfels = GivenSurfels {
        positions: &positions,
        normals: &vec![Vec3::NEG_Z; 2500],
        radiance: &vec![radiance; 2500],
    };
    let black = Environment::Constant(Vec3::ZERO);
    let scene = PreparedScene::from_surfels(mirror, surfels, EYE, black).expect("a scene");
    let eye = scene.eye_for(SIZE).expect("a view");
    let mut renderer = Renderer::new();
    let c3rc = method("c3rc").expect("it is in the registry");
    let params = Params::defaults(c3rc.info().params);
    renderer.render(&scene, &eye, c3rc, &params, true, &Context::default()).expect("a frame");
    let planes = renderer.planes().expect("asked for");

    // The mirrored square, as the eye would see it without the mirror.
    let image = eye.project_px(center * Vec3::new(1.0, 1.0, -1.0)).expect("in front");
    assert!(image.x > 80.0 && image.y < 45.0, "to the right and up: {image}");
    let half_px = 0.25 * eye.focal_px / (5.0 + height);
    for y in 0..SIZE.height {
        for x in 0..SIZE.width {
            let off = (Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - image).abs().max_element();
            let i = (y * SIZE.width + x) as usize;
            if off < half_px - 1.0 {
                assert_eq!(planes.object[i], 0, "({x}, {y})");
                // A mean of equal numbers, but for rounding.
                let off = (Vec3::from_array(renderer.picture().rgb[i]) - radiance).abs();
                assert!(off.max_element() < 1e-6, "({x}, {y})");
                // With rays as long as the distance to the eye, λ is the ratio of the two distances.
                assert!((planes.lambda[i] - height / 5.0).abs() < 1e-5, "{}", planes.lambda[i]);
            } else if off > half_px + 2.0 {
                assert_eq!(planes.object[i], NONE, "({x}, {y})");
                assert_eq!(renderer.picture().rgb[i], [0.0; 3], "({x}, {y})");
            }
        }
    }
}
