//! `catoptric render`: a scene to a picture.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

#[cfg(feature = "gpu")]
use catoptric::backend::gpu;
use catoptric::backend::{Backend, cpu::Cpu, fastest};
use catoptric::camera::eye::ImageSize;
use catoptric::frame::{FrameReport, Renderer};
use catoptric::geometry::lanes::simd_level;
use catoptric::image::aov::{self, write_aov};
use catoptric::image::io::{check_output, write_picture};
use catoptric::image::temporal::{Restlessness, Sequence};
use catoptric::methods::Method;
use catoptric::scene::prepared::PrepareTimes;
use catoptric::{Context, Error};
use clap::{ArgMatches, Args};
use serde_json::{Value, json};

use super::{Ready, SceneArgs, check_apart, check_json, chosen_method, ms, say, write_json};

/// Render a scene to a picture
#[derive(Args, Debug)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    #[command(flatten)]
    pub(crate) how: HowArgs,
    /// Picture to write: .png (8-bit sRGB), .exr or .hdr (linear)
    #[arg(short, long, value_name = "FILE", default_value = "catoptric.png")]
    pub(crate) output: PathBuf,
    /// Also write what every mirror pixel shows, as a multi-layer EXR
    #[arg(long, value_name = "FILE.exr")]
    pub(crate) aov: Option<PathBuf>,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    /// Render so often and report medians
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(crate) repeat: u32,
    /// Draw frames of an orbit about the target, --output with a number each, and report how restless they are
    #[arg(long, value_name = "N", conflicts_with_all = ["repeat", "aov"], allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) frames: Option<u32>,
    /// How far the eye moves in these frames, to the right, in degrees (a whole turn ends one frame before it began)
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 360.0,
        requires = "frames",
        allow_hyphen_values = true
    )]
    pub(crate) orbit: f64,
}

/// Method and backend.
#[derive(Args, Debug)]
pub(crate) struct HowArgs {
    /// Reflection method: c3rc, raytrace, estalella, roger-holzschuch or environment
    #[arg(long, value_name = "ID", default_value = "c3rc")]
    pub(crate) method: String,
    /// Where it runs: auto (whatever is fastest here), cpu or gpu
    #[arg(long, value_name = "ID", default_value = "auto", value_parser = ["auto", "cpu", "gpu"])]
    pub(crate) backend: String,
    /// Graphics adapter, also a software one: a part of its name, or its number in `info --adapters`; means --backend gpu
    #[arg(long, value_name = "NAME|INDEX")]
    pub(crate) adapter: Option<String>,
    /// Where the GPU projects: in compute shaders, or in a vertex shader as in the paper
    #[arg(long, value_name = "PATH", default_value = "compute", value_parser = ["compute", "vertex"])]
    pub(crate) gpu_path: String,
    /// Count also what costs time to count: on the GPU, the points with an image (compute path)
    #[arg(long)]
    pub(crate) stats: bool,
    /// Named set of parameters (paper: everything as Mei et al. had it)
    #[arg(long, value_name = "NAME")]
    pub(crate) preset: Option<String>,
    /// Time against error: sets the method's parameters for that together
    #[arg(long, value_name = "WORD", default_value = "default", conflicts_with = "preset",
        value_parser = ["draft", "default", "best"])]
    pub(crate) quality: String,
}

impl HowArgs {
    /// The defaults.
    pub(crate) fn standard() -> Self {
        Self {
            method: "c3rc".into(),
            backend: "auto".into(),
            adapter: None,
            gpu_path: "compute".into(),
            stats: false,
            preset: None,
            quality: "default".into(),
        }
    }

    /// A renderer on the backend that is asked for.
    pub(crate) fn renderer(&self, method: &dyn Method) -> anyhow::Result<Renderer> {
        Ok(Renderer::on(self.backend(method)?))
    }

    /// The backend that is asked for.
    pub(crate) fn backend(&self, method: &dyn Method) -> Result<Box<dyn Backend>, Error> {
        Ok(match self.backend.as_str() {
            "cpu" if self.adapter.is_some() => {
                let problem = "is for --backend gpu";
                return Err(Error::input("--adapter", "", problem, "leave one of the two out"));
            }
            "cpu" => Box::new(Cpu::default()),
            "gpu" => self.gpu(method)?,
            _ if self.adapter.is_some() => self.gpu(method)?,
            _ => fastest(method.info().has_shaders),
        })
    }

    #[cfg(feature = "gpu")]
    fn gpu(&self, method: &dyn Method) -> Result<Box<dyn Backend>, Error> {
        if !method.info().has_shaders {
            let problem = format!("--method {} has no shaders", method.info().id);
            let (option, remedy) = match self.adapter {
                Some(_) => ("--adapter", "leave it out"),
                None => ("--backend gpu", "use --backend cpu, or auto"),
            };
            return Err(Error::input(option, "", problem, remedy));
        }
        if self.gpu_path == "vertex" && method.info().id != "c3rc" {
            let problem = format!("is for c3rc, and {} has one path", method.info().id);
            return Err(Error::input("--gpu-path", "", problem, "leave it out"));
        }
        let path = match self.gpu_path.as_str() {
            "vertex" => gpu::Path::Vertex,
            _ => gpu::Path::Compute,
        };
        let options = gpu::Options {
            adapter: self.adapter.clone(),
            path,
            stats: self.stats,
            ..Default::default()
        };
        Ok(Box::new(gpu::Gpu::new(options)?))
    }

    #[cfg(not(feature = "gpu"))]
    fn gpu(&self, _method: &dyn Method) -> Result<Box<dyn Backend>, Error> {
        let problem = "this program was built without the feature gpu";
        Err(Error::input("--backend gpu", "", problem, "use --backend cpu"))
    }
}

pub(crate) fn run(args: &RenderArgs, matches: &ArgMatches, cx: &Context) -> anyhow::Result<()> {
    check_output(&args.output)?;
    if let Some(path) = &args.aov {
        aov::check_output(path)?;
    }
    check_json(args.json.as_ref())?;
    check_apart(&[
        ("--output", Some(&args.output)),
        ("--aov", args.aov.as_deref()),
        ("--json", args.json.as_deref()),
    ])?;
    let (method, params, leaf) = chosen_method(&args.how, matches)?;
    // Before the scene: what is refused is to be refused at once.
    let mut renderer = args.how.renderer(method)?;
    let ready = args.scene.ready(leaf, cx)?;
    if !args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        renderer.keep_bright();
    }
    let mut reports = Vec::new();
    let mut sequence = Sequence::default();
    let turn = args.orbit.to_radians();
    let count = args.frames.unwrap_or(args.repeat);
    for i in 0..count {
        let share = f64::from(i) / f64::from(count);
        if count > 1 {
            cx.step("rendering", share)?;
        }
        // The planes come with the last frame, and cost the timed ones nothing.
        let planes = args.aov.is_some() && i + 1 == count;
        let eye = match args.frames {
            Some(_) => ready.orbited(turn * share)?,
            None => ready.eye,
        };
        reports.push(renderer.render(&ready.scene, &eye, method, &params, planes, cx)?);
        if args.frames.is_some() {
            write_picture(&numbered(&args.output, i), renderer.picture())?;
            let on = renderer.coverage().iter().map(|&c| c >= 0.5).collect();
            sequence.add(&renderer.picture().rgb, on);
        }
    }
    let report = FrameReport::median(&reports);
    cx.step("writing", 1.0)?;
    if let Some(frames) = args.frames {
        let figures = orbit_figures(&ready, &report, frames, args.orbit, sequence.figures());
        write_json(args.json.as_ref(), &figures)?;
        print(&numbered(&args.output, frames - 1), &ready, &report);
        print_orbit(frames, args.orbit, sequence.figures());
        return Ok(());
    }
    write_picture(&args.output, renderer.picture())?;
    if let (Some(path), Some(planes)) = (&args.aov, renderer.planes()) {
        let names: Vec<String> = ready.scene.objects.iter().map(|o| o.name.clone()).collect();
        write_aov(path, planes, &names)?;
    }
    write_json(args.json.as_ref(), &figures(&ready, &report))?;
    print(&args.output, &ready, &report);
    Ok(())
}

/// `picture.png` as `picture-0007.png`.
fn numbered(path: &Path, frame: u32) -> PathBuf {
    let text = |part: Option<&OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let name = format!("{}-{frame:04}.{}", text(path.file_stem()), text(path.extension()));
    path.with_file_name(name)
}

fn orbit_figures(
    ready: &Ready,
    report: &FrameReport,
    frames: u32,
    degrees: f64,
    found: Restlessness,
) -> Value {
    let mut value = figures(ready, report);
    value["orbit"] = json!({
        "frames": frames,
        "degrees": degrees,
        "second_difference": found.second_difference,
        "rms_median": found.rms_median,
        "rms_max": found.rms_max,
    });
    value
}

fn print_orbit(frames: u32, degrees: f64, found: Restlessness) {
    let Restlessness { second_difference, rms_median, rms_max } = found;
    if let (Some(second), Some(median), Some(max)) = (second_difference, rms_median, rms_max) {
        say!(
            "  {frames} frames over {degrees} degrees (times are medians); second difference {second:.5}, \
             change from frame to frame {median:.5} (largest {max:.5}), linear RGB where objects are reflected"
        );
    }
}

/// The backend, with its device.
pub(crate) fn where_it_ran(report: &FrameReport) -> String {
    let device = report.device.as_ref().map_or(String::new(), |device| format!(" ({device})"));
    format!("{}{device}", report.backend)
}

/// The keys that the README documents. A stage that was not timed apart is null, and so is what the method has
/// none of.
pub(crate) fn figures(ready: &Ready, report: &FrameReport) -> Value {
    let scene = &ready.scene;
    let subject = Subject {
        scene: &scene.name,
        surfels: scene.surfel_count(),
        mirror_triangles: scene.mirror_triangle_count(),
        size: ready.eye.size,
        load_ms: ready.load_ms,
        times: scene.times,
    };
    subject.figures(report)
}

/// What figures are about.
pub(crate) struct Subject<'a> {
    pub(crate) scene: &'a str,
    pub(crate) surfels: usize,
    pub(crate) mirror_triangles: usize,
    pub(crate) size: ImageSize,
    pub(crate) load_ms: f64,
    pub(crate) times: PrepareTimes,
}

impl Subject<'_> {
    /// See [`figures`].
    pub(crate) fn figures(&self, report: &FrameReport) -> Value {
        json!({
            "scene": self.scene,
            "method": report.method,
            "backend": report.backend,
            "device": report.device,
            "size": [self.size.width, self.size.height],
            "surfels": self.surfels,
            "mirror_triangles": self.mirror_triangles,
            "cameras": report.cameras,
            "batches": report.batches,
            "projections": report.projections,
            "valid": report.valid,
            "valid_share": report.valid_share(),
            "mean_steps": report.mean_steps(),
            "mirror_pixels": report.mirror_pixels,
            "covered_pixels": report.covered_pixels,
            "notes": report.notes,
            "threads": rayon::current_num_threads(),
            "simd": simd_name(),
            "ms": {
                "load": ms(Some(self.load_ms)),
                "sample": ms(Some(self.times.sample_ms)),
                "tree": ms(Some(self.times.tree_ms)),
                "shade": ms(Some(self.times.shade_ms)),
                "ids": ms(report.ids_ms),
                "cameras": ms(report.cameras_ms),
                "cull": ms(report.cull_ms),
                "project": ms(report.project_ms),
                "splat": ms(report.splat_ms),
                "layer": ms(report.layer_ms),
                "rays": ms(report.rays_ms),
                "composite": ms(report.composite_ms),
                "frame": ms(report.frame_ms),
            },
        })
    }
}

/// The instruction set in use, such as `avx2`.
pub(crate) fn simd_name() -> String {
    let level = format!("{:?}", simd_level());
    level.split('(').next().unwrap_or_default().to_ascii_lowercase()
}

fn print(output: &Path, ready: &Ready, report: &FrameReport) {
    let size = ready.eye.size;
    say!(
        "{}: {} x {}, {} by {} on {}",
        output.display(),
        size.width,
        size.height,
        ready.scene.name,
        report.method,
        where_it_ran(report)
    );
    say!(
        "  {} surfels, {} mirror triangles, {} mirror pixels",
        ready.scene.surfel_count(),
        ready.scene.mirror_triangle_count(),
        report.mirror_pixels
    );
    if let (Some(cameras), Some(batches), Some(projections)) =
        (report.cameras, report.batches, report.projections)
    {
        let share = report.valid_share();
        let valid = share.map_or(String::new(), |share| format!(", {:.1} % valid", share * 100.0));
        say!("  {cameras} cameras, {batches} batches, {projections} projections{valid}");
    } else if let (Some(searched), Some(reflected)) = (report.projections, report.valid) {
        let steps = report.mean_steps().unwrap_or(0.0);
        say!("  {searched} points searched for in {steps:.1} steps each, {reflected} reflected");
    }
    let stages = [
        ("visibility", report.ids_ms),
        ("cameras", report.cameras_ms),
        ("culling", report.cull_ms),
        ("projection", report.project_ms),
        ("splatting", report.splat_ms),
        ("reflected layer", report.layer_ms),
        ("reflected rays", report.rays_ms),
        ("composite", report.composite_ms),
        ("frame", report.frame_ms),
    ];
    let timed = stages.iter().filter_map(|(name, ms)| ms.map(|ms| format!("{name} {ms:.1}")));
    say!("  ms: {}", timed.collect::<Vec<_>>().join(", "));
    for note in &report.notes {
        say!("  note: {note}");
    }
}
