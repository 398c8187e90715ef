//! What is too slender or too thin: two limits on the ratio, one on the width. The library measures; this judges.
//!
//! One sense everywhere: a ratio *at or over* a limit counts, and so does a width *at or under* the least width.

use super::Feature;

/// What is judged by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProcessLimits {
    /// A feature at or over this D1max / D2max deserves a look.
    pub warn_ratio: f64,
    /// A feature at or over this one is too slender.
    pub error_ratio: f64,
    /// A feature whose D2min, in model units, is at or under this is too thin; 0: widths are not judged.
    pub min_width: f64,
}

impl Default for ProcessLimits {
    fn default() -> ProcessLimits {
        ProcessLimits { warn_ratio: WARN, error_ratio: ERROR, min_width: 0.0 }
    }
}

/// The guideline that Ge & Flynn (2022) cite: height to width below 8:1.
const ERROR: f64 = 8.0;
/// Five eighths of that: what a little more would make too slender.
const WARN: f64 = 5.0;

/// Limits of a process, with where they come from. Widths in millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Process {
    /// Short name, as on a command line.
    pub name: &'static str,
    /// The limits.
    pub limits: ProcessLimits,
    /// Where they come from.
    pub source: &'static str,
}

/// Starting points, to be replaced by what is known of a machine and a material.
pub const PROCESSES: [Process; 3] = [
    Process {
        name: "metal-pbf",
        limits: ProcessLimits { warn_ratio: WARN, error_ratio: ERROR, min_width: 0.4 },
        source: "ratio: 8:1, guideline cited by Ge & Flynn, J. Intell. Manuf. 33 (2022) 519-535; \
                 width: supported walls 0.4 mm, DMLS, arti90.com/en/design-clues",
    },
    Process {
        name: "polymer-pbf",
        limits: ProcessLimits { warn_ratio: WARN, error_ratio: ERROR, min_width: 0.7 },
        source: "ratio: none published, that of metal; width: walls 0.7 mm, SLS, arti90.com/en/design-clues",
    },
    Process {
        name: "filament",
        limits: ProcessLimits { warn_ratio: WARN, error_ratio: ERROR, min_width: 1.0 },
        source: "ratio: none published, that of metal; width: walls 1 mm, FDM, arti90.com/en/design-clues",
    },
];

/// How bad a feature is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Severity {
    /// Under the limits.
    #[default]
    Fine,
    /// At or over the first limit on the ratio.
    Warning,
    /// At or over the second limit on the ratio, or at or under the least width.
    Error,
}

impl Severity {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Severity::Fine => "ok",
            Severity::Warning => "warning",
            Severity::Error => "error",
        }
    }
}

/// A judgement: how bad, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Verdict {
    /// How bad.
    pub severity: Severity,
    /// For its ratio.
    pub slender: bool,
    /// For its width.
    pub thin: bool,
}

impl ProcessLimits {
    /// Judges a feature. What could not be measured is not judged.
    pub fn judge(&self, feature: &Feature) -> Verdict {
        let slender = feature.ratio >= self.warn_ratio || feature.ratio >= self.error_ratio;
        let thin = self.min_width > 0.0 && feature.d2_min.width <= self.min_width;
        let severity = match (thin || feature.ratio >= self.error_ratio, slender) {
            (true, _) => Severity::Error,
            (false, true) => Severity::Warning,
            (false, false) => Severity::Fine,
        };
        Verdict { severity, slender, thin }
    }
}
