//! Refuses what this machine's memory cannot hold, before the system ends the program without a word.

use catoptric::camera::eye::ImageSize;
use catoptric::{Error, Result};

/// Peak bytes a surfel (measured between 1 and 10 million: 126).
const SURFEL_BYTES: u64 = 130;
/// Peak bytes a pixel (measured at 3840 x 2160 with AOVs: 165).
const PIXEL_BYTES: u64 = 170;

/// # Errors
/// The scene or the picture is larger than the free memory, where the system says how much that is.
pub(crate) fn check(surfels: usize, size: ImageSize) -> Result<()> {
    free().map_or(Ok(()), |free| fits(surfels, size, free))
}

fn fits(surfels: usize, size: ImageSize, free: u64) -> Result<()> {
    let surfel_bytes = SURFEL_BYTES.saturating_mul(surfels as u64);
    let pixel_bytes = PIXEL_BYTES.saturating_mul(size.pixels() as u64);
    if surfel_bytes.saturating_add(pixel_bytes) <= free {
        return Ok(());
    }
    let (name, what) = if surfel_bytes > pixel_bytes {
        ("--surfels", format!("{surfels} surfels"))
    } else {
        ("--size", format!("{} x {} pixels", size.width, size.height))
    };
    let gigabytes = |bytes: u64| bytes as f64 * 1e-9;
    let problem = format!(
        "{what} need {:.1} GB of memory, of which {:.1} are free",
        gigabytes(surfel_bytes.max(pixel_bytes)),
        gigabytes(free)
    );
    Err(Error::input(name, "", problem, "choose fewer"))
}

/// Bytes that programs may still take; `None` where the system does not say.
fn free() -> Option<u64> {
    line("MemAvailable:")
}

/// A line of what Linux says about its memory, bytes: elsewhere it would take a system call, which safe Rust has not.
pub(crate) fn line(name: &str) -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.saturating_mul(1024))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_larger_part_is_named() {
        let size = |width, height| ImageSize { width, height };
        let refusal = |surfels, size| fits(surfels, size, 8_000_000_000).unwrap_err().to_string();
        assert!(fits(3_000_000, size(1280, 720), 1_000_000_000).is_ok());
        assert!(
            refusal(2_000_000_000, size(16, 9))
                .starts_with("--surfels: 2000000000 surfels need 260.0 GB")
        );
        assert!(
            refusal(10, size(16_384, 16_384))
                .starts_with("--size: 16384 x 16384 pixels need 45.6 GB")
        );
        // Each fits alone, but not both.
        assert!(fits(40_000_000, size(16, 9), 8_000_000_000).is_ok());
        assert!(refusal(40_000_000, size(8192, 4096)).contains("--size"));
        assert!(refusal(usize::MAX, size(16, 9)).contains("--surfels"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn linux_says_what_is_free() {
        let free = free().unwrap();
        assert!((1 << 20..1 << 50).contains(&free), "{free}");
    }
}
