//! Learning-rate schedules.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

/// Factor of the learning rate in step t of T, from 1 in the first step to `end` after the last.
///
/// The distance of Adam from a minimum is limited by its rate: for convergence let it fall to 0 or nearly so.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Schedule {
    /// 1 in all steps: for finding a rate that works.
    Constant {},
    /// end + (1 − end) (1 + cos(π t/T))/2: large steps for most of the fit, then ever smaller ones. The
    /// default, with end = 0.
    Cosine {
        /// The final factor.
        #[serde(default)]
        end: f64,
    },
    /// endᵗ⸍ᵀ: each step is smaller than the last by a constant factor.
    Exponential {
        /// The final factor, above 0.
        end: f64,
    },
}

impl Default for Schedule {
    fn default() -> Self {
        Self::Cosine { end: 0.0 }
    }
}

impl Schedule {
    /// The factor in step `t`, from 0, of `steps`.
    #[must_use]
    pub fn factor(self, t: u64, steps: u64) -> f64 {
        let part = t as f64 / steps.max(1) as f64;
        match self {
            Self::Constant {} => 1.0,
            Self::Cosine { end } => end + (1.0 - end) * 0.5 * (1.0 + (PI * part).cos()),
            Self::Exponential { end } => end.powf(part),
        }
    }

    /// The reason why the schedule is invalid, if it is.
    #[must_use]
    pub fn problem(self) -> Option<String> {
        match self {
            Self::Cosine { end } if !(0.0..=1.0).contains(&end) => {
                Some(format!("a cosine schedule ends at {end}, but must end between 0 and 1"))
            }
            Self::Exponential { end } if !(end > 0.0 && end <= 1.0) => {
                Some(format!("an exponential schedule ends at {end}, but must end above 0 and at 1 at most"))
            }
            _ => None,
        }
    }
}
