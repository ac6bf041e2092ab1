//! Projection and footprint in WGSL, in f32 and in f64. Neither of the first two is the other's measure.

use glam::{DVec2, DVec3, Vec3};

use super::super::records::{CHUNK, Frame, LAYOUT, Row};
use super::super::scene::packed_half;
use super::super::shaders;
use super::{device, run};
use crate::camera::RayScale;
use crate::camera::three_ray::multiplicity::Jacobian;
use crate::camera::three_ray::tests::Numbers;
use crate::camera::three_ray::{Rays, ThreeRay, project};
use crate::geometry::lanes::{Real, Scalar};
use crate::geometry::look::packed_normal;
use crate::plan::{SplatShape, kernel};

/// What the GPU's error may be, over f32's or its precision, whichever is larger.
const TIMES: f64 = 4.0;
/// λ that points are looked for in.
const RANGE: [f32; 2] = [-1e-5, 10.0];

/// A point and a camera, both as exact as they were meant to be, and the set that they belong to.
struct Case {
    set: usize,
    rays: Rays,
    place: Vec3,
    /// See [`ThreeRay::disk`].
    disk: f64,
}

/// Share of each set whose number of images may be off: those near an edge, the base or a double root.
const SETS: [(&str, f64); 8] = [
    ("random", 0.01),
    ("near-double roots", 0.6),
    ("flat", 0.01),
    ("nearly flat", 0.01),
    ("shared edges", 0.02),
    ("base", 0.6),
    ("grazing", 0.02),
    ("far from the origin", 0.02),
];

fn cases(count: usize) -> Vec<Case> {
    let mut numbers = Numbers(7);
    let mut list = Vec::new();
    for i in 0..count {
        let set = if i % 2 == 0 { 0 } else { 1 + i / 2 % (SETS.len() - 1) };
        let scale = if i % 4 < 2 { RayScale::EyeDistance } else { RayScale::Unit };
        let edge = numbers.between(0.02, 0.5);
        let mut rays = numbers.camera(edge, scale);
        let mut w = numbers.weights();
        let mut lambda = numbers.between(0.0, 3.0);
        match SETS[set].0 {
            "near-double roots" => {
                // Where T(λ) has no area at w: two images meet.
                let [a, b, c] = [0, 1, 2].map(|k| {
                    let of = Jacobian::of(&rays).g.map(|q| q[k]);
                    DVec3::from_array(of).dot(w)
                });
                let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
                let at = [(-b - root) / (2.0 * c), (-b + root) / (2.0 * c)];
                lambda = at.into_iter().find(|l| (0.0..9.0).contains(l)).unwrap_or(lambda);
                lambda *= 1.0 + numbers.between(-1e-5, 1e-5);
            }
            "flat" | "nearly flat" => {
                let eye = DVec3::new(numbers.between(-2.0, 2.0), numbers.between(-2.0, 2.0), 2.0);
                let bend = if SETS[set].0 == "flat" { 0.0 } else { 1e-6 };
                let flat = rays.origins.map(|v| DVec3::new(v.x, v.y, 0.0));
                let direction = |v: DVec3| {
                    let d = v - eye;
                    DVec3::new(d.x, d.y, -d.z) + v * bend
                };
                rays = Rays { origins: flat, directions: flat.map(direction) };
            }
            "shared edges" => w = DVec3::new(w.x + w.z, w.y, 0.0),
            "base" => lambda = numbers.between(-1e-6, 1e-6),
            "grazing" => {
                rays.directions = rays.directions.map(|d| DVec3::new(d.x, d.y, d.z * 0.02))
            }
            "far from the origin" => {
                rays.origins = rays.origins.map(|v| v + DVec3::new(900.0, -400.0, 100.0));
            }
            _ => {}
        }
        let (v, d) = rays.at(w);
        // One of ten is a point that nothing is known of.
        let off = if i % 10 == 9 { numbers.point() } else { DVec3::ZERO };
        list.push(Case { set, rays, place: (v + d * lambda + off).as_vec3(), disk: 0.0 });
    }
    list
}

/// λ, b2, b3.
type Found = Vec<[f64; 3]>;

fn images<T: Scalar + Real<Scalar = T, Mask = bool>>(case: &Case) -> Found {
    let disk = T::from_f64(case.disk);
    let camera = ThreeRay::<T> { disk, ..ThreeRay::new(&case.rays, &case.rays) };
    let place = case.place.to_array().map(|v| T::from_f64(f64::from(v)));
    let q = [0, 1, 2].map(|k| place[k] - camera.v1[k]);
    let [lo, hi] = RANGE.map(|v| T::from_f64(f64::from(v)));
    let list = project(&camera, q, lo, hi);
    let within = list.as_slice().iter().filter(|i| i.within([T::from_f64(1e-3); 3]));
    within.map(|i| [i.lambda, i.b2, i.b3].map(Scalar::to_f64)).collect()
}

/// How far an image's ray passes by the point.
fn residual(case: &Case, [lambda, b2, b3]: [f64; 3]) -> f64 {
    let (v, d) = case.rays.at(DVec3::new(1.0 - b2 - b3, b2, b3));
    (v + d * lambda - case.place.as_dvec3()).length()
}

/// Largest coordinate.
fn size(case: &Case) -> f64 {
    let origins = case.rays.origins.iter().map(|v| v.abs().max_element());
    origins.fold(f64::from(case.place.abs().max_element()), f64::max).max(1.0)
}

/// Every case's images by the shader.
fn by_shader(cases: &[Case], change: impl Fn(String) -> String) -> Option<Vec<Found>> {
    const ENTRY: &str = "
        @group(0) @binding(10) var<storage, read> places: array<vec4<f32>>;
        @group(0) @binding(20) var<storage, read_write> found: array<vec4<f32>>;
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            let i = id.x;
            if i >= arrayLength(&places) { return; }
            let camera = i * CAMERA_ROWS;
            let images = images_of(camera, places[i].xyz - row(camera + V1).xyz, vec2(LO, HI));
            for (var piece = 0u; piece < 3u; piece++) {
                var image = Image(0.0, 0.0, 0.0, false);
                if piece < images.pieces.count {
                    image = project(camera, images, piece);
                }
                let seen = within(image, vec3(1e-3));
                found[3u * i + piece] = vec4(image.lambda, image.b2, image.b3, select(0.0, 1.0, seen));
            }
        }";
    let gpu = device()?;
    let text = shaders::projection_for_tests(SplatShape::Ellipse) + ENTRY;
    let text = text
        .replace("LO,", &format!("{:?},", RANGE[0]))
        .replace("HI)", &format!("{:?})", RANGE[1]));
    let text = change(text);
    let mut plan: Vec<Row> = Vec::new();
    let mut places = Vec::new();
    for case in cases {
        #[expect(clippy::cast_possible_truncation, reason = "rounded once")]
        let disk = case.disk as f32;
        let camera = ThreeRay { disk, ..ThreeRay::new(&case.rays, &case.rays) };
        plan.extend(three_ray_rows(&camera));
        places.push(case.place.extend(0.0).to_array().map(f32::to_bits));
    }
    let groups = u32::try_from(cases.len().div_ceil(64)).expect("few");
    let found = run(&gpu, &text, &[(1, &plan), (10, &places)], 3 * cases.len(), groups);
    let of = |three: &[[f32; 4]]| {
        let seen = three.iter().filter(|f| f[3] > 0.0);
        seen.map(|&[a, b, c, _]| [a, b, c].map(f64::from)).collect()
    };
    Some(found.chunks_exact(3).map(of).collect())
}

/// The rows of a camera of which only the projection is known.
fn three_ray_rows(t: &ThreeRay<f32>) -> Vec<Row> {
    let rows = LAYOUT.iter().find(|(name, _)| *name == "CAMERA_ROWS").expect("it is there").1;
    let mut list = vec![[0; 4]; rows as usize];
    let mut set = |name: &str, v: [f32; 3], w: f32| {
        let at = LAYOUT.iter().find(|(other, _)| *other == name).expect("it is there").1;
        list[at as usize] = [v[0], v[1], v[2], w].map(f32::to_bits);
    };
    for (name, v) in
        [("V1", t.v1), ("D1", t.d1), ("E1", t.e1), ("E2", t.e2), ("F1", t.f1), ("F2", t.f2)]
    {
        set(name, v, if name == "V1" { t.disk } else { 0.0 });
    }
    for (name, v, w) in [("N0", t.n0, t.nd[0]), ("N1", t.n1, t.nd[1]), ("N2", t.n2, t.nd[2])] {
        set(name, v, w);
    }
    set("AXIS", t.axis, if t.wide { 1.0 } else { 0.0 });
    let [a, b, c, d] = t.start;
    set("START", [a, b, c], d);
    let [a, b, c, d] = t.per_axis;
    set("PER_AXIS", [a, b, c], d);
    list
}

/// What is wrong with a shader's images, if anything.
fn verdict(cases: &[Case], found: &[Found]) -> Result<(), String> {
    let mut counts = [(0, 0); SETS.len()];
    for (case, found) in cases.iter().zip(found) {
        let (exact, single) = (images::<f64>(case), images::<f32>(case));
        let (total, off) = &mut counts[case.set];
        *total += 1;
        if found.len() != exact.len() {
            // Every image that is claimed must be one, and the point's own must not be lost for good.
            *off += 1;
        }
        let limit = |l: f64| f64::from(f32::EPSILON) * size(case) * (1.0 + l.abs());
        let worst = |list: &Found| list.iter().map(|&i| residual(case, i)).fold(0.0, f64::max);
        for &image in found {
            let allowed = TIMES * worst(&single).max(2.0 * limit(image[0]));
            // Where T(λ) is nearly flat weights mean little, and so does what they say.
            let weights = image[1].abs().max(image[2].abs());
            if weights < 1e3 && residual(case, image) > allowed && !exact.is_empty() {
                return Err(format!(
                    "{}: an image {} beside, of {allowed} (f32: {})",
                    SETS[case.set].0,
                    residual(case, image),
                    worst(&single)
                ));
            }
        }
    }
    for ((name, share), (total, off)) in SETS.iter().zip(counts) {
        if f64::from(off) > share * f64::from(total) {
            return Err(format!("{name}: {off} of {total} have another number of images"));
        }
    }
    Ok(())
}

/// Points a little off the caustic, on either side, which stand for disks that reach twice as far.
#[test]
fn disks_of_the_shader_reach_over_the_caustic() {
    let mut cases = cases(20_000);
    cases.retain(|case| SETS[case.set].0 == "near-double roots");
    for (i, case) in cases.iter_mut().enumerate() {
        let normal = case.rays.directions[0].cross(case.rays.directions[1]).normalize_or_zero();
        case.place += (normal * if i % 2 == 0 { 0.01 } else { -0.01 }).as_vec3();
        case.disk = 0.02;
    }
    let off = |change: fn(String) -> String| {
        let found = by_shader(&cases, change)?;
        let own = |(case, found): &(&Case, &Found)| images::<f32>(case).len() != found.len();
        Some(cases.iter().zip(&found).filter(own).count() as f64 / cases.len() as f64)
    };
    let Some(share) = off(|text| text) else { return };
    assert!(share < 0.01, "{share}");
    let without = off(|text| text.replace("* row(camera + V1).w", "* 0.0")).expect("it ran before");
    assert!(without > 0.1, "{without}");
}

#[test]
fn the_shader_projects_as_f64_does() {
    let cases = cases(20_000);
    let Some(found) = by_shader(&cases, |text| text) else { return };
    verdict(&cases, &found).unwrap_or_else(|problem| panic!("{problem}"));
    // A shader that is a little off is noticed.
    for (from, to) in [
        ("c.z * 2.0 + x", "c.z * 1.9 + x"),
        ("dot(cross(e1, x), n)", "dot(cross(x, e1), n)"),
        ("let e2 = lambda * row(camera + F2)", "let e2 = lambda * row(camera + F1)"),
        ("closed && f_lo == 0.0", "f_lo == 0.0"),
        ("0.0 <= f_hi", "1.0 <= f_hi"),
        ("row(camera + START)", "row(camera + START) * 1.01"),
    ] {
        let found = by_shader(&cases, |text| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        });
        let noticed = found.is_some_and(|found| verdict(&cases, &found).is_err());
        // Newton's slope only costs steps; a closed end only matters where a root is exactly there.
        let harmless = ["c.z * 2.0 + x", "closed && f_lo == 0.0"].contains(&from);
        assert!(noticed || harmless, "{from} -> {to} goes unnoticed");
    }
}

#[test]
fn packed_numbers_are_near() {
    let mut numbers = Numbers(5);
    for _ in 0..20_000 {
        let n = numbers.point().normalize_or(DVec3::Z).as_vec3();
        assert!((unpacked_normal(packed_normal(n)) - n.as_dvec3()).length() < 1e-4, "{n}");
        #[expect(clippy::cast_possible_truncation, reason = "any number")]
        let v = (2.0f64.powf(numbers.between(-14.0, 15.9))) as f32;
        let half = unpacked_half(packed_half(v));
        assert!((half - f64::from(v)).abs() <= f64::from(v) / 2048.0, "{v} {half}");
    }
    for (value, half) in [(0.0, 0), (-1.0, 0), (f32::NAN, 0), (1.0, 0x3c00), (1e9, 0x7bff)] {
        assert_eq!(packed_half(value), half, "{value}");
    }
    assert_eq!(packed_half(1e-6), 17, "multiples of 2^-24");
    for axis in [Vec3::X, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
        assert!((unpacked_normal(packed_normal(axis)) - axis.as_dvec3()).length() < 1e-6);
    }
    assert_eq!(packed_normal(Vec3::ZERO), 0);
}

fn unpacked_half(bits: u32) -> f64 {
    let (exponent, mantissa) = (bits >> 10, f64::from(bits & 1023) / 1024.0);
    let exponent = i32::try_from(exponent).expect("5 bits");
    if exponent == 0 {
        mantissa * 2f64.powi(-14)
    } else {
        (1.0 + mantissa) * 2f64.powi(exponent - 15)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "16 bits")]
pub(super) fn unpacked_normal(bits: u32) -> DVec3 {
    let half = |bits: u32| (f64::from(bits as u16 as i16) / 32767.0).max(-1.0);
    let p = DVec2::new(half(bits), half(bits >> 16));
    let z = 1.0 - p.x.abs() - p.y.abs();
    let sign = |v: f64| if v >= 0.0 { 1.0 } else { -1.0 };
    let (x, y) = match z < 0.0 {
        true => ((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y)),
        false => (p.x, p.y),
    };
    DVec3::new(x, y, z).normalize_or(DVec3::Z)
}

/// A reminder for whoever changes a layout: the shaders read rows by these numbers.
#[test]
fn layouts_are_those_of_the_shaders() {
    let text = shaders::projection_for_tests(SplatShape::Ellipse);
    let module = naga::front::wgsl::parse_str(&text).expect("it is valid");
    let frame = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Frame"));
    let naga::TypeInner::Struct { members, .. } = &frame.expect("it is there").1.inner else {
        panic!("Frame is a structure")
    };
    let offsets: Vec<(&str, u32)> =
        members.iter().map(|m| (m.name.as_deref().unwrap_or_default(), m.offset)).collect();
    macro_rules! fields {
        ($($name:ident),*) => { [$((stringify!($name), std::mem::offset_of!(Frame, $name))),*] };
    }
    let own = fields!(
        size,
        cameras,
        patches,
        batches,
        chunks,
        deviations,
        owners,
        first_hider,
        capacity,
        push_back,
        first_root,
        chunk_count,
        counts,
        padding
    );
    assert_eq!(offsets.len() + 1, own.len(), "and what fills the last row");
    for ((name, offset), (own, at)) in offsets.iter().zip(own) {
        assert_eq!((*name, *offset as usize), (own, at));
    }
    assert_eq!(CHUNK, 64, "the workgroups' size");
    assert!(text.contains(&format!("const SPREAD: f32 = {:?}f;", kernel::SPREAD)));
}
