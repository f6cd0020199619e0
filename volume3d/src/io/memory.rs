//! Fallible allocation for sizes declared by a file.

use super::MemoryError;

/// Reserves `count` more elements, or returns an error where an allocation would abort the program.
pub(super) fn reserve<T>(values: &mut Vec<T>, count: usize, what: &'static str) -> Result<(), MemoryError> {
    let bytes = count.saturating_mul(size_of::<T>());
    values.try_reserve_exact(count).map_err(|_| MemoryError { what, bytes })
}

/// An empty list with capacity for `count` elements.
pub(super) fn with_room<T>(count: usize, what: &'static str) -> Result<Vec<T>, MemoryError> {
    let mut values = vec![];
    reserve(&mut values, count, what)?;
    Ok(values)
}
