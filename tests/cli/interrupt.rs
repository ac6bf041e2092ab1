//! Ctrl-C ends a run between stages: no picture, nothing half written.
#![cfg(unix)]

use std::process::Command;
use std::time::Duration;

use super::{Folder, Run, SMALL};

fn interrupted(line: &str) {
    let outputs = "-o out.png --aov out.exr --json out.json";
    ended(&Folder::new(), format!("render {line} {outputs} --repeat 10000"));
}

/// Runs words that would write out.png, and ends them.
fn ended(folder: &Folder, words: String) {
    folder.write("out.png", "old");
    let before = folder.listing();
    let child = folder.command(words.split_whitespace()).spawn().unwrap();
    // Long enough to be in the middle; whichever stage that is, the end is the same.
    std::thread::sleep(Duration::from_millis(1500));
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let run = Run::of(words, child);
    assert_eq!(run.code, Some(130), "{}", run.err);
    assert_eq!((run.err.as_str(), run.out.as_str()), ("cancelled: nothing was written\n", ""));
    assert_eq!(folder.listing(), before);
    assert_eq!(folder.read("out.png"), b"old");
}

#[test]
fn while_frames_are_rendered() {
    interrupted(SMALL);
}

#[test]
fn while_a_scene_is_prepared() {
    // Some three seconds of sampling, before two threads have shaded and sorted.
    interrupted("--size 160x90 --surfels 5000000");
}

#[test]
fn while_paths_are_written() {
    let folder = Folder::new();
    let row =
        |i: u32| format!("{} {} 1.5\n", f64::from(i % 1000) * 2e-3, f64::from(i / 1000) * 1e-3);
    folder.write("points.xyz", (0..2_000_000).map(row).collect::<String>());
    ended(&folder, "paths --mirror wave --points points.xyz -o out.npy --json out.json".into());
}
