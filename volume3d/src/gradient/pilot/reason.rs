//! Why a candidate was not chosen.

use std::fmt;

/// Why a candidate was not chosen that is expected to err less than the one that was preferred to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The difference is below the pilot's resolution.
    Close,
    /// Its trial saw nothing of a kind of curve, and it does not promise a quarter of the error.
    Unseen,
    /// Its trial and that of the softened field found different derivatives, or noise alone.
    Disagrees,
}

/// In words, as a clause about the candidate.
impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Close => "which is within what a pilot of so few samples can tell",
            Self::Unseen => {
                "which is not chosen as its trial saw no light jump at one kind of curve, and it should not err four times less"
            }
            Self::Disagrees => {
                "which is not chosen as its trial did not confirm what that of the softened field found"
            }
        })
    }
}
