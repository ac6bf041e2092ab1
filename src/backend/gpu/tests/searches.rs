//! The searches in WGSL against exact reflection points, and cube maps against the CPU's.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::super::search::{Searcher, Task};
use super::super::shaders;
use super::{Device, device};
use crate::backend::cpu::lookup::{self, Asked};
use crate::backend::cpu::search::{Job, OnCpu, SearchBackend};
use crate::camera::reflector::cube::{CubeMap, directions};
use crate::camera::reflector::exact::Surface;
use crate::camera::reflector::tests::{Case, ELLIPSOID, SPHERE, apart_px, cases_of, map};
use crate::camera::reflector::{Found, estalella};
use crate::context::Context;
use crate::plan::EnvironmentCube;
use crate::plan::search::{Bend, ReflectorPart, Search};

/// To its end: before, it depends on the eye how far it has come.
const ESTALELLA: Search = Search::Estalella(estalella::Ends { iterations: 20, epsilon: 0.0 });
const ROGER: Search = Search::Roger { iterations: 20, px: 0.01 };
const EYES: [DVec3; 4] = [
    DVec3::new(0.0, 0.3, 5.0),
    DVec3::new(5.0, -1.0, 0.5),
    DVec3::new(-1.0, 5.0, -2.0),
    DVec3::new(-3.0, -2.0, -1.0),
];

/// A surface with its map, and cases of each eye.
struct Trial {
    parts: Arc<Vec<ReflectorPart>>,
    cases: [Vec<Case>; 4],
    /// Bars, in pixels at a focal length of 1000, for 99 of a hundred: Estalella et al., Roger & Holzschuch.
    bars: [f64; 2],
}

fn trial(surface: Surface, bars: [f64; 2]) -> Trial {
    let part = ReflectorPart {
        name: "test".into(),
        mirror: 0,
        triangles: 0..0,
        center: Vec3::ZERO,
        map: map(surface, false),
        bend: Bend::Convex,
    };
    let cases = EYES.map(|eye| cases_of(surface, 5_000, |_| eye));
    Trial { parts: Arc::new(vec![part]), cases, bars }
}

/// Whether the device finds the exact points as well as the bars ask for, and what the CPU finds.
fn agrees(gpu: &Device, trial: &Trial, search: Search) -> Result<(), String> {
    let mut searcher = Searcher::new(gpu).map_err(|e| e.to_string())?;
    searcher.hold_maps(gpu, &trial.parts).map_err(|e| e.to_string())?;
    let (mut errors, mut apart, mut total) = (Vec::new(), 0, 0);
    for (eye, cases) in EYES.iter().zip(&trial.cases) {
        let vertices = cases.iter().map(|case| case.vertex.as_vec3());
        // Hidden ones, too.
        let behind = cases.iter().map(|case| (case.exact * 0.5).as_vec3());
        let points: Vec<Vec3> = vertices.chain(behind).collect();
        let part = &trial.parts[0];
        let job = Job { part, search, eye: eye.as_vec3(), px: 1e-3, points: &points };
        let on_device = searcher.find(gpu, &job).map_err(|e| e.to_string())?;
        let on_cpu = OnCpu(&Context::default()).find(&job).map_err(|e| e.to_string())?;
        let px = |a: &Found, b: DVec3| apart_px(*eye, a.point.as_dvec3(), b);
        errors.extend(cases.iter().zip(&on_device).map(|(case, found)| px(found, case.exact)));
        for (a, b) in on_device.iter().zip(&on_cpu) {
            let normals = a.normal.distance(b.normal) < 1e-2;
            // A bisector that rounds to the normal ends a search early.
            let steps = a.steps.abs_diff(b.steps) <= 6 || search == ESTALELLA;
            let alike = normals && steps && a.hidden == b.hidden;
            let close = px(a, b.point.as_dvec3()) < 0.1 && alike;
            apart += usize::from(!close);
            total += 1;
        }
    }
    errors.sort_by(f64::total_cmp);
    let (median, p99) = (errors[errors.len() / 2], errors[errors.len() * 99 / 100]);
    let bar = if search == ROGER { trial.bars[1] } else { trial.bars[0] };
    let verdict =
        format!("median {median:.4}, p99 {p99:.4} px, {apart} of {total} unlike the CPU's");
    // Searches that have not ended, near silhouettes, go other ways in another rounding.
    if median <= 0.1 && p99 <= bar && apart * 20 <= total { Ok(()) } else { Err(verdict) }
}

fn trials() -> [Trial; 2] {
    [trial(SPHERE, [2.0, 0.05]), trial(ELLIPSOID, [3.0, 0.2])]
}

#[test]
fn the_device_finds_the_exact_points() {
    let Some(gpu) = device() else { return };
    for trial in &trials() {
        for search in [ESTALELLA, ROGER] {
            assert_eq!(agrees(&gpu, trial, search), Ok(()), "{search:?}");
        }
    }
}

/// What is replaced, by what, and in which search it shows.
const MUTANTS: [(&str, &str, Search); 18] = [
    ("row = task.side + 2u;", "row = task.side + 1u;", ROGER),
    ("face = select(2u, 3u,", "face = select(3u, 2u,", ROGER),
    ("* 0.5 * side + 0.5", "* 0.5 * side", ROGER),
    ("texel * 6u + part", "texel * 6u", ESTALELLA),
    ("let point = u * read.w;", "let point = u;", ROGER),
    ("vertex = given - at.normal", "vertex = given + at.normal", ESTALELLA),
    ("0.5 * (1.0 - dot(b, at.normal))", "0.5 * dot(b, at.normal)", ESTALELLA),
    ("nearest - ahead * depth", "nearest + ahead * depth", ESTALELLA),
    ("eye.xyz * own.w + own.xyz * eye.w", "eye.xyz * eye.w + own.xyz * own.w", ESTALELLA),
    ("reach - dot(middle.toward, ahead)", "reach + dot(middle.toward, ahead)", ESTALELLA),
    ("along = turned;", "along = -turned;", ESTALELLA),
    ("read.xyz * along + (e - u * along) * read.w", "(e - u * along) * read.w", ROGER),
    ("let along = dot(e, u);", "let along = 0.5 * dot(e, u);", ROGER),
    ("let beta = (ab * ac - aa * bc)", "let beta = (ab * ac + aa * bc)", ROGER),
    ("outward = s.point - s.slope", "outward = s.point", ROGER),
    ("found[2u * i + 1u]", "found[2u * i]", ROGER),
    ("least < 0.0;", "least > 0.0;", ROGER),
    ("length(p) / radial_at(p).w - 1.0", "length(p) / radial_at(p).w", ROGER),
];

#[test]
fn every_mutant_of_the_searches_is_noticed() {
    let Some(mut gpu) = device() else { return };
    let trials = trials();
    let mut unnoticed = String::new();
    for (from, to, search) in MUTANTS {
        assert!(shaders::search().contains(from), "{from} is in no shader");
        gpu.mutant = Some([from, to]);
        if trials.iter().all(|trial| agrees(&gpu, trial, search).is_ok()) {
            unnoticed += &format!("{search:?}: {from} -> {to}\n");
        }
    }
    assert_eq!(unnoticed, "");
}

#[test]
fn the_device_reads_cube_maps() {
    let Some(gpu) = device() else { return };
    let cube = |side: u32, times: f32| EnvironmentCube {
        center: Vec3::ZERO,
        radiance: CubeMap::new(
            side,
            directions(side).iter().map(|d| [d.x * times, d.y, d.z, times]).collect(),
        ),
        seen: Vec::new(),
    };
    let cubes = Arc::new(vec![cube(16, 1.0), cube(33, 2.0)]);
    let asked: Vec<Asked> = directions(20)
        .into_iter()
        .enumerate()
        .map(|(pixel, d)| Asked { pixel, mirror: pixel % 2, direction: (d + 0.01) * 3.0 })
        .collect();
    let mut searcher = Searcher::new(&gpu).expect("room");
    let read = searcher.look_up(&gpu, &cubes, &asked).expect("it runs");
    let exact = lookup::by_cpu(&cubes, &asked).expect("it runs");
    assert_eq!(read.len(), exact.len());
    for (a, b) in read.iter().zip(&exact) {
        assert!((0..4).all(|k| (a[k] - b[k]).abs() < 1e-5), "{a:?} instead of {b:?}");
    }
}

#[test]
fn the_task_is_the_shaders() {
    let module = naga::front::wgsl::parse_str(&shaders::search()).expect("it is valid");
    let task = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Task"));
    let naga::TypeInner::Struct { members, span } = &task.expect("it is there").1.inner else {
        panic!("Task is a structure")
    };
    macro_rules! fields {
        ($($name:ident),*) => { [$((stringify!($name), std::mem::offset_of!(Task, $name))),*] };
    }
    let own = fields!(eye, side, inward, iterations, count, limit);
    assert_eq!((*span as usize, members.len()), (size_of::<Task>(), own.len()));
    for (member, (name, offset)) in members.iter().zip(own) {
        assert_eq!((member.name.as_deref(), member.offset as usize), (Some(name), offset));
    }
}
