//! A little wrong in each of the shaders: the comparisons must notice.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::super::{Limits, Path, shaders};
use super::device;
use super::pictures::{gpu, scene, shown, verdict};
use crate::backend::cpu::Cpu;
use crate::plan::SplatShape;

/// What is replaced, by what, and in what the change shows.
struct Mutant {
    from: &'static str,
    to: &'static str,
    splat: &'static str,
    path: Path,
    limits: Limits,
}

const fn mutant(splat: &'static str, path: Path, from: &'static str, to: &'static str) -> Mutant {
    Mutant { from, to, splat, path, limits: Limits::Adapter }
}

const fn core(splat: &'static str, path: Path, from: &'static str, to: &'static str) -> Mutant {
    Mutant { from, to, splat, path, limits: Limits::Core }
}

use Path::{Compute as C, Vertex as V};

const MUTANTS: [Mutant; 40] = [
    // plan
    mutant("square2", C, "number - batch.x < batch.y", "number - batch.x < batch.y - 1u"),
    mutant("square2", C, "(number - batch.x) * batch.w", "(number - batch.x)"),
    mutant("square2", C, "c.w + lane", "c.w + lane / 2u"),
    mutant("square2", V, "select(PIECES, instance,", "select(PIECES, 0u,"),
    mutant("square2", C, "frame.owners + pixel / 4u", "frame.owners + pixel / 4u + 1u"),
    // camera/three_ray
    mutant("square2", C, "c.x + x * (c.y + x * (c.z", "c.x + x * (c.y - x * (c.z"),
    mutant("square2", C, "c.z * c.z - c.y * a", "c.z * c.z + c.y * a"),
    mutant("square2", C, "rising = f_lo < 0.0", "rising = f_lo < -1.0"),
    mutant("square2", C, "abs(value(c, p)) <= noise.x", "abs(value(c, p)) <= 1e6 * noise.x"),
    mutant("square2", C, "least - slack", "least + 1e4 * slack"),
    mutant("square2", C, "row(camera + F1).xyz + row", "row(camera + F2).xyz + row"),
    mutant("square2", C, "-margin.y <= image.b2", "0.3 <= image.b2"),
    // splat/projection
    mutant("square2", C, "&& 1.0 < distance * least", ""),
    mutant("square2", C, "1.0 < distance &&", "0.1 < distance &&"),
    mutant(
        "ellipse",
        C,
        "let right_n = dot(normal, steps.right)",
        "let right_n = dot(normal, steps.down)",
    ),
    mutant("ellipse", C, "s.middle += correction", "s.middle -= correction"),
    mutant("ellipse", C, "(*s).form = vec3(yy, xy, xx)", "(*s).form = vec3(yy, -xy, xx)"),
    mutant("ellipse", C, "s.weight *= on.thin;", ""),
    mutant("ellipse", C, "size = share * share", "size = share"),
    mutant("square2", C, "return max(depth, 0.0);", "return 0.0;"),
    mutant("ellipse", C, "1.0 - abs(folded.x) - abs(folded.y)", "1.0 - abs(folded.x)"),
    // splat/lists, keys, radiance
    mutant("ellipse", C, "inside * inside * weight", "inside * weight"),
    mutant("ellipse", V, "2.0 * form.y * d.y", "form.y * d.y"),
    mutant("square2", C, "~(bitcast<u32>(depth)", "(bitcast<u32>(depth)"),
    core("square2", C, "== head {", "!= head {"),
    core("square2", V, "select(0u, 0x80000000u, fills)", "select(0x80000000u, 0u, fills)"),
    mutant("square2", C, "u64(~surfel)", "u64(surfel)"),
    mutant("square2", C, "radiance_b[surfel])", "radiance_b[surfel] + 0.1)"),
    // passes
    mutant("square1", V, "low + zero + 0.5", "low + zero - 0.5"),
    mutant("ellipse", V, "ceil(s.middle - s.half - 0.5)", "ceil(s.middle - 0.5 * s.half - 0.5)"),
    mutant("square2", V, "i.x + i.y * 2", "i.x * 2 + i.y"),
    mutant("ellipse", C, "floor(s.middle.x + mid + half - 0.5)", "floor(s.middle.x + mid - 0.5)"),
    mutant("square2", C, "vec2(i % SIDE, i / SIDE)", "vec2(i % SIDE, i % SIDE)"),
    mutant("ellipse", C, "last.x < key.x ||", "last.x > key.x ||"),
    mutant("ellipse", C, "part = min(part, 1.0 - full);", ""),
    mutant("ellipse", C, "found.y < frame.first_hider", "found.y >= 0u"),
    mutant("square2", C, "key.y < frame.first_hider", "key.y >= 0u"),
    mutant("ellipse", C, "mean = mix(a.color, b.color, share);", "mean = a.color;"),
    mutant("ellipse", C, "(1.0 - full) * around * some;", "0.0;"),
    mutant("ellipse", C, "covered = max(covered, min(a.layer.x, b.layer.x));", ""),
];

#[test]
fn every_mutant_is_noticed() {
    if device().is_none() {
        return;
    }
    let (bowl, sphere) = (scene("bowl"), scene("sphere"));
    let mut references = std::collections::BTreeMap::new();
    let mut unnoticed = String::new();
    for Mutant { from, to, splat, path, limits } in &MUTANTS {
        let shape = match *splat {
            "square1" => SplatShape::Square1,
            "square2" => SplatShape::Square2,
            _ => SplatShape::Ellipse,
        };
        let wide = *limits == Limits::Adapter;
        let text = shaders::splat(shape, *path == V, wide && *path == C)
            + &shaders::resolve(shape, wide && *path == C)
            + &shaders::close();
        assert!(text.contains(from), "{from} is in no shader");
        let mut noticed = false;
        for (name, scene) in [("bowl", &bowl), ("sphere", &sphere)] {
            for detail in ["2", "0"] {
                let words = [("splat", *splat), ("detail", detail)];
                let cpu = references
                    .entry((name, *splat, detail))
                    .or_insert_with(|| shown(Box::new(Cpu::default()), scene, &words));
                let mut backend = gpu(*path, *limits);
                backend.mutate([from, to]);
                // What is no object's surfel ends in a panic: that is noticed too.
                let found = catch_unwind(AssertUnwindSafe(|| shown(backend, scene, &words)));
                let verdict = found.map(|found| verdict(cpu, &found, *splat == "ellipse"));
                noticed = noticed || !matches!(verdict, Ok(Ok(())));
                if noticed {
                    break;
                }
            }
        }
        if !noticed {
            unnoticed += &format!("{splat} {path:?}: {from} -> {to}\n");
        }
    }
    assert_eq!(unnoticed, "");
}
