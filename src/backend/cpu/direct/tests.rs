//! Flat triangles before a plain sky.

use glam::{DVec3, Vec2, vec2, vec3};

use super::*;
use crate::camera::eye::ImageSize;
use crate::visibility::{NONE_ID, Scratch};

const SIZE: ImageSize = ImageSize { width: 24, height: 16 };
const SUN: f32 = 50.0;

/// Objects show their position, lit by a bright light; the sky shows its direction.
struct Plain;

impl Appearance for Plain {
    fn albedo(&self, hit: &Hit) -> Vec3 {
        hit.point.abs()
    }
    fn light(&self, _: &Hit) -> Vec3 {
        Vec3::splat(SUN)
    }
    fn sky(&self, direction: Vec3) -> Vec3 {
        direction.max(Vec3::ZERO)
    }
    fn tint(&self, _: usize) -> Vec3 {
        vec3(0.5, 0.25, 0.125)
    }
}

fn eye() -> Eye {
    Eye::new(DVec3::Z, DVec3::ZERO, DVec3::Y, 1.0, SIZE).unwrap()
}

fn composed(
    mirror: Option<[Vec3; 3]>,
    object: Option<[Vec3; 3]>,
    reflection: Vec3,
    white: f32,
) -> (Visibility, Vec<Vec3>) {
    let eye = eye();
    let mesh = |corners: &Option<[Vec3; 3]>| corners.map(|c| c.to_vec()).unwrap_or_default();
    let (mirror_points, object_points) = (mesh(&mirror), mesh(&object));
    let of =
        |points: &[Vec3]| -> &[[u32; 3]] { if points.is_empty() { &[] } else { &[[0, 1, 2]] } };
    let mirrors =
        [SurfaceMesh { positions: &mirror_points, triangles: of(&mirror_points), encloses: None }];
    let objects =
        [SurfaceMesh { positions: &object_points, triangles: of(&object_points), encloses: None }];
    let mut visibility = Visibility::default();
    visibility.update(&eye, &mirrors, &objects, &mut Scratch::default());
    let reflected: Vec<Vec3> = visibility
        .mirror_ids
        .iter()
        .map(|&id| if id == NONE_ID { Vec3::NAN } else { reflection })
        .collect();
    let view = DirectView {
        eye: &eye,
        mirrors: &mirrors,
        objects: &objects,
        visibility: &visibility,
        reflection: &reflected,
        white,
    };
    let mut out = vec![[0.0; 3]; SIZE.pixels()];
    compose(&view, &Plain, &mut out);
    (visibility, out.into_iter().map(Vec3::from).collect())
}

/// On the plane z = 0, as seen at these picture positions.
fn at(px: [Vec2; 3]) -> [Vec3; 3] {
    px.map(|p| eye().position + eye().ray_through_px(p))
}

const HALF: [Vec2; 3] = [vec2(-30.0, -9.0), vec2(40.0, 7.0), vec2(-20.0, 60.0)];

#[test]
fn edges_are_shares_of_display_values() {
    // The object lies at z = -9, so that it is white in z, where the sky is black.
    let far = at(HALF).map(|p| DVec3::Z.as_vec3() + (p - DVec3::Z.as_vec3()) * 10.0);
    let (visibility, out) = composed(None, Some(far), Vec3::ZERO, 1.0);
    let mut partial = 0;
    for (ids, value) in visibility.samples.iter().zip(&out) {
        let share = ids.iter().filter(|&&id| id == 0).count() as f32 / SAMPLES as f32;
        partial += usize::from(share > 0.0 && share < 1.0);
        assert!((value.z - share).abs() < 1e-6, "{value} {share}");
    }
    assert!(partial > 5, "{partial}");
}

#[test]
fn objects_show_the_point_on_the_ray() {
    let (visibility, out) = composed(None, Some(at(HALF)), Vec3::ZERO, f32::INFINITY);
    let mut inside = 0;
    for (pixel, (ids, value)) in visibility.samples.iter().zip(&out).enumerate() {
        if *ids == [0; SAMPLES] {
            let px = vec2((pixel % 24) as f32 + 0.5, (pixel / 24) as f32 + 0.5);
            let point = eye().position + eye().ray_through_px(px);
            // The mean of |x| over a symmetric pattern, where no axis crosses the pixel.
            let point = point.abs() * SUN;
            assert!(value.abs_diff_eq(point, 2e-3 * SUN / 2.0), "{px}: {value} {point}");
            inside += 1;
        }
    }
    assert!(inside > 50);
}

#[test]
fn mirrors_show_their_own_or_their_neighbours_reflection() {
    let tone = vec3(0.2, 0.3, 0.4);
    let (visibility, out) = composed(Some(at(HALF)), None, tone, 1.0);
    let (mut own, mut borrowed) = (0, 0);
    for (pixel, (ids, value)) in visibility.samples.iter().zip(&out).enumerate() {
        let share = ids.iter().filter(|&&id| id == 0).count() as f32 / SAMPLES as f32;
        if visibility.mirror_ids[pixel] == 0 {
            own += 1;
        } else if share > 0.0 {
            borrowed += 1;
        }
        // In z the sky is black.
        assert!((value.z - 0.4 * share).abs() < 1e-6, "{value} {share}");
    }
    assert!(own > 50 && borrowed > 2, "{own} {borrowed}");
}

#[test]
fn a_lone_mirror_sample_reflects_the_sky() {
    // Over the sample (3, 1)/8 of pixel (5, 5) only, and tilted: it sends the view upwards and left.
    let [a, b, c] = at([vec2(5.3, 5.05), vec2(5.45, 5.05), vec2(5.375, 5.2)]);
    let tilted = [a, b, c - (c - eye().position) * 0.01];
    let (visibility, out) = composed(Some(tilted), None, Vec3::ZERO, 1.0);
    assert_eq!(visibility.samples[5 * 24 + 5], [NONE_ID, 0, NONE_ID, NONE_ID, NONE_ID]);
    let px = vec2(5.375, 5.125);
    let view = eye().ray_through_px(px).normalize_or(Vec3::ZERO);
    let normal = (tilted[1] - tilted[0]).cross(tilted[2] - tilted[0]).normalize_or(Vec3::ZERO);
    let mirrored = Plain.sky(view.reflect(normal)) * vec3(0.5, 0.25, 0.125);
    assert!(mirrored.z > 0.1 || mirrored.y > 0.1 || mirrored.x > 0.1);
    let others = [vec2(4.0, 4.0), vec2(7.0, 3.0), vec2(5.0, 7.0), vec2(1.0, 5.0)];
    let middle = others.iter().sum::<Vec2>() / 32.0;
    let sky = eye().ray_through_px(vec2(5.0, 5.0) + middle).normalize_or(Vec3::ZERO);
    let expected = (mirrored + Plain.sky(sky) * 4.0) / 5.0;
    let found = out[5 * 24 + 5];
    assert!(found.abs_diff_eq(expected, 1e-5), "{found} {expected}");
}
