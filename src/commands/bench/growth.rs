//! `catoptric bench growth`: time and memory over surfels, mirror triangles, pixels and curvature.

use std::sync::Arc;

use catoptric::accel::KdTreeLimits;
use catoptric::analysis::measure::{Side, Stage, Timed, against};
use catoptric::backend::cpu::Cpu;
use catoptric::camera::Eye;
use catoptric::camera::eye::ImageSize;
use catoptric::geometry::Mesh;
use catoptric::methods::method;
use catoptric::scene::PreparedScene;
use catoptric::scene::description::Scene;
use glam::Vec3;
use serde_json::{Value, json};

use super::curve::{Curve, Row, TOTAL};
use super::report::{Block, Image, Plot, Section, number};
use super::run::{Bench, NOT_BUILT_IN, c3rc, params, with_mirror_triangles};
use crate::commands::plots::{Axis, Dot, LinePlot, Series, lines};

/// What is measured at each x: `c3rc` by its defaults and twice otherwise, and rays.
const SIDES: [&str; 4] = ["c3rc", "c3rc draft", "c3rc every point", "1 ray a pixel"];
/// Without level of detail, as the paper draws; but with conservative tests.
const EVERY_POINT: [(&str, &str); 3] =
    [("cameras", "triangles"), ("splat", "square1"), ("detail", "0")];
const REFERENCE: &str = "1 ray a pixel in the first row";

/// Surfels where something else grows.
const SURFELS: usize = 147_000;

pub(super) fn section(bench: Bench<'_>) -> anyhow::Result<Section> {
    let described = bench.described()?;
    let surfels = bench.surfels(bench.pick(SURFELS, 37_000));
    bench.step(0.0)?;
    let base = Base::new(bench, &described, surfels)?;
    let mut blocks = vec![Block::Text(NOTE.to_owned())];
    let by_surfels = over_surfels(bench.part(0.02, 0.4), &described, &base)?;
    by_surfels.show(&mut blocks)?;
    if by_surfels.rows.last().is_none_or(|row| row.x < most_surfels(bench) as f64) {
        blocks.push(Block::Text("More surfels do not go into the free memory.".to_owned()));
    }
    blocks.push(Block::Plot(once(
        &by_surfels,
        ("growth-memory", "Memory over the number of surfels", "MB"),
        &["surfel MB", "tree MB"],
    )?));
    blocks.push(Block::Plot(once(
        &by_surfels,
        ("growth-preparing", "Preparing over the number of surfels, once", "ms"),
        &["sampling ms", "trees ms", "shading ms"],
    )?));
    let by_triangles = over_triangles(bench.part(0.4, 0.6), &described, &base, surfels)?;
    match &by_triangles {
        Some(curve) => curve.show(&mut blocks)?,
        None => blocks.push(Block::Text(NOT_BUILT_IN.to_owned())),
    }
    let by_pixels = over_pixels(bench.part(0.6, 0.85), &base)?;
    by_pixels.show(&mut blocks)?;
    let by_curvature = over_curvature(bench.part(0.85, 1.0), &described, &base, surfels)?;
    by_curvature.show(&mut blocks)?;
    blocks.push(Block::Text(CURVED.to_owned()));
    let size = bench.args.place.size;
    Ok(Section {
        id: "growth",
        title: format!(
            "Growth: {} ({} x {} but where pixels grow)",
            described.name, size.width, size.height
        ),
        blocks,
        figures: json!({
            "scene": described.name,
            "size": [size.width, size.height],
            "surfels": surfels,
            "by_surfels": by_surfels.figures("surfels"),
            "by_mirror_triangles": by_triangles.map_or(Value::Null, |c| c.figures("triangles")),
            "by_pixels": by_pixels.figures("pixels"),
            "by_curvature": by_curvature.figures("curvature"),
        }),
    })
}

const NOTE: &str = "Reflections of a frame by c3rc (its defaults; quality draft; every point in a camera a triangle, without level of \
    detail, as in the paper but with conservative tests and our leaves) and by one ray a pixel, each in turn with the rays of the first \
    row. Memory is what surfels, representatives and trees hold; meshes, triangle BVHs and pictures are not counted.";

const CURVED: &str = "Curvature: the scene's first mirror is replaced by a square sheet of its diagonal with the principal curvatures of \
    a paraboloid at its middle, upright at the mirror's place; positive bulges towards the eye. Its unit is one by the sheet's side.";

/// A scene of a row, or what every row is measured against.
struct Base {
    scene: PreparedScene,
    eye: Eye,
}

impl Base {
    fn new(bench: Bench<'_>, described: &Scene, surfels: usize) -> anyhow::Result<Self> {
        let scene = bench.prepared(described, surfels, KdTreeLimits::default().leaf_points)?;
        let eye = bench.args.place.eye(&scene)?;
        Ok(Self { scene, eye })
    }
}

/// All sides on one scene, against the rays of the first.
fn measure(
    bench: Bench<'_>,
    base: &Base,
    scene: &PreparedScene,
    eye: &Eye,
) -> anyhow::Result<Vec<Timed>> {
    let rays = method("raytrace").expect("it is in the registry");
    let on_cpu = || Box::new(Cpu::default());
    let mut stages = [
        Stage::new(&base.scene, &base.eye, on_cpu()),
        Stage::new(scene, eye, bench.backend()?),
        Stage::new(scene, eye, on_cpu()),
    ];
    let cx = bench.silent();
    let reference = Side::new(&stages, 0, rays, params(rays, "", &[]), &cx)?;
    let mut sides = Vec::new();
    for (quality, values) in [("", &[][..]), ("draft", &[]), ("", &EVERY_POINT)] {
        sides.push(Side::new(&stages, 1, c3rc(), params(c3rc(), quality, values), &cx)?);
    }
    sides.push(Side::new(&stages, 2, rays, params(rays, "", &[]), &cx)?);
    let step = |done| bench.step(done);
    Ok(against(&mut stages, &reference, &sides, bench.rounds(), step)?.1)
}

fn curve(id: &'static str, title: &str, x: Axis, rows: Vec<Row>) -> Curve {
    let (sides, stages) = (SIDES.to_vec(), &TOTAL);
    Curve { id, title: title.to_owned(), x, sides, stages, rows, reference: REFERENCE }
}

/// What is there or done once, over x: columns of a curve by their names. `what`: a word for files, a title, a unit.
fn once(curve: &Curve, what: (&str, &str, &'static str), columns: &[&str]) -> anyhow::Result<Plot> {
    let (name, title, unit) = what;
    let series = columns.iter().map(|column| {
        let of = |row: &Row| {
            let (.., figure) = row.more.iter().find(|more| more.0 == *column)?;
            Some(Dot::exact(row.x, figure.as_f64()?))
        };
        let dots = curve.rows.iter().filter_map(of).collect();
        Series { name: column.trim_end_matches(unit).to_owned(), dots, joined: true }
    });
    let series: Vec<Series> = series.collect();
    let y = Axis { label: unit, log: true };
    let plot = LinePlot { title, x: curve.x, y, series: &series, level: None };
    let (name, caption) = (name.to_owned(), format!("{title}."));
    Ok(Plot { name, caption, image: Image::Svg(lines(&plot)?) })
}

/// Where the surfels end.
fn most_surfels(bench: Bench<'_>) -> usize {
    let most = bench.pick(10_000_000, 316_228);
    bench.args.max.map_or(most, |max| usize::try_from(max).unwrap_or(most))
}

fn over_surfels(bench: Bench<'_>, described: &Scene, base: &Base) -> anyhow::Result<Curve> {
    let most = most_surfels(bench);
    // Two a decade.
    let mut counts: Vec<usize> = (0..)
        .flat_map(|decade| {
            [10_000, 31_623].map(|n: usize| n.saturating_mul(10_usize.saturating_pow(decade)))
        })
        .take_while(|&n| n < most)
        .collect();
    counts.push(most);
    counts.retain(|&count| bench.fits(count));
    let mut rows = Vec::new();
    for (i, &count) in counts.iter().enumerate() {
        let part = bench.turn(i, counts.len());
        part.step(0.0)?;
        let Base { scene, eye } = Base::new(part, described, count)?;
        let (bytes, times) = (scene.surfel_bytes(), scene.times);
        let megabytes = |bytes: usize| number(bytes as f64 * 1e-6);
        let ms = |name, ms: f64| (name, number(ms), json!(ms));
        let more = vec![
            ("surfel MB", megabytes(bytes.surfels), json!(bytes.surfels as f64 * 1e-6)),
            ("tree MB", megabytes(bytes.trees), json!(bytes.trees as f64 * 1e-6)),
            ms("sampling ms", times.sample_ms),
            ms("trees ms", times.tree_ms),
            ms("shading ms", times.shade_ms),
        ];
        let timed = measure(part.part(0.3, 1.0), base, &scene, &eye)?;
        rows.push(Row { x: count as f64, timed, more });
    }
    let x = Axis { label: "surfels", log: true };
    Ok(curve("growth-surfels", "Reflections over the number of surfels", x, rows))
}

fn over_triangles(
    bench: Bench<'_>,
    described: &Scene,
    base: &Base,
    surfels: usize,
) -> anyhow::Result<Option<Curve>> {
    let counts = bench.pick(
        &[2_000, 4_000, 8_000, 16_000, 32_000, 64_000, 128_000][..],
        &[2_000, 16_000, 128_000],
    );
    let mut rows = Vec::new();
    for (i, &count) in counts.iter().enumerate() {
        let part = bench.turn(i, counts.len());
        part.step(0.0)?;
        let Some(scene) = with_mirror_triangles(described, count) else { return Ok(None) };
        let own = Base::new(part, &scene, surfels)?;
        let timed = measure(part.part(0.3, 1.0), base, &own.scene, &own.eye)?;
        rows.push(Row { x: own.scene.mirror_triangle_count() as f64, timed, more: Vec::new() });
    }
    let x = Axis { label: "mirror triangles", log: true };
    Ok(Some(curve("growth-triangles", "Reflections over the mirror's triangles", x, rows)))
}

/// The sides of `size` times a share.
pub(super) fn scaled(size: ImageSize, share: f64) -> ImageSize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "pixels")]
    let side = |n: u32| (f64::from(n) * share).round().clamp(1.0, 16_384.0) as u32;
    ImageSize { width: side(size.width), height: side(size.height) }
}

fn over_pixels(bench: Bench<'_>, base: &Base) -> anyhow::Result<Curve> {
    let shares = bench.pick(&[0.25, 0.5, 1.0, 2.0, 3.0][..], &[0.25, 0.5, 1.0]);
    let mut rows = Vec::new();
    for (i, &share) in shares.iter().enumerate() {
        let size = scaled(bench.args.place.size, share);
        let eye = bench.args.place.eye_at(&base.scene, size)?;
        let timed = measure(bench.turn(i, shares.len()), base, &base.scene, &eye)?;
        let more = vec![(
            "size",
            format!("{} x {}", size.width, size.height),
            json!([size.width, size.height]),
        )];
        rows.push(Row { x: size.pixels() as f64, timed, more });
    }
    let x = Axis { label: "pixels of the picture", log: true };
    Ok(curve("growth-pixels", "Reflections over the picture's pixels", x, rows))
}

fn over_curvature(
    bench: Bench<'_>,
    described: &Scene,
    base: &Base,
    surfels: usize,
) -> anyhow::Result<Curve> {
    let curvatures =
        bench.pick(&[-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0][..], &[-1.0, 0.0, 2.0]);
    let mut rows = Vec::new();
    for (i, &curvature) in curvatures.iter().enumerate() {
        let part = bench.turn(i, curvatures.len());
        part.step(0.0)?;
        let mut scene = described.clone();
        scene.mirrors.truncate(1);
        let mirror = &mut scene.mirrors[0];
        let (low, high) = (mirror.mesh.bounds().min, mirror.mesh.bounds().max);
        mirror.mesh = Arc::new(sheet(curvature, 0.5 * (low + high), 0.5 * (high - low).length()));
        (mirror.source, mirror.proxy) = (None, None);
        let own = Base::new(part, &scene, surfels)?;
        let timed = measure(part.part(0.3, 1.0), base, &own.scene, &own.eye)?;
        rows.push(Row { x: f64::from(curvature), timed, more: Vec::new() });
    }
    let x = Axis { label: "curvature of the sheet by its side", log: false };
    Ok(curve("growth-curvature", "Reflections over the mirror's curvature", x, rows))
}

/// Quadrilaterals along a side of the sheet: 4,050 triangles.
const CELLS: u16 = 45;

/// A square sheet of this side about a point, its normal at the middle along z; curvature in units of one by the side.
fn sheet(curvature: f32, center: Vec3, side: f32) -> Mesh {
    let vertices = (0..=CELLS).flat_map(|row| (0..=CELLS).map(move |column| (row, column)));
    let at = |i: u16| f32::from(i) / f32::from(CELLS) - 0.5;
    let (positions, normals) = vertices
        .map(|(row, column)| {
            let (x, y) = (at(column), at(row));
            let z = -0.5 * curvature * (x * x + y * y);
            let normal = Vec3::new(curvature * x, curvature * y, 1.0).normalize_or(Vec3::Z);
            (center + side * Vec3::new(x, y, z), normal)
        })
        .unzip();
    let corner = |row: u32, column: u32| row * (u32::from(CELLS) + 1) + column;
    let cells = (0..u32::from(CELLS)).flat_map(|row| (0..u32::from(CELLS)).map(move |c| (row, c)));
    let triangles = cells.flat_map(|(row, column)| {
        let [a, b] = [corner(row, column), corner(row, column + 1)];
        let [c, d] = [corner(row + 1, column + 1), corner(row + 1, column)];
        [[a, b, c], [a, c, d]]
    });
    Mesh::new(positions, normals, Vec::new(), triangles.collect()).expect("a sheet has area")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_bulge_towards_their_front_as_much_as_they_say() {
        for curvature in [-2.0_f32, 0.0, 1.0] {
            let mesh = sheet(curvature, Vec3::new(1.0, 2.0, 3.0), 2.0);
            assert_eq!(mesh.triangles().len(), 4050);
            for (p, n) in mesh.positions().iter().zip(mesh.normals()) {
                let flat = (*p - Vec3::new(1.0, 2.0, 3.0)) * 0.5;
                let slope = -curvature * flat.truncate();
                assert!(n.z > 0.0 && (n.truncate() / n.z + slope).length() < 1e-5, "{n}");
            }
            let [a, b, c] = mesh.corners(2000);
            assert!((b - a).cross(c - a).z > 0.0, "seen from the front");
        }
    }

    #[test]
    fn sizes_are_scaled_by_their_sides() {
        let size = ImageSize { width: 1280, height: 720 };
        assert_eq!(scaled(size, 3.0), ImageSize { width: 3840, height: 2160 });
        assert_eq!(scaled(size, 0.25), ImageSize { width: 320, height: 180 });
        assert_eq!(scaled(size, 0.0), ImageSize { width: 1, height: 1 });
    }
}
