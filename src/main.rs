//! The command line: see `catoptric --help`.

mod commands;

use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::Ordering;
use std::time::Instant;

use catoptric::{Context, Error, Progress};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};

use commands::bench::{BenchArgs, Kept};
use commands::render::{HowArgs, RenderArgs};
#[cfg(feature = "viewer")]
use commands::view::ViewArgs;
use commands::{SceneArgs, say, with_method_flags};

/// Accurate reflections on curved mirrors, without ray-tracing hardware
///
/// Without a command: the built-in scene in a window, or as a picture where there is no display.
#[derive(Parser, Debug)]
#[command(
    version,
    after_help = "Try `catoptric view room`, or `catoptric render MODEL.obj` with a model of yours."
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Verb>,
    /// Memory that may be taken, such as 8G (default: 80 % of what is free); what needs more is refused
    #[arg(long, global = true, value_name = "SIZE", value_parser = commands::memory::parse)]
    max_memory: Option<u64>,
}

#[derive(Subcommand, Debug)]
enum Verb {
    #[cfg(feature = "viewer")]
    View(Box<ViewArgs>),
    Render(Box<RenderArgs>),
    Compare(commands::compare::Args),
    Info(commands::info::InfoArgs),
    Bench(Box<BenchArgs>),
    Analyze(Box<commands::analyze::AnalyzeArgs>),
    Paths(commands::paths::PathsArgs),
}

fn main() -> ExitCode {
    let started = Instant::now();
    let command = Cli::command()
        .mut_subcommand("render", with_method_flags)
        .mut_subcommand("bench", |bench| bench.mut_subcommand("layer", with_method_flags));
    #[cfg(feature = "viewer")]
    let command = command.mut_subcommand("view", with_method_flags);
    let matches = command.get_matches();
    let cli = match Cli::from_arg_matches(&matches) {
        Ok(cli) => cli,
        Err(error) => error.exit(),
    };
    quiet_decoder();
    let bars = Arc::new(Bars::default());
    let cx = Context::new(Arc::clone(&bars) as Arc<dyn Progress>)
        .with_memory(commands::memory::limit(cli.max_memory));
    let cancel = cx.cancel_flag();
    // A second Ctrl-C does not wait for the stage to end; outputs are renamed into place, so none is broken.
    let handler = ctrlc::set_handler(move || {
        if cancel.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    let done = handler.map_err(Into::into).and_then(|()| run(&cli, &matches, started, &cx));
    bars.end();
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if matches!(error.downcast_ref(), Some(Error::Cancelled)) => {
            match error.downcast_ref::<Kept>() {
                Some(kept) => complain(&kept.to_string()),
                None => complain("cancelled: nothing was written"),
            }
            ExitCode::from(130)
        }
        Err(error) => {
            complain(&format!("error: {error:#}"));
            ExitCode::from(2)
        }
    }
}

/// The LAZ decoder panics on some damaged files, in a thread of its own that the reader expects to end so: what it says is no
/// news, and an error follows.
fn quiet_decoder() {
    let standard = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if std::thread::current().name() != Some("las") {
            standard(panic);
        }
    }));
}

/// One line on standard error, where someone may have stopped listening.
fn complain(message: &str) {
    let _ = writeln!(std::io::stderr(), "{message}");
}

fn run(
    cli: &Cli,
    matches: &clap::ArgMatches,
    started: Instant,
    cx: &Context,
) -> anyhow::Result<()> {
    let verb = matches.subcommand().map(|(_, own)| own);
    match (&cli.command, verb) {
        #[cfg(feature = "viewer")]
        (Some(Verb::View(args)), Some(own)) => commands::view::run(args, own, started, cx),
        (Some(Verb::Render(args)), Some(own)) => commands::render::run(args, own, cx),
        (Some(Verb::Compare(args)), _) => commands::compare::run(args.clone()),
        (Some(Verb::Info(args)), _) => commands::info::run(args, cx),
        (Some(Verb::Analyze(args)), _) => commands::analyze::run(args, cx),
        (Some(Verb::Paths(args)), _) => commands::paths::run(args, cx),
        (Some(Verb::Bench(args)), Some(own)) => {
            let own = own.subcommand().map_or(own, |(_, own)| own);
            commands::bench::run(args, own, cx)
        }
        _ => built_in_scene(started, cx),
    }
}

/// What the program does if it is told nothing.
fn built_in_scene(started: Instant, cx: &Context) -> anyhow::Result<()> {
    let nothing = clap::ArgMatches::default();
    #[cfg(feature = "viewer")]
    match commands::view::run(&commands::view::ViewArgs::standard(), &nothing, started, cx) {
        Err(error) if !matches!(error.downcast_ref(), Some(Error::Cancelled)) => {
            complain(&format!("{error:#}"));
        }
        done => return done,
    }
    let _ = started;
    let args = RenderArgs {
        scene: SceneArgs::default_scene(),
        how: HowArgs::standard(),
        output: "catoptric.png".into(),
        aov: None,
        json: None,
        repeat: 1,
        frames: None,
        orbit: 360.0,
    };
    say!("No window: rendering the built-in scene to a picture instead.");
    commands::render::run(&args, &nothing, cx)?;
    let place = std::path::absolute(&args.output)?;
    say!("The picture is {}. Try `catoptric render --help` next.", place.display());
    Ok(())
}

/// A bar on standard error for the stage under way; nothing where that is not a terminal.
#[derive(Default)]
struct Bars(Mutex<Option<(String, ProgressBar)>>);

impl Bars {
    fn end(&self) {
        if let Ok(mut open) = self.0.lock()
            && let Some((_, bar)) = open.take()
        {
            bar.finish_and_clear();
        }
    }
}

/// Steps of a bar.
const STEPS: f64 = 1000.0;

impl Progress for Bars {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to STEPS")]
    fn report(&self, stage: &str, done: f64) {
        if !std::io::stderr().is_terminal() {
            return;
        }
        let Ok(mut open) = self.0.lock() else { return };
        let same = open.as_ref().is_some_and(|(name, _)| name == stage);
        if !same {
            if let Some((_, bar)) = open.take() {
                bar.finish_and_clear();
            }
            let style = ProgressStyle::with_template("{msg:>16} [{bar:40}] {eta}");
            let bar = ProgressBar::new(STEPS as u64)
                .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
                .with_message(stage.to_owned());
            *open = Some((stage.to_owned(), bar));
        }
        if let Some((_, bar)) = open.as_ref() {
            bar.set_position((done.clamp(0.0, 1.0) * STEPS) as u64);
        }
    }
}
