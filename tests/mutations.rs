//! Replays the fuzzing on stable Rust: the seeds, what fuzzing found, and mutations of the seeds that are the same in every run.
//!
//! `CATOPTRIC_MUTATIONS=1000000` makes a long run of it.

use std::fmt::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

#[path = "fuzz/entries.rs"]
#[allow(unreachable_pub, reason = "the targets of the fuzzer use it, too")]
mod entries;

/// Of all targets together, in the suite.
const MUTATIONS: usize = 18_000;
/// No input may take longer, seconds.
const LONGEST: Duration = Duration::from_secs(5);
/// Bytes that the whole run may take at its peak: what two cores' loads are allowed, twice, and the program itself.
const PEAK: u64 = 1 << 30;

/// The files of a kind of a target, by name.
fn files(kind: &str, target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz").join(kind).join(target);
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<PathBuf> =
        entries.map(|entry| entry.expect("entries are readable").path()).collect();
    paths.sort();
    paths
        .into_iter()
        .map(|path| {
            let bytes = std::fs::read(&path).expect("files are readable");
            (path, bytes)
        })
        .collect()
}

/// Runs an input: whether it was accepted, or what went wrong.
fn tried(target: &str, bytes: &[u8]) -> Result<bool, String> {
    let start = Instant::now();
    let done = catch_unwind(AssertUnwindSafe(|| entries::run(target, bytes)));
    let took = start.elapsed();
    match done {
        Err(_) => Err("panicked".into()),
        Ok(_) if took > LONGEST => Err(format!("took {:.1} s", took.as_secs_f64())),
        Ok(accepted) => Ok(accepted),
    }
}

fn seeds_are_good_and_found_cases_stay_mended() {
    let mut wrong = String::new();
    for target in entries::TARGETS {
        let seeds = files("seeds", target);
        assert!(seeds.len() >= 2, "{target}: there are seeds");
        for (path, bytes) in seeds {
            // Random scenes may be none, and a picture alone is no material.
            let may_refuse = target == "planner" || target == "mtl";
            match tried(target, &bytes) {
                Ok(accepted) if accepted || may_refuse => {}
                Ok(_) => writeln!(wrong, "{} is refused", path.display()).expect("strings grow"),
                Err(what) => writeln!(wrong, "{} {what}", path.display()).expect("strings grow"),
            }
        }
        for (path, bytes) in files("found", target) {
            if let Err(what) = tried(target, &bytes) {
                writeln!(wrong, "{} {what}", path.display()).expect("strings grow");
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// Numbers without end that depend on the seed only (Steele et al., SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        usize::try_from(self.next() % count.max(1) as u64).expect("as small as the count")
    }
}

/// What numbers in files are replaced by.
const WORDS: [&str; 12] = [
    "nan",
    "inf",
    "-1",
    "0",
    "1e40",
    "4294967295",
    "9999999999999999999",
    "-0",
    "",
    "1e-45",
    "\"",
    "{",
];
const NUMBERS: [u64; 8] =
    [0, 1, 0x7f, 0xffff, 0x7fff_ffff, 0xffff_ffff, 0x7fff_ffff_ffff_ffff, u64::MAX];

/// A seed with one to four things changed.
fn mutated(seeds: &[(PathBuf, Vec<u8>)], random: &mut Random) -> Vec<u8> {
    let mut bytes = seeds[random.below(seeds.len())].1.clone();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len());
        let end = (at + 1 + random.below(16)).min(bytes.len());
        match random.below(10) {
            _ if bytes.is_empty() => bytes.push(b'1'),
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next().to_le_bytes()[0],
            2 => drop(bytes.drain(at..end)),
            3 => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            4 => bytes.truncate(at),
            5 => {
                let number = NUMBERS[random.below(NUMBERS.len())].to_le_bytes();
                let width = [1, 2, 4, 8][random.below(4)].min(bytes.len() - at);
                bytes[at..at + width].copy_from_slice(&number[..width]);
            }
            6 | 7 => {
                // A number of a text.
                let is_digit = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-');
                let start = bytes[at..].iter().position(is_digit).map_or(at, |k| at + k);
                let length = bytes[start..].iter().take_while(|b| is_digit(b)).count();
                let word = WORDS[random.below(WORDS.len())].bytes();
                bytes.splice(start..start + length, word);
            }
            8 => {
                let other = &seeds[random.below(seeds.len())].1;
                let from = random.below(other.len());
                let part = other[from..(from + 64).min(other.len())].to_vec();
                bytes.splice(at..end, part);
            }
            _ => {
                let other = random.below(bytes.len());
                bytes.swap(at, other);
            }
        }
    }
    bytes
}

/// How many of the first indices are good. Each core has a pool of one thread: with a common one, an input would wait for others,
/// and its time would be theirs.
fn on_all_cores(count: usize, good: &(dyn Fn(usize) -> bool + Sync)) -> usize {
    let (next, accepted) = (AtomicUsize::new(0), AtomicUsize::new(0));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, std::num::NonZero::get) {
            scope.spawn(|| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
                pool.expect("a thread").install(|| {
                    loop {
                        let i = next.fetch_add(1, Ordering::Relaxed);
                        if i >= count {
                            break;
                        }
                        accepted.fetch_add(usize::from(good(i)), Ordering::Relaxed);
                    }
                });
            });
        }
    });
    accepted.into_inner()
}

#[test]
fn seeds_found_cases_and_mutations_do_no_harm() {
    seeds_are_good_and_found_cases_stay_mended();
    mutations_do_no_harm();
}

fn mutations_do_no_harm() {
    let asked = std::env::var("CATOPTRIC_MUTATIONS").ok().and_then(|n| n.parse().ok());
    let each = asked.unwrap_or(MUTATIONS) / entries::TARGETS.len();
    let wrong = Mutex::new(String::new());
    for (t, target) in entries::TARGETS.into_iter().enumerate() {
        let seeds = files("seeds", target);
        let start = Instant::now();
        let good = |i: usize| {
            let bytes = mutated(&seeds, &mut Random(((t as u64) << 40) + i as u64));
            tried(target, &bytes).unwrap_or_else(|what| {
                let name = std::env::temp_dir().join(format!("catoptric-{target}-{i}"));
                let kept = std::fs::write(&name, &bytes).is_ok();
                let mut wrong = wrong.lock().expect("no panic while it is held");
                let place = if kept { name.display().to_string() } else { String::new() };
                writeln!(wrong, "{target}: mutation {i} {what} {place}").expect("strings grow");
                false
            })
        };
        let accepted = on_all_cores(each, &good);
        println!("{target}: {accepted} of {each} accepted, {:.1} s", start.elapsed().as_secs_f64());
        // Else nothing would be tested but the first check of each reader.
        assert!(accepted * 100 > each, "{target}: only {accepted} of {each} were accepted");
    }
    let wrong = wrong.into_inner().expect("no panic while it was held");
    assert!(wrong.is_empty(), "{wrong}");
    if let Some(peak) = peak() {
        println!("peak: {} MB", peak >> 20);
        assert!(peak < PEAK, "{} MB were taken", peak >> 20);
    }
}

/// The most memory that this program has had, bytes, where the system says so.
fn peak() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}
