//! What is built for, and with which compiler.

use std::path::PathBuf;
use std::process::Command;

/// A machine, and the compiler for it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    /// As rustc calls it; `None` is the machine that the compiler runs on.
    pub triple: Option<String>,
    /// As rustc's `-C target-cpu` has it.
    pub cpu: Option<String>,
}

/// What a compiler says of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Version {
    /// `1.95.0`
    pub release: String,
    /// The machine it runs on.
    pub host: String,
}

impl Target {
    /// The machine that the compiler runs on.
    pub const HOST: Self = Self { triple: None, cpu: None };

    /// `host`, `thumbv7em-none-eabihf` or, with a processor, `thumbv7em-none-eabihf/cortex-m7`.
    pub fn new(text: &str) -> Self {
        let (triple, cpu) = text.split_once('/').map_or((text, None), |(triple, cpu)| (triple, Some(cpu)));
        Self { triple: (triple != "host").then(|| triple.to_owned()), cpu: cpu.map(str::to_owned) }
    }

    /// As in [`Target::new`], with the host by its own name.
    ///
    /// # Errors
    /// The compiler cannot be asked.
    pub fn name(&self) -> Result<String, String> {
        let triple = self.triple.clone().map_or_else(|| self.version().map(|version| version.host), Ok)?;
        Ok([Some(triple), self.cpu.clone()].into_iter().flatten().collect::<Vec<_>>().join("/"))
    }

    /// The compiler: the environment's `RUSTC_<TRIPLE>`, in upper case and with underscores, else its `RUSTC`, else `rustc`.
    pub fn rustc(&self) -> PathBuf {
        let own =
            self.triple.as_ref().map(|triple| format!("RUSTC_{}", triple.to_uppercase().replace(['-', '.'], "_")));
        let own = own.and_then(std::env::var_os);
        own.or_else(|| std::env::var_os("RUSTC")).map_or_else(|| PathBuf::from("rustc"), PathBuf::from)
    }

    /// Of [`Target::rustc`].
    ///
    /// # Errors
    /// It cannot be run.
    pub fn version(&self) -> Result<Version, String> {
        let text = self.ask(&["-vV"])?;
        let line =
            |key: &str| text.lines().find_map(|line| line.strip_prefix(key)).map(|value| value.trim().to_owned());
        let version = line("release:").zip(line("host:")).map(|(release, host)| Version { release, host });
        version.ok_or_else(|| format!("error: {} does not say what it is", self.rustc().display()))
    }

    /// Whether the compiler has a core library for the machine; otherwise cargo has to build it, of sources that lie beside the
    /// compiler.
    ///
    /// # Errors
    /// The compiler cannot be run, or does not know the machine.
    pub fn has_core(&self) -> Result<bool, String> {
        let Some(triple) = &self.triple else { return Ok(true) };
        let folder = self.ask(&["--print", "target-libdir", "--target", triple])?;
        let is_core = |name: &str| name.starts_with("libcore-") && name.ends_with(".rlib");
        let entries = std::fs::read_dir(folder.trim()).into_iter().flatten().flatten();
        Ok(entries.into_iter().any(|entry| is_core(&entry.file_name().to_string_lossy())))
    }

    fn ask(&self, arguments: &[&str]) -> Result<String, String> {
        let rustc = self.rustc();
        let shown = rustc.display();
        let output = Command::new(&rustc).args(arguments).output();
        let output = output.map_err(|error| format!("error: cannot run {shown}, which `--measure` needs: {error}"))?;
        if !output.status.success() {
            return Err(format!("error: {shown}: {}", String::from_utf8_lossy(&output.stderr).trim()));
        }
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_a_triple_and_maybe_a_processor() {
        assert_eq!(Target::new("host"), Target::HOST);
        let target = Target::new("thumbv7em-none-eabihf/cortex-m7");
        assert_eq!(
            (target.triple.as_deref(), target.cpu.as_deref()),
            (Some("thumbv7em-none-eabihf"), Some("cortex-m7"))
        );
        assert_eq!(target.name().as_deref(), Ok("thumbv7em-none-eabihf/cortex-m7"));
    }
}
