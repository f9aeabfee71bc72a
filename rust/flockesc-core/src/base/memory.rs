//! Allocations that return an error instead of ending the process.

use std::hint::black_box;

use crate::base::error::{Error, Result};

/// Returns an empty vector with room for `len` items.
///
/// # Errors
/// [`Error::Memory`] if the system does not grant the memory.
pub fn vector<T>(field: &str, len: usize) -> Result<Vec<T>> {
    let mut vector = Vec::new();
    let granted = vector.try_reserve_exact(len);
    granted.map_err(|_| Error::memory::<T>(field, len))?;
    Ok(vector)
}

/// Makes room for `additional` items. The room of a vector that grows repeatedly at least doubles.
///
/// # Errors
/// As [`vector`].
pub(crate) fn reserve<T>(field: &str, vector: &mut Vec<T>, additional: usize) -> Result<()> {
    let len = vector.len().saturating_add(additional);
    vector
        .try_reserve(additional)
        .map_err(|_| Error::memory::<T>(field, len))
}

/// Asks the system for room for `len` items and returns it, before many small allocations that cannot fail without
/// ending the process.
///
/// # Errors
/// As [`vector`].
pub fn probe<T>(field: &str, len: usize) -> Result<()> {
    // The compiler would remove an allocation that nothing uses.
    black_box(vector::<T>(field, len)?);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_beyond_any_memory_are_errors() {
        let message = "states: 9223372036854775800 bytes are not available";
        let error = vector::<f64>("states", usize::MAX / 16).unwrap_err();
        assert_eq!(error.to_string(), message);
        let mut growing = vec![0_u8; 3];
        assert!(reserve("states", &mut growing, usize::MAX - 3).is_err());
        assert_eq!(growing, [0; 3]);
        assert!(probe::<u8>("num_flocks", usize::MAX).is_err());
        assert_eq!(probe::<u8>("num_flocks", 1 << 20), Ok(()));
    }
}
