//! `catoptric analyze`: where mirrors show a point more than once, and where they focus light.

mod plots;
mod ply;
mod report;

use std::path::{Path, PathBuf};
use std::time::Instant;

use catoptric::analysis::multiplicity::{
    CausticSurface, ImageHistogram, MirrorCameras, SampledImages, Slice, camera_slice,
    class_picture, double_image_picture, image_histogram, mirror_slice, ray_points, surfel_points,
};
use catoptric::backend::cpu::finish;
use catoptric::camera::three_ray::multiplicity::Class;
use catoptric::camera::{Eye, RayScale};
use catoptric::image::Picture;
use catoptric::image::io::{write_bytes, write_picture};
use catoptric::paths::{PathFinder, PathOptions, PathScene};
use catoptric::scene::arrange;
use catoptric::scene::prepared::PreparedScene;
use catoptric::visibility::{Scratch, Visibility};
use catoptric::{Context, Error, Result};
use clap::{Args, ValueEnum};
use serde_json::Value;

use super::{SceneArgs, check_folder, check_json, say, write_json};

/// Analyze a scene's mirrors as the eye sees them: multiple images and caustics
///
/// Writes a folder: a report (report.md, report.json), the mirrors coloured by how each camera's rays run (classes.png) and by
/// the number of images of what is seen (images.png), the caustic surface (caustic.ply), the number of images over a plane
/// through the most folded camera (slice.png, slice.svg) and through all mirrors (plane.png), and histograms (histogram.svg).
#[derive(Args, Debug)]
pub(crate) struct AnalyzeArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for the results; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "catoptric-analysis")]
    output: PathBuf,
    /// Points whose images are counted, on objects and on rays
    #[arg(long, value_name = "N", default_value_t = 20_000, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    points: u32,
    /// Mirror triangle to slice, counted over all mirrors from 0 (default: the one with most double images)
    #[arg(long, value_name = "INDEX", allow_negative_numbers = true)]
    triangle: Option<u32>,
    /// Length of a camera's three rays: exact for plane mirrors, or as in the paper
    #[arg(long, value_enum, value_name = "LENGTH", default_value_t = Scale::EyeDistance)]
    ray_scale: Scale,
    /// Write the figures here, too
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Scale {
    EyeDistance,
    Unit,
}

impl From<Scale> for RayScale {
    fn from(scale: Scale) -> Self {
        match scale {
            Scale::EyeDistance => Self::EyeDistance,
            Scale::Unit => Self::Unit,
        }
    }
}

/// Points of each mixed camera for the shares in one camera.
const POINTS_A_CAMERA: u32 = 256;
/// Columns and rows of a slice through one camera.
const SLICE: [u32; 2] = [640, 400];
/// Columns and rows of the plane through all mirrors.
const PLANE: [u32; 2] = [640, 640];

/// All that is found out.
struct Findings {
    scene: String,
    mirrors: Vec<String>,
    ray_scale: RayScale,
    extent: f64,
    triangles: usize,
    cameras: usize,
    /// By triangle.
    classes: Vec<Option<Class>>,
    /// Over all cameras.
    one_camera: SampledImages,
    surfels: ImageHistogram,
    rays: ImageHistogram,
    caustic: CausticSurface,
    caustic_ms: f64,
    slice: Option<CameraSlice>,
    plane: Slice,
    class_picture: Picture,
    image_picture: Picture,
}

/// A slice through one camera and what it was cut through.
struct CameraSlice {
    triangle: u32,
    /// Mixed intervals of λ up to the camera's reach.
    mixed: Vec<[f64; 2]>,
    slice: Slice,
}

pub(crate) fn run(args: &AnalyzeArgs, cx: &Context) -> anyhow::Result<()> {
    check_json(args.json.as_ref())?;
    check_folder(&args.output)?;
    let findings = find(args, cx)?;
    let value = report::to_json(&findings);
    cx.check()?;
    write(&args.output, &findings, &value)?;
    write_json(args.json.as_ref(), &value)?;
    say!("{}", report::summary(&findings));
    say!("The report is {}", args.output.join("report.md").display());
    Ok(())
}

fn find(args: &AnalyzeArgs, cx: &Context) -> anyhow::Result<Findings> {
    args.scene.begin(cx)?;
    let described = arrange::scene(&args.scene.place.request(args.scene.surfels), cx)?;
    let scene = PreparedScene::new(&described, &args.scene.prepare_options(None), cx)?;
    let eye = args.scene.place.eye(&scene)?;
    let ray_scale = RayScale::from(args.ray_scale);
    check_triangle(args.triangle, scene.mirror_triangle_count())?;

    let cameras = MirrorCameras::new(&scene, eye.position, ray_scale);
    let classes = cameras.classes();
    cx.step("caustic", 0.0)?;
    let start = Instant::now();
    let caustic = cameras.caustic();
    let caustic_ms = start.elapsed().as_secs_f64() * 1e3;
    cx.step("images in one camera", 0.0)?;
    let sampled = cameras.sampled_images(POINTS_A_CAMERA);
    let slice = slice(args.triangle, &cameras, &sampled)?;

    let path_scene = PathScene::new(&described);
    let options = PathOptions { ray_scale, occlusion: false, refine: false };
    let finder = PathFinder::new(&path_scene, scene.eye.position, options)?;
    let on_objects = surfel_points(&scene, args.points as usize);
    let on_rays = ray_points(&cameras, args.points);
    let visibility = see(&scene, &eye);
    Ok(Findings {
        scene: scene.name.clone(),
        mirrors: scene.mirrors.iter().map(|mirror| mirror.name.clone()).collect(),
        ray_scale,
        extent: cameras.extent,
        triangles: cameras.triangles,
        cameras: cameras.cameras.len(),
        one_camera: sampled.into_iter().fold(SampledImages::default(), SampledImages::plus),
        surfels: image_histogram(&finder, &on_objects, "images of objects", cx)?,
        rays: image_histogram(&finder, &on_rays, "images on rays", cx)?,
        caustic,
        caustic_ms,
        slice,
        plane: mirror_slice(&scene, &cameras, &finder, PLANE, cx)?,
        class_picture: class_picture(&scene, &eye, &visibility, &classes),
        image_picture: double_image_picture(&scene, &eye, &visibility, ray_scale, &finder, cx)?,
        classes,
    })
}

fn check_triangle(wanted: Option<u32>, triangles: usize) -> Result<()> {
    match wanted {
        Some(triangle) if triangle as usize >= triangles => {
            let problem = format!("there is no mirror triangle {triangle}");
            let remedy = format!("choose one from 0 to {}", triangles - 1);
            Err(Error::input("--triangle", "", problem, remedy))
        }
        _ => Ok(()),
    }
}

/// The slice through the wanted triangle's camera, or the most folded one; `None` if no camera folds.
fn slice(
    wanted: Option<u32>,
    cameras: &MirrorCameras,
    sampled: &[SampledImages],
) -> Result<Option<CameraSlice>> {
    let list = &cameras.cameras;
    let refused = |triangle: u32, problem: &str| {
        let problem = format!("the camera of mirror triangle {triangle} {problem}");
        Err(Error::input("--triangle", "", problem, "choose another one, or leave it out"))
    };
    let camera = match wanted {
        None => {
            let several = |i: &usize| sampled[*i].several_share();
            let most =
                (0..list.len()).max_by(|a, b| several(a).total_cmp(&several(b)).then(b.cmp(a)));
            match most.filter(|i| several(i) > 0.0) {
                None => return Ok(None),
                Some(i) => &list[i],
            }
        }
        Some(triangle) => match list.iter().find(|camera| camera.triangle == triangle) {
            None => return refused(triangle, "looks away from the eye"),
            Some(camera) => camera,
        },
    };
    let triangle = camera.triangle;
    match (camera_slice(camera, SLICE), wanted) {
        (Some(slice), _) => {
            Ok(Some(CameraSlice { triangle, mixed: camera.mixed_intervals(), slice }))
        }
        (None, Some(_)) => refused(triangle, "sees every point once"),
        (None, None) => Ok(None),
    }
}

/// What the eye sees directly.
fn see(scene: &PreparedScene, eye: &Eye) -> Visibility {
    let (mirrors, objects) = (finish::mirror_surfaces(scene), finish::object_surfaces(scene));
    let mut visibility = Visibility::default();
    visibility.update(eye, &mirrors, &objects, &mut Scratch::default());
    visibility
}

/// Writes the files, each whole or not at all.
fn write(folder: &Path, findings: &Findings, value: &Value) -> anyhow::Result<()> {
    let caustic = ply::caustic(&findings.caustic)?;
    let histogram = plots::histogram(&[("objects", &findings.surfels), ("rays", &findings.rays)])?;
    let slice_plot = findings.slice.as_ref().map(plots::slice).transpose()?;
    if !folder.is_dir() {
        let failed = |e: std::io::Error| Error::Output {
            name: folder.display().to_string(),
            problem: e.kind().to_string(),
        };
        std::fs::create_dir(folder).map_err(failed)?;
    }
    let place = |name: &str| folder.join(name);
    write_picture(&place("classes.png"), &findings.class_picture)?;
    write_picture(&place("images.png"), &findings.image_picture)?;
    write_picture(&place("plane.png"), &findings.plane.picture())?;
    if let (Some(slice), Some(plot)) = (&findings.slice, slice_plot) {
        write_picture(&place("slice.png"), &slice.slice.picture())?;
        write_bytes(&place("slice.svg"), plot.as_bytes())?;
    } else {
        // None that an earlier analysis left: they need not be there.
        let _ = [place("slice.png"), place("slice.svg")].map(std::fs::remove_file);
    }
    write_bytes(&place("caustic.ply"), &caustic)?;
    write_bytes(&place("histogram.svg"), histogram.as_bytes())?;
    write_json(Some(&place("report.json")), value)?;
    write_bytes(&place("report.md"), report::markdown(findings).as_bytes())?;
    Ok(())
}
