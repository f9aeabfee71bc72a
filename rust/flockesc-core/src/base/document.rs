//! Parsing of JSON documents, with errors that name the path of the bad field.

use serde::de::DeserializeOwned;
use serde_json::Value;
use serde_path_to_error::{Path, Segment};

use crate::base::error::{Error, Result};

/// Parses a document, which must be a JSON object.
///
/// # Errors
/// [`Error::Input`] naming the field that is unknown, missing or of the wrong type.
pub fn parse<T: DeserializeOwned>(document: &str) -> Result<T> {
    let value: Value = serde_json::from_str(document)
        .map_err(|error| Error::input("document", "valid JSON", error))?;
    // Serde also accepts a list, as the values of the fields in order.
    if !value.is_object() {
        return Err(Error::input("document", "a JSON object", value));
    }
    parse_value(&value)
}

/// Parses a JSON value.
pub(crate) fn parse_value<T: DeserializeOwned>(value: &Value) -> Result<T> {
    serde_path_to_error::deserialize(value).map_err(|error| {
        let path = error.path().to_string();
        let message = error.inner().to_string();
        let (given, expected) = message
            .split_once(", expected ")
            .unwrap_or((&message, "a known field"));
        let field = if path == "." {
            quoted(given).unwrap_or("document").to_owned()
        } else {
            path
        };
        let expected = match expected {
            "usize" if given.starts_with("invalid value") => "an integer of at least 0",
            other => plain(other),
        };
        let found = entry(value, error.path()).filter(|_| given.starts_with("invalid "));
        let given = found.map_or_else(|| given.to_owned(), shown);
        Error::input(field, expected, given)
    })
}

/// Returns the entry of a document at a path.
fn entry<'a>(document: &'a Value, path: &Path) -> Option<&'a Value> {
    path.iter()
        .try_fold(document, |value, segment| match segment {
            Segment::Seq { index } => value.get(index),
            Segment::Map { key } | Segment::Enum { variant: key } => value.get(key),
            Segment::Unknown => None,
        })
}

/// Returns a rejected value for an error, as Python writes it.
fn shown(value: &Value) -> String {
    match value {
        Value::Null => "None".to_owned(),
        Value::Bool(true) => "True".to_owned(),
        Value::Bool(false) => "False".to_owned(),
        Value::String(text) => format!("'{text}'"),
        other => other.to_string(),
    }
}

/// Translates the name of a Rust type in serde's messages into the name of a JSON type.
fn plain(expected: &str) -> &str {
    match expected {
        "usize" => "an integer",
        "f64" => "a number",
        "a sequence" => "a list",
        "a boolean" => "true or false",
        "newtype variant" | "struct variant" | "map" => "a JSON object",
        other if other.starts_with("struct ") => "a JSON object",
        other => other,
    }
}

/// Returns the name in backquotes in serde's messages on unknown and missing fields.
fn quoted(message: &str) -> Option<&str> {
    message.split('`').nth(1)
}
