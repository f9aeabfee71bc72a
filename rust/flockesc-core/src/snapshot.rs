//! Snapshots: bytes with a head that identifies them and a body that is checked before it is used.
//!
//! The head holds [`MAGIC`], [`VERSION`], the CRC-32 of the body and the [`Fingerprint`] of the scenario and options, each
//! four bytes, little-endian. The body is written by postcard. Where a component's memory layout serves the processor
//! (groups of columns, random streams), a small struct of rows is serialized instead of the component.

use nalgebra::SVector;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::base::error::{Error, Result};

const MAGIC: [u8; 4] = *b"FESC";

/// Version of the body's format.
const VERSION: u32 = 3;

const HEAD: usize = 16;

/// Bound of every number that a step leaves; squares and sums of squares of such numbers are finite.
const LARGEST: f64 = 1e120;

/// CRC-32 of the scenario and options that a snapshot belongs to. Different ones collide with probability 2^-32.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Fingerprint(u32);

impl Fingerprint {
    /// The fingerprint of documents, from their JSON.
    pub(crate) fn of(documents: &impl Serialize) -> Self {
        let json = serde_json::to_vec(documents).unwrap_or_default(); // documents can always be written
        Self(crc32fast::hash(&json))
    }
}

/// Writes a body and its head.
pub(crate) fn seal(of: Fingerprint, body: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = vec![0; HEAD];
    bytes = postcard::to_extend(body, bytes)
        .map_err(|error| Error::argument("state", "what can be written", error))?;
    let sum = crc32fast::hash(&bytes[HEAD..]);
    let words = [u32::from_le_bytes(MAGIC), VERSION, sum, of.0];
    for (place, word) in bytes.chunks_exact_mut(4).zip(words) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    Ok(bytes)
}

/// Checks the head that [`seal`] wrote and reads the body.
///
/// # Errors
/// [`Error::Argument`] on `state` for bytes that are damaged, of another version, or not `of` these documents.
pub(crate) fn open<T: DeserializeOwned>(of: Fingerprint, state: &[u8]) -> Result<T> {
    let refused = |expected: &str, given: String| Err(Error::argument("state", expected, given));
    let Some((head, body)) = state.split_at_checked(HEAD) else {
        let given = format!("{} bytes", state.len());
        return refused("bytes of get_state", given);
    };
    let mut words = [0; HEAD / 4];
    for (word, place) in words.iter_mut().zip(head.chunks_exact(4)) {
        *word = place
            .iter()
            .rev()
            .fold(0, |word, byte| word << 8 | u32::from(*byte));
    }
    let [magic, version, sum, made_of] = words;
    if magic != u32::from_le_bytes(MAGIC) {
        return refused("bytes of get_state", "other bytes".to_owned());
    }
    if version != VERSION {
        return refused(&format!("version {VERSION}"), format!("version {version}"));
    }
    if sum != crc32fast::hash(body) {
        return Err(damaged("their checksum differs"));
    }
    if made_of != of.0 {
        let expected = "one of the same scenario, options and interface";
        return refused(expected, "one of others".to_owned());
    }
    read(body)
}

/// Writes a part of a body. Plain data can always be written.
pub(crate) fn write(part: &impl Serialize) -> Vec<u8> {
    postcard::to_allocvec(part).unwrap_or_default()
}

/// Reads a body, or a part of one.
pub(crate) fn read<T: DeserializeOwned>(body: &[u8]) -> Result<T> {
    match postcard::take_from_bytes(body) {
        Ok((value, [])) => Ok(value),
        Ok(_) => Err(damaged("something follows them")),
        Err(error) => Err(damaged(error)),
    }
}

/// The error for bytes that no snapshot has.
pub(crate) fn damaged(what: impl std::fmt::Display) -> Error {
    let given = format!("damaged ones: {what}");
    Error::argument("state", "bytes of get_state", given)
}

/// Refuses a state for which a condition does not hold.
pub(crate) fn check(holds: bool, what: &str) -> Result<()> {
    if holds { Ok(()) } else { Err(damaged(what)) }
}

/// Whether a step can have left this number.
pub(crate) fn is_sound(number: f64) -> bool {
    number.abs() <= LARGEST
}

/// Whether this is an interaction range, which may exceed [`LARGEST`].
pub(crate) fn is_range(number: f64) -> bool {
    number.is_finite() && number >= 0.0
}

/// Whether a step can have left all of these numbers.
pub(crate) fn are_sound<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> bool {
    numbers.into_iter().all(|number| is_sound(*number))
}

/// Refuses numbers that are not `count` [sound](is_sound) ones.
pub(crate) fn check_numbers(numbers: &[f64], count: usize, what: &str) -> Result<()> {
    check(numbers.len() == count, what)?;
    check(numbers.iter().all(|number| is_sound(*number)), what)
}

/// Refuses a vector with an entry that is not [sound](is_sound).
pub(crate) fn check_vector<const D: usize>(
    vector: Option<&SVector<f64, D>>,
    what: &str,
) -> Result<()> {
    let mut entries = vector.into_iter().flat_map(|vector| vector.iter());
    check(entries.all(|entry| is_sound(*entry)), what)
}

/// A vector of D sound entries.
pub(crate) fn vector<const D: usize>(entries: &[f64], what: &str) -> Result<SVector<f64, D>> {
    check_numbers(entries, D, what)?;
    Ok(SVector::from_column_slice(entries))
}
