//! `catoptric paths`: every image of the points of a file.

use std::path::PathBuf;
use std::time::Instant;

use catoptric::camera::RayScale;
use catoptric::image::io::check_place;
use catoptric::image::streamed::StreamedFile;
use catoptric::paths::table::{TableFormat, TableRows, TableWriter};
use catoptric::paths::{
    ImageCount, Occluder, PathFinder, PathOptions, PathScene, PathSet, Refinement,
};
use catoptric::scene::arrange::{self, Request};
use catoptric::scene::load::points::PointReader;
use catoptric::{Context, Error, Result};
use clap::Args;
use glam::DVec3;
use serde_json::{Value, json};

use super::{
    MAX_THREADS, ReadArgs, begin, check_apart, check_json, ms, point, say, tell, write_json,
};

/// Find every way of light from an eye over the mirrors to each point of a file
///
/// A point may have any number of images in a curved mirror. For each, the output has a row: where the mirror reflects it,
/// how long the path is, what hides it, how near a caustic is, and its ghost, where a range sensor at the eye would see the
/// point.
#[derive(Args, Debug)]
#[command(after_long_help = COLUMNS)]
pub(crate) struct PathsArgs {
    /// A built-in scene (default, room, knot), a scene file (.toml), or models (.obj, .ply, .stl, .gltf, .glb) to be set beside
    /// the teapot; a file that has mirrors of its own is a scene as it is
    #[arg(value_name = "SCENE|MODEL")]
    inputs: Vec<String>,
    /// Mirror: a mesh file, used as placed, or a built-in shape; repeatable
    #[arg(long, value_name = "FILE|NAME")]
    mirror: Vec<String>,
    /// Object that may stand in the way: a mesh file, used as placed, or a built-in shape; repeatable
    #[arg(long, value_name = "FILE|NAME")]
    object: Vec<String>,
    #[command(flatten)]
    read: ReadArgs,
    /// Eye position, world space (default: the scene's)
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    eye: Option<DVec3>,
    /// Points, world space: vertices of .ply or .obj, rows of .xyz, .csv or .txt (three numbers, or columns x, y, z) or .npy,
    /// records of .las or .laz
    #[arg(long, value_name = "FILE")]
    points: PathBuf,
    /// Table to write: .csv, .npy (structured) or .ply (a cloud of the ghosts); with --count, of the points
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Only count the images of each point
    #[arg(long, conflicts_with = "refine")]
    count: bool,
    /// Move each path from the mesh to the smooth surface: in closed form for sphere, ellipsoid, torus, bowl, wave and the
    /// cylinder's side, elsewhere by interpolated normals
    #[arg(long)]
    refine: bool,
    /// Length of a camera's three rays: exact for plane mirrors, or as in the paper
    #[arg(long, value_name = "WORD", default_value = "eye-distance", value_parser = ["eye-distance", "unit"])]
    ray_scale: String,
    /// Threads (default: all cores)
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(1..=MAX_THREADS))]
    threads: Option<u64>,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

const COLUMNS: &str = "\
Columns of a path (world space, lengths in the scene's unit; P is the mirror point, E the eye, Q the point):
  ghost_x ghost_y ghost_z   E + unit(P - E) (|EP| + |PQ|); x y z in PLY                        f64
  point mirror triangle     row or vertex of the file, mirror, triangle in its mesh, all from 0   u32
  w1 w2 w3                  barycentrics in the triangle                                       f64
  mirror_x mirror_y mirror_z   P                                                               f64
  lambda                    Q = v(w) + lambda d(w) in the triangle's 3-ray camera              f64
  length                    |EP| + |PQ|                                                        f64
  to_mirror_x _y _z         unit direction from E to P                                         f64
  to_point_x _y _z          unit direction from P to Q                                         f64
  det_j                     determinant of the camera's map at the image; 0 on a caustic       f64
  caustic_sine              sine between ray and the camera's moving triangle                  f64
  miss                      by how much the ray that the smooth surface reflects at P misses Q f64
  parity                    1 mirrored once, -1 once more                                      i8
  near_caustic              1 if caustic_sine < 0.01                                           u8
  eye_leg point_leg         hidden between E and P, P and Q: 0 no, 1 by a mirror, 2 by an object   u8
  occluded                  1 if either is hidden                                              u8
  refinement                P of: 0 the camera, 1 the smooth surface, 2 the camera, none found   u8
With --count: point_x point_y point_z (x y z in PLY), images, near_caustic.
A point on an edge between triangles has one image there, that of the lowest triangle.";

/// Points read, looked up and written together. The memory does not depend on how many there are.
const CHUNK: usize = 1 << 16;

pub(crate) fn run(args: &PathsArgs, cx: &Context) -> anyhow::Result<()> {
    let format = args.output.as_deref().map(format_of).transpose()?;
    check_json(args.json.as_ref())?;
    check_apart(&[
        ("--points", Some(&args.points)),
        ("--output", args.output.as_deref()),
        ("--json", args.json.as_deref()),
    ])?;
    begin(args.threads)?;
    let start = Instant::now();
    let request = Request {
        inputs: args.inputs.clone(),
        mirrors: args.mirror.clone(),
        objects: args.object.clone(),
        ..args.read.request(1, 1)
    };
    let mut reader = PointReader::open(&args.points)?;
    let scene = arrange::scene(&request, cx)?;
    tell(&scene.notes);
    let eye = args.eye.unwrap_or(scene.eye.position);
    let paths = PathScene::new(&scene);
    let options = PathOptions {
        ray_scale: if args.ray_scale == "unit" { RayScale::Unit } else { RayScale::EyeDistance },
        occlusion: true,
        refine: args.refine,
    };
    let finder = PathFinder::new(&paths, eye, options)?;
    let load_ms = start.elapsed().as_secs_f64() * 1e3;
    let start = Instant::now();
    let rows = if args.count { TableRows::Counts } else { TableRows::Paths };
    let table = match (&args.output, format) {
        (Some(path), Some(format)) => Some(Table::create(path, format, rows)?),
        _ => None,
    };
    let mut work =
        Work { finder: &finder, eye, only_count: args.count, table, summary: Summary::default() };
    work.all(&mut reader, cx)?;
    let Work { table, summary, .. } = work;
    if let Some(table) = table {
        table.finish()?;
    }
    let figures = Figures {
        scene: &scene.name,
        eye,
        mirror_triangles: paths.mirror_triangle_count(),
        cameras: finder.camera_count(),
        load_ms,
        paths_ms: start.elapsed().as_secs_f64() * 1e3,
    };
    figures.print(args, &summary);
    write_json(args.json.as_ref(), &figures.json(args, &summary))
}

fn format_of(path: &std::path::Path) -> Result<TableFormat> {
    let format = TableFormat::of(path).ok_or_else(|| {
        let remedy = "name a file that ends in .csv, .npy or .ply";
        Error::file(path, "", "not a table format that can be written", remedy)
    })?;
    check_place(path)?;
    Ok(format)
}

/// A table in the making.
struct Table {
    writer: TableWriter<StreamedFile>,
    path: PathBuf,
}

impl Table {
    fn create(path: &std::path::Path, format: TableFormat, rows: TableRows) -> Result<Self> {
        let file = StreamedFile::create(path)?;
        let writer = TableWriter::new(file, format, rows);
        let path = path.to_owned();
        Ok(Self { writer: writer.map_err(|e| failed(&path, &e))?, path })
    }

    fn write(&mut self, eye: DVec3, chunk: &Chunk) -> Result<()> {
        let written = match &chunk.found {
            Found::Paths(set) => self.writer.paths(eye, chunk.first, &chunk.points, set),
            Found::Counts(counts) => self.writer.counts(&chunk.points, counts),
        };
        written.map_err(|e| failed(&self.path, &e))
    }

    fn finish(self) -> Result<()> {
        let file = self.writer.finish().map_err(|e| failed(&self.path, &e))?;
        file.finish()
    }
}

fn failed(path: &std::path::Path, error: &std::io::Error) -> Error {
    Error::Output { name: path.display().to_string(), problem: error.kind().to_string() }
}

/// Some points and what was found out about them.
struct Chunk {
    first: u64,
    points: Vec<DVec3>,
    found: Found,
}

enum Found {
    Paths(PathSet),
    Counts(Vec<ImageCount>),
}

struct Work<'a> {
    finder: &'a PathFinder<'a>,
    eye: DVec3,
    only_count: bool,
    table: Option<Table>,
    summary: Summary,
}

impl Work<'_> {
    /// Reads, looks up and writes one chunk behind the other: three chunks are under way at once.
    fn all(&mut self, reader: &mut PointReader, cx: &Context) -> Result<()> {
        let mut first = 0;
        let mut read = reader.read(CHUNK)?;
        let mut done: Option<Chunk> = None;
        while !read.is_empty() || done.is_some() {
            cx.step("paths", reader.done())?;
            let points = std::mem::take(&mut read);
            let count = points.len() as u64;
            if first + count > u64::from(u32::MAX) {
                let problem = "more than 4294967295 points";
                return Err(Error::input("--points", "", problem, "split the file"));
            }
            let (finder, only_count) = (self.finder, self.only_count);
            let ((next, found), written) = rayon::join(
                || {
                    rayon::join(
                        || reader.read(CHUNK),
                        || look_up(finder, only_count, points, first, cx),
                    )
                },
                || done.as_ref().map_or(Ok(()), |chunk| self.write(chunk)),
            );
            written?;
            done = found?;
            read = if count == 0 { Vec::new() } else { next? };
            first += count;
        }
        Ok(())
    }

    fn write(&mut self, chunk: &Chunk) -> Result<()> {
        self.summary.add(chunk);
        match &mut self.table {
            Some(table) => table.write(self.eye, chunk),
            None => Ok(()),
        }
    }
}

fn look_up(
    finder: &PathFinder,
    only_count: bool,
    points: Vec<DVec3>,
    first: u64,
    cx: &Context,
) -> Result<Option<Chunk>> {
    if points.is_empty() {
        return Ok(None);
    }
    let found = if only_count {
        Found::Counts(finder.count(&points, cx)?)
    } else {
        Found::Paths(finder.find(&points, cx)?)
    };
    Ok(Some(Chunk { first, points, found }))
}

/// What all points have in common.
#[derive(Default)]
struct Summary {
    points: u64,
    images: u64,
    /// Points with none, one, two, more images.
    by_images: [u64; 4],
    near_caustic: u64,
    /// Of paths: hidden by a mirror, else by an object.
    hidden: [u64; 2],
    refined: u64,
    failed: u64,
    miss_sum: f64,
    miss_max: f64,
}

impl Summary {
    fn add(&mut self, chunk: &Chunk) {
        match &chunk.found {
            Found::Counts(counts) => {
                for count in counts {
                    self.point(u64::from(count.images), count.near_caustic);
                }
            }
            Found::Paths(set) => {
                for paths in (0..set.points()).map(|i| set.of(i)) {
                    self.point(paths.len() as u64, paths.iter().any(|p| p.near_caustic()));
                    for path in paths {
                        let legs = [path.eye_leg, path.point_leg];
                        if legs.contains(&Occluder::Mirror) {
                            self.hidden[0] += 1;
                        } else if legs.contains(&Occluder::Object) {
                            self.hidden[1] += 1;
                        }
                        self.refined += u64::from(path.refinement == Refinement::Surface);
                        self.failed += u64::from(path.refinement == Refinement::Failed);
                        self.miss_sum += path.miss;
                        self.miss_max = self.miss_max.max(path.miss);
                    }
                }
            }
        }
    }

    fn point(&mut self, images: u64, near_caustic: bool) {
        self.points += 1;
        self.images += images;
        self.by_images[usize::try_from(images.min(3)).unwrap_or(3)] += 1;
        self.near_caustic += u64::from(near_caustic);
    }
}

/// What is said beside the summary.
struct Figures<'a> {
    scene: &'a str,
    eye: DVec3,
    mirror_triangles: usize,
    cameras: usize,
    load_ms: f64,
    paths_ms: f64,
}

impl Figures<'_> {
    fn print(&self, args: &PathsArgs, found: &Summary) {
        let Self { cameras, mirror_triangles, .. } = self;
        say!("{}: {cameras} of {mirror_triangles} mirror triangles face the eye", self.scene);
        let percent = |part: u64, all: u64| 100.0 * part as f64 / all.max(1) as f64;
        let [none, one, two, more] = found.by_images.map(|n| percent(n, found.points));
        let Summary { points, images, .. } = found;
        say!("points        {points}, {:.2} images each", *images as f64 / *points as f64);
        say!(
            "images        0: {none:.2} %, 1: {one:.2} %, 2: {two:.2} %, 3 or more: {more:.2} % of the points"
        );
        say!("near caustic  {:.2} % of the points", percent(found.near_caustic, *points));
        if !args.count {
            let [mirror, object] = found.hidden.map(|n| percent(n, *images));
            say!(
                "hidden        {mirror:.2} % of the paths by a mirror, {object:.2} % by an object"
            );
            let mean = found.miss_sum / (*images).max(1) as f64;
            say!("miss          mean {mean:.3e}, largest {:.3e}", found.miss_max);
        }
        if args.refine {
            let [done, failed] = [found.refined, found.failed].map(|n| percent(n, *images));
            say!(
                "refined       {done:.2} % of the paths; not found on the smooth surface {failed:.2} %"
            );
        }
        say!("ms            load {:.0}, paths {:.0}", self.load_ms, self.paths_ms);
    }

    fn json(&self, args: &PathsArgs, found: &Summary) -> Value {
        let paths = |value: Value| if args.count { Value::Null } else { value };
        let misses = |value: f64| {
            if args.count || found.images == 0 { Value::Null } else { json!(value) }
        };
        let refined = |value: u64| if args.refine { json!(value) } else { Value::Null };
        json!({
            "scene": self.scene,
            "eye": self.eye.to_array(),
            "mirror_triangles": self.mirror_triangles,
            "cameras": self.cameras,
            "points": found.points,
            "images": found.images,
            "points_by_images": found.by_images,
            "points_near_caustic": found.near_caustic,
            "hidden_by_mirror": paths(json!(found.hidden[0])),
            "hidden_by_object": paths(json!(found.hidden[1])),
            "miss_mean": misses(found.miss_sum / found.images.max(1) as f64),
            "miss_max": misses(found.miss_max),
            "refined": refined(found.refined),
            "not_refined": refined(found.failed),
            "threads": rayon::current_num_threads(),
            "ms": { "load": ms(Some(self.load_ms)), "paths": ms(Some(self.paths_ms)) },
        })
    }
}
