//! From JSON, with errors that name the path of a bad field.

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::base::error::{Error, Result};

/// Parses a document, a JSON object.
pub(crate) fn parse<T: DeserializeOwned>(document: &str) -> Result<T> {
    let value: Value = serde_json::from_str(document)
        .map_err(|error| Error::config("document", "valid JSON", error))?;
    // A list would be taken as the values of the first fields.
    if !value.is_object() {
        return Err(Error::config(
            "document",
            "an object with its fields",
            value,
        ));
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
            .unwrap_or((&message, "a field that the schema names"));
        let field = if path == "." {
            quoted(given).unwrap_or("document").to_owned()
        } else {
            path
        };
        Error::config(field, plain(expected), given)
    })
}

/// What serde expects, in words of the document instead of Rust's.
fn plain(expected: &str) -> &str {
    match expected {
        "usize" => "an integer of at least 0",
        "f64" => "a number",
        "a sequence" => "a list",
        "a boolean" => "true or false",
        "newtype variant" | "struct variant" | "map" => "an object with its fields",
        other if other.starts_with("struct ") => "an object with its fields",
        other => other,
    }
}

/// The name in backquotes in serde's messages on unknown and missing fields.
fn quoted(message: &str) -> Option<&str> {
    message.split('`').nth(1)
}
