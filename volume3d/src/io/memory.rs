//! Room for what a file announces.

use super::MemoryError;

/// Room for `count` more elements, or an error where an allocation would end the program.
pub(super) fn reserve<T>(values: &mut Vec<T>, count: usize, what: &'static str) -> Result<(), MemoryError> {
    let bytes = count.saturating_mul(size_of::<T>());
    values.try_reserve_exact(count).map_err(|_| MemoryError { what, bytes })
}

/// An empty list with room for `count` elements.
pub(super) fn with_room<T>(count: usize, what: &'static str) -> Result<Vec<T>, MemoryError> {
    let mut values = vec![];
    reserve(&mut values, count, what)?;
    Ok(values)
}
