//! How much memory the program may take: a share of the machine's, or as much as the user says. What needs more is refused
//! before it is taken, before the system ends the program without a word.

use catoptric::camera::eye::ImageSize;
use catoptric::context::MemoryLimit;
use catoptric::{Context, Result};
use sysinfo::{MemoryRefreshKind, RefreshKind, System};

/// Peak bytes a pixel (measured at 3840 x 2160 with AOVs: 165).
const PIXEL_BYTES: u64 = 170;
/// Of what is free, so much is taken at most, in percent: estimates are not exact, and others live here, too.
const SHARE: u64 = 80;

/// The limit that the user asks for, or else a share of what the machine has free.
pub(crate) fn limit(asked: Option<u64>) -> Option<MemoryLimit> {
    let bytes = asked.or_else(|| {
        let free = free()?;
        Some(taken().saturating_add(free / 100 * SHARE))
    })?;
    Some(MemoryLimit { bytes, taken })
}

/// The least that can be meant: a number below it lacks its unit.
const LEAST: f64 = 1024.0 * 1024.0;

/// Parses what `--max-memory` is given: bytes, or a number of K, M, G or T (times 1024), with or without B or iB.
pub(crate) fn parse(text: &str) -> Result<u64, String> {
    let wrong = || "give a size such as 8G or 500M".to_owned();
    let upper = text.trim().to_ascii_uppercase();
    let plain = upper.strip_suffix('B').map_or(&*upper, |t| t.strip_suffix('I').unwrap_or(t));
    let split = plain.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(plain.len());
    let (number, unit) = plain.split_at(split);
    let number: f64 = number.trim().parse().map_err(|_| wrong())?;
    let power = match unit {
        "" => 0,
        "K" => 1,
        "M" => 2,
        "G" => 3,
        "T" => 4,
        _ => return Err(wrong()),
    };
    let bytes = number * 1024_f64.powi(power);
    if !(LEAST..=1e18).contains(&bytes) {
        return Err(wrong());
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in that range")]
    Ok(bytes as u64)
}

/// # Errors
/// The picture is larger than the memory that may be taken.
pub(crate) fn check(size: ImageSize, cx: &Context) -> Result<()> {
    let bytes = PIXEL_BYTES.saturating_mul(size.pixels() as u64);
    cx.room_for("--size", &format!("{} x {} pixels", size.width, size.height), bytes)
}

/// Bytes that programs may still take, also within a container; `None` where the system does not say.
fn free() -> Option<u64> {
    let system = system()?;
    let free = system.available_memory();
    let free = system.cgroup_limits().map_or(free, |limits| free.min(limits.free_memory));
    (free > 0).then_some(free)
}

/// Bytes of the machine; `None` where the system does not say.
pub(crate) fn total() -> Option<u64> {
    Some(system()?.total_memory()).filter(|total| *total > 0)
}

fn system() -> Option<System> {
    let memory = MemoryRefreshKind::nothing().with_ram();
    System::new_with_specifics(RefreshKind::nothing().with_memory(memory)).ok()
}

/// Bytes that this program has taken; 0 where the system does not say.
fn taken() -> u64 {
    memory_stats::memory_stats().map_or(0, |stats| stats.physical_mem as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units() {
        for (text, bytes) in [
            ("1048576", 1 << 20),
            ("500M", 500 << 20),
            ("8G", 8 << 30),
            ("8GB", 8 << 30),
            ("1.5gib", 3 << 29),
            ("2 T", 2 << 40),
            ("2048k", 2 << 20),
        ] {
            assert_eq!(parse(text), Ok(bytes), "{text}");
        }
        for bad in ["", "G", "0", "10", "64k", "-1G", "nan", "inf", "1e40", "8X", "8GG", "1G2"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn the_program_knows_what_it_takes() {
        let ballast = std::hint::black_box(vec![1u8; 200 << 20]);
        let all = taken();
        assert!((150 << 20..1 << 36).contains(&all), "{all}");
        assert_eq!(ballast[1 << 20], 1);
        let limit = limit(None).unwrap();
        assert!(limit.bytes > taken() && limit.bytes < total().unwrap(), "{limit:?}");
        assert_eq!(super::limit(Some(5)).unwrap().bytes, 5);
    }

    #[test]
    fn large_pictures_are_refused() {
        let cx = Context::default().with_memory(Some(MemoryLimit { bytes: 4 << 30, taken: || 0 }));
        assert!(check(ImageSize { width: 1280, height: 720 }, &cx).is_ok());
        let error = check(ImageSize { width: 16_384, height: 16_384 }, &cx).unwrap_err();
        assert!(error.to_string().starts_with("--size: 16384 x 16384 pixels need about 45.6"));
    }
}
