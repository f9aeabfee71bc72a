//! The snapshot format: a header of 16 bytes and a body.
//!
//! The header holds [`MAGIC`], [`VERSION`], the CRC-32 of the body and the [`Fingerprint`] of the scenario
//! and options, each four bytes, little-endian. The body is serialized by postcard. Components with a memory
//! layout for SIMD (groups of columns) and random streams are serialized through a plain struct. A body with the right
//! checksum and fingerprint comes from this program, so its numbers are not checked again.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::base::error::{Error, Result};

const MAGIC: [u8; 4] = *b"FESC";

/// Version of the body's format.
const VERSION: u32 = 6;

const HEADER_LEN: usize = 16;

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
        .map_err(|error| Error::input("state", "a serializable state", error))?;
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
/// [`Error::Input`] on `state` if the bytes are damaged or have another version or fingerprint.
pub(crate) fn decode<T: DeserializeOwned>(fingerprint: Fingerprint, state: &[u8]) -> Result<T> {
    let refused = |expected: &str, given: String| Err(Error::input("state", expected, given));
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
    match postcard::take_from_bytes(body) {
        Ok((value, [])) => Ok(value),
        Ok(_) => Err(damaged("trailing bytes")),
        Err(error) => Err(damaged(error)),
    }
}

/// Returns the error for a damaged snapshot; `what` is the invalid part or the reason.
fn damaged(what: impl std::fmt::Display) -> Error {
    let given = format!("damaged bytes ({what})");
    Error::input("state", "bytes from get_state", given)
}
