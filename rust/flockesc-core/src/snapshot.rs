//! What runs, as bytes: a head that says what they are, and a body that is checked before any of it is used.
//!
//! The head is [`MAGIC`], [`VERSION`], the CRC-32 of the body and that of what the body is a state of (each four bytes,
//! little-endian); the body is written by postcard.

use nalgebra::SVector;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::base::error::{Error, Result};

const MAGIC: [u8; 4] = *b"FESC";

/// Changes whenever the body does.
const VERSION: u32 = 3;

const HEAD: usize = 16;

/// No step leaves a number beyond this, so that none has a square, or a sum of squares, that is infinite.
const LARGEST: f64 = 1e120;

/// Stands for what a state is a state of; what differs has another one, but for one chance in 2^32.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Fingerprint(u32);

impl Fingerprint {
    /// Of documents, by all that they say.
    pub(crate) fn of(documents: &impl std::fmt::Debug) -> Self {
        Self(crc32fast::hash(format!("{documents:?}").as_bytes()))
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

/// Reads what [`seal`] wrote.
///
/// # Errors
/// [`Error::Argument`] on `state` for bytes that are damaged, of another version or `of` something else.
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
        return refused("bytes of get_state", "others".to_owned());
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

/// What bytes say that no state does.
pub(crate) fn damaged(what: impl std::fmt::Display) -> Error {
    let given = format!("damaged ones: {what}");
    Error::argument("state", "bytes of get_state", given)
}

/// Refuses what does not hold of a state.
pub(crate) fn check(holds: bool, what: &str) -> Result<()> {
    if holds { Ok(()) } else { Err(damaged(what)) }
}

/// Whether a step can have left this number.
pub(crate) fn is_sound(number: f64) -> bool {
    number.abs() <= LARGEST
}

/// Whether this is an interaction range, which may be beyond everything.
pub(crate) fn is_range(number: f64) -> bool {
    number.is_finite() && number >= 0.0
}

/// Refuses numbers that are not as many, or not [sound](is_sound).
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
