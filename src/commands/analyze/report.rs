//! The figures, as text and as JSON.

use std::fmt::Write as _;

use catoptric::analysis::multiplicity::{ImageHistogram, SampledImages};
use catoptric::camera::RayScale;
use catoptric::camera::three_ray::multiplicity::Class;
use serde_json::{Value, json};

use super::{Findings, POINTS_A_CAMERA};
use crate::commands::ms;

impl Findings {
    fn class_count(&self, class: Option<Class>) -> usize {
        self.classes.iter().filter(|own| **own == class).count()
    }

    fn class_counts(&self) -> [usize; 4] {
        [Some(Class::Divergent), Some(Class::ConvergentThenDivergent), Some(Class::Mixed), None]
            .map(|class| self.class_count(class))
    }

    fn rulings(&self) -> usize {
        self.caustic.strips.iter().map(|strip| strip.rulings.len()).sum()
    }

    fn scale_name(&self) -> &'static str {
        match self.ray_scale {
            RayScale::EyeDistance => "eye-distance",
            RayScale::Unit => "unit",
        }
    }
}

/// Shares of points with 1, 2 and 3 images, in percent.
fn percent(sampled: &SampledImages) -> [f64; 3] {
    let total = sampled.points.iter().sum::<u32>().max(1);
    sampled.points.map(|n| 100.0 * f64::from(n) / f64::from(total))
}

/// What is printed.
pub(super) fn summary(findings: &Findings) -> String {
    let [divergent, convergent, mixed, away] = findings.class_counts();
    let [one, two, three] = percent(&findings.one_camera);
    let line = |name: &str, set: &ImageHistogram| {
        let parts = (0..set.over_all.len()).filter(|n| set.over_all[*n] > 0);
        let all: Vec<usize> = parts.collect();
        let (few, more) = all.split_at(all.len().min(MOST_PRINTED));
        let part = |n: &usize| format!("{n}: {:.2} %", 100.0 * set.share(*n));
        let mut parts: Vec<String> = few.iter().map(part).collect();
        if !more.is_empty() {
            let share: f64 = more.iter().map(|&n| set.share(n)).sum();
            parts.push(format!("more: {:.2} %", 100.0 * share));
        }
        format!("  images of points on {name}: {}", parts.join(", "))
    };
    let mut lines = vec![
        format!(
            "{}: {} cameras of {} mirror triangles",
            findings.scene, findings.cameras, findings.triangles
        ),
        format!(
            "  classes: {divergent} divergent, {convergent} convergent then divergent, {mixed} mixed, {away} turned away"
        ),
        format!("  in one camera: 1 image {one:.3} %, 2 images {two:.3} %, 3 images {three:.4} %"),
        line("objects", &findings.surfels),
        line("rays", &findings.rays),
        format!(
            "  caustic: {} strips, {} rulings, {:.1} ms",
            findings.caustic.strips.len(),
            findings.rulings(),
            findings.caustic_ms
        ),
    ];
    lines.push(match &findings.slice {
        Some(cut) => {
            let mixed: Vec<String> =
                cut.mixed.iter().map(|[from, to]| format!("{from:.4} to {to:.4}")).collect();
            format!("  slice: mirror triangle {}, mixed for λ {}", cut.triangle, mixed.join(", "))
        }
        None => "  slice: none, every camera sees every point once".to_owned(),
    });
    lines.join("\n")
}

/// Numbers of images listed in a line at most; all are in the files.
const MOST_PRINTED: usize = 8;

fn histogram_json(set: &ImageHistogram) -> Value {
    json!({
        "points": set.points(),
        "images": set.over_all,
        "most_in_one_camera": set.in_one_camera,
    })
}

/// All figures.
pub(super) fn to_json(findings: &Findings) -> Value {
    let [divergent, convergent, mixed, away] = findings.class_counts();
    let slice = findings.slice.as_ref().map(|cut| {
        json!({
            "triangle": cut.triangle,
            "mixed_lambda": cut.mixed,
            "size": cut.slice.sides.map(|side| side.length()),
            "pixels_by_images": cut.slice.histogram(),
        })
    });
    json!({
        "scene": findings.scene,
        "mirrors": findings.mirrors,
        "ray_scale": findings.scale_name(),
        "extent": findings.extent,
        "mirror_triangles": findings.triangles,
        "cameras": findings.cameras,
        "classes": {
            "divergent": divergent,
            "convergent_then_divergent": convergent,
            "mixed": mixed,
            "turned_away": away,
        },
        "one_camera": {
            "points": findings.one_camera.points.iter().sum::<u32>(),
            "images": findings.one_camera.points,
        },
        "objects": histogram_json(&findings.surfels),
        "rays": histogram_json(&findings.rays),
        "caustic": {
            "strips": findings.caustic.strips.len(),
            "rulings": findings.rulings(),
            "ms": ms(Some(findings.caustic_ms)),
        },
        "slice": slice,
        "plane": {
            "size": findings.plane.sides.map(|side| side.length()),
            "pixels_by_images": findings.plane.histogram(),
        },
    })
}

fn image_table(findings: &Findings) -> String {
    let sets = [&findings.surfels, &findings.rays];
    let rows = sets.iter().map(|set| set.over_all.len()).max().unwrap_or(0);
    let mut text =
        "| images | of points on objects | of points on rays |\n|---|---|---|\n".to_owned();
    for n in 0..rows {
        let [a, b] = sets.map(|set| 100.0 * set.share(n));
        let _ = writeln!(text, "| {n} | {a:.3} % | {b:.3} % |");
    }
    text
}

/// The report.
pub(super) fn markdown(findings: &Findings) -> String {
    let [divergent, convergent, mixed, away] = findings.class_counts();
    let [one, two, three] = percent(&findings.one_camera);
    let slice = match &findings.slice {
        None => {
            "No camera sees a point twice within the scene, so there is no slice through one.\n"
                .to_owned()
        }
        Some(cut) => {
            let mixed: Vec<String> =
                cut.mixed.iter().map(|[from, to]| format!("{from:.4} to {to:.4}")).collect();
            format!(
                "![slice](slice.png)\n\nThe camera of mirror triangle {}: its rays lie on both sides of the sweeping triangle for λ \
                 from {}. The slice runs along one of its rays, away from the mirror ({:.4} long), and across ({:.3e} \
                 wide) the way its neighbours meet it; [slice.svg](slice.svg) has axes. Where the number changes by two is the \
                 caustic.\n",
                cut.triangle,
                mixed.join(" and from "),
                cut.slice.sides[0].length(),
                cut.slice.sides[1].length(),
            )
        }
    };
    let one_camera_table = {
        let [objects, rays] = [&findings.surfels, &findings.rays].map(|set| {
            let total = f64::from(set.points().max(1));
            set.in_one_camera.map(|n| 100.0 * f64::from(n) / total)
        });
        let mut text =
            "| at most, in one camera | of points on objects | of points on rays |\n|---|---|---|\n".to_owned();
        for n in 0..4 {
            let _ = writeln!(text, "| {n} | {:.3} % | {:.3} % |", objects[n], rays[n]);
        }
        text
    };
    format!(
        "# {scene}: multiple images and caustics\n\n\
         Mirrors: {mirrors}. {cameras} of {triangles} mirror triangles face the eye at least in part, and each is a continuous \
         3-ray camera (rays: {scale}). Each is looked at up to where its shortest ray is as long as the scene is wide \
         ({extent:.4}).\n\n\
         ## Cameras\n\n\
         | class | triangles | |\n|---|---|---|\n\
         | divergent | {divergent} | blue: the beam only widens |\n\
         | convergent, then divergent | {convergent} | green: it narrows without folding over |\n\
         | mixed | {mixed} | orange: it folds, and points there may have several images |\n\
         | turned away | {away} | |\n\n\
         ![classes](classes.png)\n\n\
         Points on rays of one camera ({samples} for each mixed camera, evenly over its triangle and λ; the others have one image by \
         the theorem): 1 image {one:.3} %, 2 images {two:.3} %, 3 images {three:.4} %.\n\n\
         {slice}\n\
         ## Over all cameras\n\n\
         {surfels} points on objects and {rays} on rays (evenly over the mirrors' area and the distance), hidden images \
         included:\n\n\
         {images}\n![histogram](histogram.svg)\n\n{one_camera_table}\n\
         ![images](images.png)\n\n\
         Each mirror pixel by the number of images of the object's point that is seen there: blue 1, yellow 2, red 3, green 4, \
         violet 5, pink 6, teal 7, brown 8, slate 9, lime 10, crimson 11, white more; dark where none is seen.\n\n\
         ![plane](plane.png)\n\n\
         The same over the upright plane through the mirrors and the eye, {side:.3} wide; dark where nothing is seen.\n\n\
         ## Caustic\n\n\
         [caustic.ply](caustic.ply): {strips} strips of {rulings} straight lines, within 1 % of the sweeping triangle's longest \
         edge; made in {ms:.1} ms. Vertices have `lambda` and `mirror_triangle`.\n",
        scene = findings.scene,
        mirrors = findings.mirrors.join(", "),
        cameras = findings.cameras,
        triangles = findings.triangles,
        scale = findings.scale_name(),
        extent = findings.extent,
        samples = POINTS_A_CAMERA,
        surfels = findings.surfels.points(),
        rays = findings.rays.points(),
        images = image_table(findings),
        side = findings.plane.sides[0].length(),
        strips = findings.caustic.strips.len(),
        rulings = findings.rulings(),
        ms = findings.caustic_ms,
    )
}
