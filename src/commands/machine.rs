//! What figures were measured on, and what else it did meanwhile. Linux says more than other systems, which would take
//! system calls that safe Rust has not.

use std::fs::read_to_string;
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};

use super::render::simd_name;

/// The machine as JSON: what is not known is null.
pub(crate) fn machine(adapters: &Value) -> Value {
    let cpu = read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("model name"))?;
        Some(line.trim_start_matches([' ', '\t', ':']).to_owned())
    });
    json!({
        "cpu": cpu,
        "cores": std::thread::available_parallelism().ok().map(std::num::NonZero::get),
        "threads": rayon::current_num_threads(),
        "simd": simd_name(),
        "memory_bytes": super::memory::total(),
        "system": format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        "adapters": adapters,
    })
}

/// Today in UTC, such as 2026-11-23.
pub(crate) fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    date(seconds / 86_400)
}

/// A day of the Gregorian calendar by its number since 1970 (H. Hinnant, chrono-compatible low-level date algorithms).
fn date(days: u64) -> String {
    let z = days + 719_468;
    let (era, of_era) = (z / 146_097, z % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = year + era * 400 + u64::from(month <= 2);
    format!("{year}-{month:02}-{day:02}")
}

/// Other programs take more than this share of the machine: times are not to be trusted.
pub(crate) const BUSY: f64 = 0.1;

/// What all cores have done so far, in the system's ticks.
#[derive(Clone, Copy)]
pub(crate) struct Load {
    all: u64,
    idle: u64,
    own: u64,
}

impl Load {
    /// `None` where the system does not say.
    pub(crate) fn now() -> Option<Self> {
        Self::of(&read_to_string("/proc/stat").ok()?, &read_to_string("/proc/self/stat").ok()?)
    }

    fn of(machine: &str, own: &str) -> Option<Self> {
        let numbers = |text: &str| -> Option<Vec<u64>> {
            text.split_whitespace().map(|word| word.parse().ok()).collect()
        };
        // user, nice, system, idle, iowait, irq, softirq, steal
        let machine = numbers(machine.lines().next()?.strip_prefix("cpu ")?)?;
        let machine = machine.get(..8)?;
        // Behind the name, which may hold anything, come state and ten more words.
        let (_, own) = own.rsplit_once(')')?;
        let own = numbers(&own.split_whitespace().skip(11).take(2).collect::<Vec<_>>().join(" "))?;
        Some(Self {
            all: machine.iter().sum(),
            idle: machine[3] + machine[4],
            own: own.iter().sum(),
        })
    }

    /// The share of the machine that others took since then, 0 to 1; `None` if no time has passed.
    pub(crate) fn others_until(self, now: Self) -> Option<f64> {
        let all = now.all.checked_sub(self.all).filter(|&ticks| ticks > 0)?;
        let idle = now.idle.saturating_sub(self.idle) + now.own.saturating_sub(self.own);
        Some(all.saturating_sub(idle) as f64 / all as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_those_of_the_calendar() {
        for (day, text) in [
            (0, "1970-01-01"),
            (59, "1970-03-01"),
            (11_016, "2000-02-29"),
            (20_780, "2026-11-23"),
            (20_819, "2027-01-01"),
        ] {
            assert_eq!(date(day), text);
        }
    }

    #[test]
    fn others_are_what_is_neither_idle_nor_own() {
        let stat = |user: u32, idle: u32| format!("cpu  {user} 0 0 {idle} 5 0 0 0 9 9\ncpu0 1\n");
        let own = |ticks: u32| format!("7 (a b) c) R 1 1 1 0 -1 4 9 0 1 0 {ticks} 1 0 0 20 0\n");
        let at = |user, idle, ticks| Load::of(&stat(user, idle), &own(ticks)).unwrap();
        let start = at(100, 1000, 10);
        assert_eq!(start.others_until(at(160, 1040, 40)), Some(0.3));
        assert_eq!(start.others_until(at(160, 1040, 70)), Some(0.0));
        assert_eq!(start.others_until(start), None);
        assert!(Load::of("nothing", "at all").is_none());
        #[cfg(target_os = "linux")]
        assert!(Load::now().is_some());
    }
}
