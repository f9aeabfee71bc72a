//! The snapshot format: a header of 16 bytes and a body that is validated when it is read.
//!
//! The header holds [`MAGIC`], [`VERSION`], the CRC-32 of the body and the [`Fingerprint`] of the scenario
//! and options, each four bytes, little-endian. The body is serialized by postcard. Components with a memory
//! layout for SIMD (groups of columns) and random streams are serialized through a plain struct.

use nalgebra::SVector;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::base::error::{Error, Result};

const MAGIC: [u8; 4] = *b"FESC";

/// Version of the body's format.
const VERSION: u32 = 3;

const HEADER_LEN: usize = 16;

/// Largest magnitude of a number in a valid state. Squares and sums of squares of such numbers are finite.
const LARGEST: f64 = 1e120;

/// CRC-32 of the scenario and options that a snapshot belongs to. Different ones collide with probability
/// 2^-32.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct Fingerprint(u32);

impl Fingerprint {
    /// Computes the fingerprint of documents from their JSON.
    pub(crate) fn of(documents: &impl Serialize) -> Self {
        let json = serde_json::to_vec(documents).unwrap_or_default(); // serializing a document cannot fail
        Self(crc32fast::hash(&json))
    }
}

/// Serializes a body and puts the header before it.
pub(crate) fn encode(fingerprint: Fingerprint, body: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = vec![0; HEADER_LEN];
    bytes = postcard::to_extend(body, bytes)
        .map_err(|error| Error::argument("state", "a serializable state", error))?;
    let sum = crc32fast::hash(&bytes[HEADER_LEN..]);
    let words = [u32::from_le_bytes(MAGIC), VERSION, sum, fingerprint.0];
    for (place, word) in bytes.chunks_exact_mut(4).zip(words) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    Ok(bytes)
}

/// Checks the header that [`encode`] wrote and reads the body.
///
/// # Errors
/// [`Error::Argument`] on `state` if the bytes are damaged or have another version or fingerprint.
pub(crate) fn decode<T: DeserializeOwned>(fingerprint: Fingerprint, state: &[u8]) -> Result<T> {
    let refused = |expected: &str, given: String| Err(Error::argument("state", expected, given));
    let Some((head, body)) = state.split_at_checked(HEADER_LEN) else {
        let given = format!("{} bytes", state.len());
        return refused("bytes from get_state", given);
    };
    let mut words = [0; HEADER_LEN / 4];
    for (word, place) in words.iter_mut().zip(head.chunks_exact(4)) {
        *word = place
            .iter()
            .rev()
            .fold(0, |word, byte| word << 8 | u32::from(*byte));
    }
    let [magic, version, sum, saved_from] = words;
    if magic != u32::from_le_bytes(MAGIC) {
        return refused("bytes from get_state", "other bytes".to_owned());
    }
    if version != VERSION {
        return refused(&format!("version {VERSION}"), format!("version {version}"));
    }
    if sum != crc32fast::hash(body) {
        return Err(damaged("checksum mismatch"));
    }
    if saved_from != fingerprint.0 {
        return refused(
            "a state of the same scenario, options and interface",
            "one saved from different ones".to_owned(),
        );
    }
    read(body)
}

/// Serializes a part of a body.
pub(crate) fn write(part: &impl Serialize) -> Vec<u8> {
    postcard::to_allocvec(part).unwrap_or_default()
}

/// Reads a body, or a part of one.
pub(crate) fn read<T: DeserializeOwned>(body: &[u8]) -> Result<T> {
    match postcard::take_from_bytes(body) {
        Ok((value, [])) => Ok(value),
        Ok(_) => Err(damaged("trailing bytes")),
        Err(error) => Err(damaged(error)),
    }
}

/// Returns the error for a damaged snapshot; `what` is the invalid part or the reason.
pub(crate) fn damaged(what: impl std::fmt::Display) -> Error {
    let given = format!("damaged bytes ({what})");
    Error::argument("state", "bytes from get_state", given)
}

/// Returns an error that names the part `what` of the state unless `is_valid`.
pub(crate) fn check(is_valid: bool, what: &str) -> Result<()> {
    if is_valid { Ok(()) } else { Err(damaged(what)) }
}

/// Returns whether a number is finite and at most [`LARGEST`] in magnitude.
pub(crate) fn is_bounded(number: f64) -> bool {
    number.abs() <= LARGEST
}

/// Returns whether a number is an interaction range. Ranges may exceed [`LARGEST`].
pub(crate) fn is_range(number: f64) -> bool {
    number.is_finite() && number >= 0.0
}

/// Returns whether all numbers are [bounded](is_bounded).
pub(crate) fn are_bounded<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> bool {
    numbers.into_iter().all(|number| is_bounded(*number))
}

/// Checks that there are `count` numbers, all of them [bounded](is_bounded).
pub(crate) fn check_numbers(numbers: &[f64], count: usize, what: &str) -> Result<()> {
    check(numbers.len() == count, what)?;
    check(are_bounded(numbers), what)
}

/// Converts `entries` into a vector after checking that there are D of them, all [bounded](is_bounded).
pub(crate) fn vector<const D: usize>(entries: &[f64], what: &str) -> Result<SVector<f64, D>> {
    check_numbers(entries, D, what)?;
    Ok(SVector::from_column_slice(entries))
}
