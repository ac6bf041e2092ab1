//! `catoptric bench`: timings as ratios within one run.
//!
//! Data flows one way: a scene is prepared, `analysis::measure` lets its sides take turns, a bench makes a
//! [`report::Section`] of what they took, and `report` writes it.

mod agree;
mod all;
mod balance;
mod crossover;
mod curve;
mod growth;
mod layer;
pub(crate) mod methods;
mod report;
mod run;
mod tables;

use catoptric::Context;
use clap::{ArgMatches, Args, Subcommand};

pub(crate) use all::Kept;
use run::{RunArgs, single};

/// Measure, as ratios within one run
#[derive(Args, Debug)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    what: What,
}

/// What to measure.
#[derive(Subcommand, Debug)]
enum What {
    /// The reflected layer against ray tracing the same pixels, one ray each; their frames alternate
    ///
    /// The layer is everything from the list of visible triangles to resolved colours: patches, cameras,
    /// culling, projection, splatting, resolve and clear. The rays are traced by the best triangle BVH that we
    /// know of in Rust, in tile order on all cores. Neither side includes the id pre-pass, primary rays,
    /// environment or composite.
    Layer(layer::LayerArgs),
    /// Every method that can draw the scene against many rays a pixel: contact sheet, table, error against time
    ///
    /// Writes a folder: the pictures beside the reference with maps of their errors (sheet.png), a table (methods.md,
    /// methods.json: time by stage, RMSE, PSNR, FLIP, missing share, displacement in pixels, flicker over an orbit) and
    /// the error over the time with each method's quality knobs turned (error-against-time.svg).
    Methods(methods::MethodsArgs),
    /// The paper's Tables 1 and 2 on this machine: trees, culling, projection and valid shares of six numbers of points
    ///
    /// The given or built-in object (knot) stands before the 4,000-triangle teapot with 10, 37, 100, 147, 437 and 543
    /// thousand surfels: with everything as in the paper, the same with conservative box tests, and by our defaults, beside
    /// the paper's own figures (3.4 GHz Pentium 4, Quadro FX 3400).
    Tables(RunArgs),
    /// Culling against projection: leaves of 2 to 4096, every box test, details and backends; mirror triangles and parts
    ///
    /// Says where the least total is on this machine and why, and which setting is nearest to the paper's 20 % of valid
    /// projections.
    Balance(RunArgs),
    /// Time and memory over surfels (to 10^7, or --max), mirror triangles, pixels and curvature
    Growth(RunArgs),
    /// Against ray tracing at equal error: who wins where, over mirror triangles and pixels, and the break-even
    ///
    /// The paper conjectures that cameras pay where a mirror triangle covers enough pixels. For the scenes knot and room (or
    /// the given one) this measures where, against 1, 4 and 16 rays a pixel.
    Crossover(RunArgs),
    /// All of these in one report: report.html (one self-contained page), report.md, report.json and plots as SVG
    ///
    /// Writes the report anew after each section, so that Ctrl-C keeps what is done. --quick takes some minutes and says where
    /// the trends are; without it the figures can be quoted, if the machine had nothing else to do (the report says so).
    All(RunArgs),
    /// Whether two runs agree: their ratios side by side
    Agree(agree::AgreeArgs),
}

pub(crate) fn run(args: &BenchArgs, matches: &ArgMatches, cx: &Context) -> anyhow::Result<()> {
    match &args.what {
        What::Layer(args) => layer::run(args, matches, cx),
        What::Methods(args) => methods::run(args, cx),
        What::Tables(args) => single(args, cx, tables::section),
        What::Balance(args) => single(args, cx, balance::section),
        What::Growth(args) => single(args, cx, growth::section),
        What::Crossover(args) => single(args, cx, crossover::section),
        What::All(args) => all::run(args, cx),
        What::Agree(args) => agree::run(args),
    }
}
