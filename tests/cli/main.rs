//! The program as a user runs it: what it writes, what it says, and how it refuses what it cannot do.

#![expect(clippy::unwrap_used, reason = "a test fails where it panics")]

mod analyze;
mod bad_files;
mod bad_options;
mod bench;
mod environments;
#[cfg(feature = "gpu")]
mod gpu;
mod interrupt;
mod methods;
mod models;
mod paths;
mod runs;
mod same_bytes;
#[cfg(feature = "viewer")]
mod view;

use std::ffi::OsStr;
use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

/// Small enough that a run takes a fraction of a second.
const SMALL: &str = "--size 160x90 --surfels 20000";

/// No run here takes a tenth of this on a free machine; one that allocates by a false count would.
const LIMIT: Duration = Duration::from_secs(60);

/// A folder of its own, which is the current one of the programs that run in it.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> &Self {
        fs::write(self.path(name), bytes).unwrap();
        self
    }

    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).unwrap()
    }

    /// Names and sizes of everything in it.
    fn listing(&self) -> Vec<(std::ffi::OsString, u64)> {
        let entries = fs::read_dir(self.0.path()).unwrap().map(|entry| entry.unwrap());
        let mut list: Vec<_> =
            entries.map(|e| (e.file_name(), e.metadata().unwrap().len())).collect();
        list.sort();
        list
    }

    fn command(&self, words: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_catoptric"));
        command.args(words).current_dir(self.0.path());
        // Without it some Vulkan drivers complain on standard error.
        command.env("XDG_RUNTIME_DIR", self.0.path());
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// Runs to the end.
    fn finish(&self, mut command: Command) -> Run {
        Run::of(format!("{command:?}"), command.spawn().unwrap())
    }

    /// Runs the words of a line.
    fn run(&self, line: &str) -> Run {
        self.finish(self.command(words(line)))
    }

    /// Runs a line that must succeed, without a word on standard error.
    fn good(&self, line: &str) -> Run {
        let run = self.run(line);
        assert_eq!((run.code, run.err.as_str()), (Some(0), ""), "{}", run.line);
        assert!(!self.litter(), "{}: {:?}", run.line, self.listing());
        run
    }

    /// Runs a line that must succeed, with no more than notes on standard error. What it says, and the notes.
    fn ok(&self, line: &str) -> (String, String) {
        let run = self.run(line);
        assert_eq!(run.code, Some(0), "{}: {}", run.line, run.err);
        assert!(run.err.lines().all(|l| l.starts_with("note: ")), "{}: {}", run.line, run.err);
        (run.out, run.err)
    }

    /// Whether a file is left that was only meant to be there for a moment.
    fn litter(&self) -> bool {
        self.listing().iter().any(|(name, _)| name.to_string_lossy().starts_with('.'))
    }

    /// Runs a line that must be refused: exit code 2, one message with all of `expected` in it, nothing on
    /// standard output, and nothing written.
    fn refused(&self, line: &str, expected: &[&str]) {
        let before = self.listing();
        let run = self.run(line);
        let Run { line, code, out, err } = &run;
        assert_eq!(*code, Some(2), "{line}: {err}");
        assert_eq!(out, "", "{line}");
        assert_eq!(self.listing(), before, "{line}");
        assert!(err.starts_with("error: ") && err.matches("error: ").count() == 1, "{line}: {err}");
        assert!(!err.contains("panicked") && !err.contains("RUST_BACKTRACE"), "{line}: {err}");
        for part in expected {
            assert!(err.contains(part), "{line}: no {part:?} in {err}");
        }
        // Our own messages are one line: what is wrong; what to do. The rest come from the parser of arguments,
        // which points to --help.
        let (lines, own) = (err.lines().count(), err.contains("; "));
        assert!(own && lines == 1 || err.contains("--help"), "{line}: {err}");
    }
}

/// The words of a line; single quotes keep some together.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (i, part) in line.split('\'').enumerate() {
        match i % 2 {
            0 => words.extend(part.split_whitespace().map(str::to_owned)),
            _ => words.push(part.to_owned()),
        }
    }
    words
}

/// What a run did.
struct Run {
    line: String,
    code: Option<i32>,
    out: String,
    err: String,
}

impl Run {
    /// Waits for the end; a run beyond [`LIMIT`] is ended and fails the test.
    fn of(line: String, mut child: Child) -> Self {
        let start = Instant::now();
        while child.try_wait().unwrap().is_none() {
            if start.elapsed() > LIMIT {
                child.kill().unwrap();
                panic!("{line} takes more than {LIMIT:?}");
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        let Output { status, stdout, stderr } = child.wait_with_output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Self { line, code: status.code(), out: text(stdout), err: text(stderr) }
    }
}

/// Width and height of a PNG, which must have its signature and end.
fn png_size(bytes: &[u8]) -> [u32; 2] {
    assert!(
        bytes.starts_with(b"\x89PNG\r\n\x1a\n") && bytes[bytes.len() - 8..].starts_with(b"IEND")
    );
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
}

/// A unit octahedron as OBJ: a mesh of several faces that needs no library.
const OCTAHEDRON: &str = "v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\n\
    f 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n";
