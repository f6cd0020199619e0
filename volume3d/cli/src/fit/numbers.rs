//! Arrays of a fixed length.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// Exactly N numbers. (Serde reads an array that is too long as a tuple.)
pub(super) fn numbers<'de, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Option<[f64; N]>, D::Error> {
    let found = Vec::<f64>::deserialize(deserializer)?;
    let count = found.len();
    let error = |_| D::Error::custom(format!("expected {N} numbers, found {count}"));
    found.try_into().map(Some).map_err(error)
}
