//! What each stage of a design takes: for people and benchmarks only, no result depends on it.

use std::fmt;
use std::time::{Duration, Instant};

use crate::tuning::{Progress, Watch};

/// Time and memory by stage, in the order in which they first ended.
#[derive(Debug, Clone)]
pub struct Clock {
    last: Instant,
    pub stages: Vec<Stage>,
}

/// One stage; several runs of it count together.
#[derive(Debug, Clone, Copy)]
pub struct Stage {
    pub name: &'static str,
    pub time: Duration,
    /// See [`peak_memory`]; at the end of the stage.
    pub peak: Option<u64>,
}

impl Clock {
    #[expect(clippy::new_without_default, reason = "a clock starts to run when it is made")]
    pub fn new() -> Self {
        Self { last: Instant::now(), stages: Vec::new() }
    }

    /// Everything since the last call was `name`.
    pub fn ended(&mut self, name: &'static str) {
        let now = Instant::now();
        let (time, peak) = (now - std::mem::replace(&mut self.last, now), peak_memory());
        match self.stages.iter_mut().find(|stage| stage.name == name) {
            Some(known) => *known = Stage { time: known.time + time, peak, ..*known },
            None => self.stages.push(Stage { name, time, peak }),
        }
    }

    pub fn total(&self) -> Duration {
        self.stages.iter().map(|stage| stage.time).sum()
    }

    /// One line per stage, and one for all.
    pub fn table(&self) -> String {
        let line = |name: &str, time: Duration, peak: Option<u64>| {
            let peak = peak.map_or_else(|| "-".to_owned(), |bytes| format!("{:.1}", bytes as f64 / f64::from(1 << 20)));
            format!("  {name:<12}{:>12.3}{peak:>20}\n", time.as_secs_f64())
        };
        let head = format!("  {:<12}{:>12}{:>20}\n", "stage", "seconds", "peak memory, MiB");
        let stages: String = self.stages.iter().map(|stage| line(stage.name, stage.time, stage.peak)).collect();
        head + &stages + &line("all", self.total(), self.stages.last().and_then(|stage| stage.peak))
    }
}

impl Watch for Clock {
    fn stage(&mut self, name: &'static str) {
        self.ended(name);
    }

    fn searched(&mut self, _: Progress) {}
}

/// Milliseconds, on lines of at most 100 columns.
impl fmt::Display for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
        write!(f, "{:.1} ms, of which\n ", milliseconds(self.total()))?;
        let mut column = 1;
        for (k, Stage { name, time, .. }) in self.stages.iter().enumerate() {
            let comma = if k + 1 < self.stages.len() { "," } else { "" };
            let item = format!(" {name} {:.1}{comma}", milliseconds(*time));
            if column + item.len() > 96 {
                write!(f, "\n ")?;
                column = 1;
            }
            column += item.len();
            f.write_str(&item)?;
        }
        Ok(())
    }
}

/// The most memory that this process has had so far, in bytes, where the system tells (Linux).
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    peak.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_one_stage_count_together() {
        let mut clock = Clock::new();
        ["Gains", "Sets", "Gains"].into_iter().for_each(|name| clock.ended(name));
        assert_eq!(clock.stages.iter().map(|stage| stage.name).collect::<Vec<_>>(), ["Gains", "Sets"]);
        assert_eq!(clock.table().lines().count(), 4);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn linux_tells_the_peak() {
        assert!(peak_memory().is_some_and(|bytes| bytes > 1 << 16));
    }
}
