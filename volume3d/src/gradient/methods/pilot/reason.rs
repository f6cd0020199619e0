//! Reasons for rejecting a candidate.

use std::fmt;

/// Reason why a candidate with a lower expected error than a preferred one was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The difference is below the pilot's resolution.
    Close,
    /// Its trial saw nothing of a kind of curve, and it does not promise a quarter of the error.
    Unseen,
    /// Its trial and that of the softened field found different derivatives, or only noise.
    Disagrees,
}

/// A clause about the candidate.
impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Close => "a difference below the resolution of a pilot of so few samples",
            Self::Unseen => {
                "rejected because its trial saw nothing of one kind of curve, and it does not promise a quarter of the error"
            }
            Self::Disagrees => {
                "rejected because its trial did not confirm the result of the softened field"
            }
        })
    }
}
