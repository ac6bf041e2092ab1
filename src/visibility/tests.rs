//! Every sample is decided by the mathematics of rays and triangles, in f64 and without any sharing of code.

use fearless_simd::Level;
use glam::{DVec2, DVec3, Vec2, Vec3, dvec3, vec2, vec3};

use super::*;

/// Seeded SplitMix64: numbers in -1 to 1.
struct Random(u64);

impl Random {
    fn signed(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    fn point(&mut self) -> Vec3 {
        vec3(self.signed(), self.signed(), self.signed())
    }
}

/// Corners without sharing.
struct Soup {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Soup {
    fn new(corners: impl IntoIterator<Item = [Vec3; 3]>) -> Self {
        let positions: Vec<Vec3> = corners.into_iter().flatten().collect();
        let triangles =
            (0..).zip(positions.chunks(3)).map(|(t, _)| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        Self { positions, triangles }
    }

    fn mesh(&self) -> SurfaceMesh<'_> {
        SurfaceMesh { positions: &self.positions, triangles: &self.triangles, encloses: None }
    }
}

fn eye(from: [f64; 3], to: [f64; 3], width: u32, height: u32) -> Eye {
    let up = if from[0] == to[0] && from[2] == to[2] { DVec3::Z } else { DVec3::Y };
    Eye::new(from.into(), to.into(), up, 1.0, ImageSize { width, height }).unwrap()
}

fn seen(eye: &Eye, mirrors: &[SurfaceMesh], objects: &[SurfaceMesh]) -> Visibility {
    let mut out = Visibility::default();
    out.update(eye, mirrors, objects, &mut Scratch::default());
    out
}

fn sample_px(pixel: usize, sample: usize, width: u32) -> DVec2 {
    let [x, y] = SAMPLE_EIGHTHS[sample].map(|e| f64::from(e) / 8.0);
    DVec2::new((pixel % width as usize) as f64 + x, (pixel / width as usize) as f64 + y)
}

/// The point of the plane at distance 1 in front of the eye that shows at a picture position.
fn in_front(eye: &Eye, px: Vec2) -> Vec3 {
    eye.position + eye.ray_through_px(px)
}

/// Depth and id of the first two triangles along a view ray (Möller and Trumbore 1997, f64).
fn first_two(eye: &Eye, soup: &Soup, px: DVec2) -> [(f64, u32); 2] {
    let slope = (px - DVec2::new(f64::from(eye.size.width), f64::from(eye.size.height)) * 0.5)
        / f64::from(eye.focal_px);
    let ray = eye.forward.as_dvec3() + slope.x * eye.right.as_dvec3() - slope.y * eye.up.as_dvec3();
    let mut first = [(f64::INFINITY, NONE_ID); 2];
    for (t, id) in (0..soup.triangles.len()).zip(0..) {
        let [a, b, c] = soup.mesh().corners(t).map(|p| (p - eye.position).as_dvec3());
        let (ab, ac) = (b - a, c - a);
        let normal_part = ray.cross(ac);
        let determinant = ab.dot(normal_part);
        let u = (-a).dot(normal_part) / determinant;
        let v = ray.dot((-a).cross(ab)) / determinant;
        let depth = ac.dot((-a).cross(ab)) / determinant;
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && depth > 1e-5 {
            if depth < first[0].0 {
                first = [(depth, id), first[0]];
            } else if depth < first[1].0 {
                first[1] = (depth, id);
            }
        }
    }
    first
}

#[test]
fn samples_match_rays() {
    let mut random = Random(1);
    for (count, reach) in [(12, 3.0), (60, 1.0), (300, 0.3), (500, 0.06)] {
        // Around the eye as well as before it: many triangles cross the plane of the eye.
        let soup = Soup::new((0..count).map(|_| {
            let place = random.point() * 1.5;
            [0; 3].map(|_| place + random.point() * reach)
        }));
        let eye = eye([0.1, 0.2, 1.3], [0.0, 0.1, 0.0], 61, 41);
        let visibility = seen(&eye, &[soup.mesh()], &[]);
        let (mut doubtful, mut hits) = (0, 0);
        for (pixel, ids) in visibility.samples.iter().enumerate() {
            for (sample, &id) in ids.iter().enumerate() {
                let px = sample_px(pixel, sample, eye.size.width);
                let [first, second] = first_two(&eye, &soup, px);
                hits += usize::from(first.1 != NONE_ID);
                let near = [(1e-3, 0.0), (-1e-3, 0.0), (0.0, 1e-3), (0.0, -1e-3)];
                let at_edge = near
                    .iter()
                    .any(|&(x, y)| first_two(&eye, &soup, px + DVec2::new(x, y))[0].1 != first.1);
                if at_edge || second.0 < first.0 * (1.0 + 1e-5) {
                    doubtful += 1;
                    continue;
                }
                assert_eq!(id, first.1, "{px}, {first:?}, {second:?}");
                if sample == 0 && id != NONE_ID {
                    let depth = f64::from(visibility.mirror_depth[pixel]);
                    assert!((depth / first.0 - 1.0).abs() < 2e-3, "{px}: {depth} {first:?}");
                }
            }
        }
        let samples = visibility.samples.len() * SAMPLES;
        assert!(doubtful * 50 < samples, "{doubtful} of {samples}, {count} triangles");
        assert!(hits * 30 > samples, "{hits} of {samples}");
    }
}

/// A unit sphere by longitude and latitude.
fn sphere(center: Vec3, columns: u32, rows: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    use std::f32::consts::{PI, TAU};
    let mut positions = vec![center + Vec3::Y, center - Vec3::Y];
    for row in 1..rows {
        let (y, r) = ((PI * row as f32 / rows as f32).cos(), (PI * row as f32 / rows as f32).sin());
        positions.extend((0..columns).map(|c| {
            let angle = TAU * c as f32 / columns as f32;
            center + vec3(r * angle.cos(), y, r * angle.sin())
        }));
    }
    let at = |row: u32, column: u32| 2 + (row - 1) * columns + column % columns;
    let mut triangles = Vec::new();
    for c in 0..columns {
        triangles.push([0, at(1, c + 1), at(1, c)]);
        triangles.push([1, at(rows - 1, c), at(rows - 1, c + 1)]);
        for row in 1..rows - 1 {
            triangles.push([at(row, c), at(row, c + 1), at(row + 1, c + 1)]);
            triangles.push([at(row, c), at(row + 1, c + 1), at(row + 1, c)]);
        }
    }
    (positions, triangles)
}

#[test]
fn closed_meshes_have_no_cracks() {
    // A pole in the middle of a picture of odd size is a fan about a pixel's centre.
    for (columns, rows, from) in
        [(64, 32, [0.0, 3.0, 0.0]), (700, 400, [1.0, 2.0, 2.5]), (9, 5, [0.3, -3.0, 0.4])]
    {
        let (positions, triangles) = sphere(Vec3::ZERO, columns, rows);
        let mesh = SurfaceMesh { positions: &positions, triangles: &triangles, encloses: None };
        let eye = eye(from, [0.0; 3], 151, 101);
        let visibility = seen(&eye, &[], &[mesh]);
        let distance = DVec3::from(from).length();
        // The polygons reach to this part of the radius at least.
        let inner = (std::f64::consts::PI / f64::from(columns)).cos()
            * (std::f64::consts::PI / f64::from(2 * rows)).cos();
        let mut inside = 0;
        for (pixel, ids) in visibility.samples.iter().enumerate() {
            for (sample, &id) in ids.iter().enumerate() {
                let px = sample_px(pixel, sample, 151);
                let slope = (px - DVec2::new(75.5, 50.5)).length() / f64::from(eye.focal_px);
                let from_center = distance * slope / slope.hypot(1.0);
                if from_center < inner - 1e-3 {
                    inside += 1;
                    assert_ne!(id, NONE_ID, "a hole at {px}");
                } else if from_center > 1.0 + 1e-3 {
                    assert_eq!(id, NONE_ID, "a spot at {px}");
                }
            }
        }
        assert!(inside > 1000);
    }
}

#[test]
fn a_fan_hits_every_sample_once() {
    let eye = eye([0.0, 0.0, 1.0], [0.0; 3], 41, 41);
    // Hubs on a sample, on a pixel's corner and anywhere.
    for hub in [vec2(20.5, 20.5), vec2(18.375, 22.125), vec2(20.0, 21.0), vec2(19.77, 20.31)] {
        for blades in [3, 4, 7, 8, 24] {
            let rim = |i: usize| {
                let angle = std::f32::consts::TAU * (i % blades) as f32 / blades as f32;
                in_front(&eye, hub + 18.0 * Vec2::from_angle(angle))
            };
            let mut hits = vec![[0; SAMPLES]; eye.size.pixels()];
            for blade in 0..blades {
                let soup = Soup::new([[in_front(&eye, hub), rim(blade), rim(blade + 1)]]);
                for (hits, ids) in hits.iter_mut().zip(&seen(&eye, &[], &[soup.mesh()]).samples) {
                    for (hit, &id) in hits.iter_mut().zip(ids) {
                        *hit += u32::from(id != NONE_ID);
                    }
                }
            }
            for (pixel, hits) in hits.iter().enumerate() {
                for (sample, &hit) in hits.iter().enumerate() {
                    let px = sample_px(pixel, sample, 41);
                    let inside = px.distance(hub.as_dvec2()) < 8.9;
                    assert!(hit == 1 || (hit == 0 && !inside), "{hit} hits at {px}, hub {hub}");
                }
            }
        }
    }
}

#[test]
fn coverage_is_the_area() {
    let eye = eye([0.0, 0.0, 1.0], [0.0; 3], 120, 90);
    let middle = vec2(58.3, 44.1);
    let rim = |i| Vec2::from_angle(std::f32::consts::TAU * i as f32 / 500.0) * 40.0 + middle;
    let disk = Soup::new((0..500).map(|i| [middle, rim(i), rim(i + 1)].map(|p| in_front(&eye, p))));
    let corners = [vec2(3.0, 7.0), vec2(110.0, 30.0), vec2(40.0, 85.0)];
    let triangle = Soup::new([corners.map(|p| in_front(&eye, p))]);
    let area = 0.5 * (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
    for (soup, area) in [(disk, std::f32::consts::PI * 1600.0), (triangle, area)] {
        let visibility = seen(&eye, &[], &[soup.mesh()]);
        let hits = visibility.samples.iter().flatten().filter(|&&id| id != NONE_ID).count();
        let share = hits as f32 / SAMPLES as f32 / area;
        assert!((share - 1.0).abs() < 2e-3, "{share}");
    }
}

#[test]
fn ground_ends_at_the_horizon() {
    let far = 1e5;
    for cells in [1, 7] {
        let at = |i: u32| far * (2.0 * i as f32 / cells as f32 - 1.0);
        let corners: Vec<Vec3> =
            (0..=cells).flat_map(|z| (0..=cells).map(move |x| vec3(at(x), 0.0, at(z)))).collect();
        let mut triangles = Vec::new();
        for (z, x) in (0..cells).flat_map(|z| (0..cells).map(move |x| (z, x))) {
            let i = z * (cells + 1) + x;
            triangles.push([i, i + cells + 1, i + 1]);
            triangles.push([i + 1, i + cells + 1, i + cells + 2]);
        }
        let ground = SurfaceMesh { positions: &corners, triangles: &triangles, encloses: None };
        // The near plane is a millionth of the diagonal: 0.28.
        let eye = eye([0.3, 1.0, 0.7], [3.0, 1.0, -8.0], 160, 120);
        let visibility = seen(&eye, &[ground], &[]);
        for (pixel, ids) in visibility.samples.iter().enumerate() {
            for (sample, &id) in ids.iter().enumerate() {
                let px = sample_px(pixel, sample, 160);
                assert_eq!(id != NONE_ID, px.y > 60.0, "{px}");
            }
            let below = (pixel / 160) as f32 + 0.5 - 60.0;
            let depth = if below > 0.0 { eye.focal_px / below } else { f32::INFINITY };
            let found = visibility.mirror_depth[pixel];
            assert!(found == depth || (found / depth - 1.0).abs() < 1e-3, "{found} {depth}");
        }
    }
}

#[test]
fn equal_depth_goes_to_the_lower_id_and_nan_nowhere() {
    let eye = eye([0.0, 0.0, 1.0], [0.0; 3], 300, 200);
    let big = [vec3(-9.0, -9.0, 0.0), vec3(9.0, -9.0, 0.0), vec3(0.0, 9.0, 0.0)];
    let small = big.map(|p| p * 0.002);
    // Near the eye: if they were drawn, they would be seen.
    let broken = [vec3(f32::NAN, 0.0, 0.5), vec3(1.0, 0.0, 0.5), vec3(0.0, 1.0, 0.5)];
    let endless = [vec3(f32::INFINITY, 0.0, 0.5), vec3(-1.0, -1.0, 0.5), vec3(0.0, 1.0, 0.5)];
    let soup = Soup::new([broken, small, big, big, small, endless]);
    let visibility = seen(&eye, &[], &[soup.mesh()]);
    let ids: Vec<u32> = visibility.samples.iter().flatten().copied().collect();
    assert!(ids.iter().all(|&id| id == 1 || id == 2));
    assert!(ids.contains(&1) && ids.contains(&2));
    assert!(visibility.mirror_ids.iter().all(|&id| id == NONE_ID));
}

#[test]
fn same_bits_for_any_threads_and_instructions() {
    let (positions, triangles) = sphere(vec3(0.2, 0.1, 0.0), 300, 200);
    let mirror = SurfaceMesh { positions: &positions, triangles: &triangles, encloses: None };
    let mut random = Random(7);
    let soup = Soup::new((0..300).map(|i| {
        let place = random.point() * 3.0;
        [0; 3].map(|_| place + random.point() * if i == 0 { 30.0 } else { 0.3 })
    }));
    let eye = eye([0.4, 0.9, 2.6], [0.0; 3], 333, 222);
    let run = |threads: usize, level: Level| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (mut out, mut scratch) = (Visibility::default(), Scratch::new(level));
            // Reused memory must not show.
            out.update(&eye, &[soup.mesh()], &[mirror, mirror], &mut scratch);
            out.update(&eye, &[mirror], &[soup.mesh()], &mut scratch);
            out
        })
    };
    let one = run(1, Level::new());
    assert!(one.mirror_ids.iter().any(|&id| id != NONE_ID));
    assert_eq!(one, run(2, Level::new()));
    assert_eq!(one, run(3, Level::baseline()));
    assert_eq!(one, seen(&eye, &[mirror], &[soup.mesh()]));
}

#[test]
fn ids_are_located() {
    let mut random = Random(3);
    let [two, none, three] =
        [2, 0, 3].map(|n| Soup::new((0..n).map(|_| [0; 3].map(|_| random.point()))));
    let eye = eye([0.0, 0.0, 3.0], [0.0; 3], 8, 8);
    let visibility =
        seen(&eye, &[none.mesh(), two.mesh()], &[none.mesh(), three.mesh(), none.mesh()]);
    let places = [0, 1, 2, 3, 4, 5, NONE_ID].map(|id| visibility.locate(id));
    let expected = [(1, 0), (1, 1), (3, 0), (3, 1), (3, 2)].map(Some);
    assert_eq!(places[..5], expected);
    assert_eq!(places[5..], [None, None]);
    assert_eq!((visibility.mirrors(), visibility.mirror_triangles()), (2, 2));
    assert_eq!(visibility.ids(3), 2..5);
    assert_eq!(Visibility::default().locate(0), None);
}

#[test]
fn weights_give_the_point_on_the_ray() {
    let mut random = Random(11);
    let eye = eye([0.1, 0.2, 2.0], [0.0; 3], 640, 480);
    let mut behind = 0;
    for _ in 0..2000 {
        let corners = [0; 3].map(|_| random.point() * 1.5);
        let given = [0; 3].map(|_| random.signed() + 0.5);
        let sum: f32 = given.iter().sum();
        if sum.abs() < 0.1 {
            continue;
        }
        let given = given.map(|w| w / sum);
        let point: Vec3 = corners.iter().zip(given).map(|(&c, w)| c * w).sum();
        let Some(px) = eye.project_px(point) else { continue };
        let view = dvec3(0.1, 0.2, 2.0) - corners[0].as_dvec3();
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).as_dvec3();
        if view.dot(normal).abs() < 0.1 * normal.length() {
            continue;
        }
        match barycentrics(&eye, corners, px) {
            Some(found) => {
                let place: Vec3 = corners.iter().zip(found).map(|(&c, w)| c * w).sum();
                let scale = point.distance(eye.position).max(1.0);
                assert!(place.distance(point) < 1e-3 * scale * scale, "{point} {place}");
            }
            None => behind += 1,
        }
    }
    assert_eq!(behind, 0);
    let past = [vec3(0.0, 0.0, 5.0), vec3(1.0, 0.0, 5.0), vec3(0.0, 1.0, 5.0)];
    assert_eq!(barycentrics(&eye, past, vec2(320.0, 240.0)), None);
}

#[test]
fn backs_of_what_encloses_something_are_left_out_from_outside_only() {
    let (positions, triangles) = sphere(Vec3::ZERO, 24, 12);
    let surface = |encloses| SurfaceMesh { positions: &positions, triangles: &triangles, encloses };
    let outside = eye([0.0, 0.4, 3.0], [0.0, 0.0, 0.0], 60, 40);
    let inside = eye([0.0, 0.1, 0.2], [0.3, 0.0, 1.0], 60, 40);
    let held = Some(Aabb::of(positions.iter().copied()));
    for eye in [&outside, &inside] {
        let all = seen(eye, &[], &[surface(None)]);
        assert!(all.samples.iter().flatten().any(|id| *id != NONE_ID));
        assert_eq!(seen(eye, &[], &[surface(held)]).samples, all.samples);
    }
    // Its backs alone are nothing to see from outside.
    let back = |t: &&[u32; 3]| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        (b - a).cross(c - a).dot(outside.position - a) < 0.0
    };
    let backs: Vec<[u32; 3]> = triangles.iter().filter(back).copied().collect();
    let shown = |encloses| {
        let surface = SurfaceMesh { positions: &positions, triangles: &backs, encloses };
        seen(&outside, &[], &[surface])
            .samples
            .iter()
            .flatten()
            .filter(|id| **id != NONE_ID)
            .count()
    };
    assert!(shown(None) > 100);
    assert_eq!(shown(held), 0);
}
