//! `PerAgent`: a parameter with one number for all agents or one number per agent.

use std::fmt;

use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::layout::Column;
use crate::base::error::{Error, Result};

/// A parameter of the agents: one number for all, or one per agent.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum PerAgent {
    /// The same for every agent.
    Shared(f64),
    /// Entry i belongs to agent i.
    Each(Vec<f64>),
}

impl PerAgent {
    /// Checks that there is one number or `num_agents` numbers, and checks each with `number(field, value)`.
    pub(crate) fn check(
        &self,
        field: &str,
        num_agents: usize,
        number: impl Fn(&str, f64) -> Result<()>,
    ) -> Result<()> {
        match self {
            Self::Shared(value) => number(field, *value),
            Self::Each(values) if values.len() != num_agents => {
                let expected = format!("a number or {num_agents} numbers");
                let given = format!("{} numbers", values.len());
                Err(Error::input(field, expected, given))
            }
            Self::Each(values) => {
                let mut entries = values.iter().enumerate();
                entries.try_for_each(|(i, &value)| number(&format!("{field}[{i}]"), value))
            }
        }
    }

    /// Returns the number of the agent with this id.
    pub(crate) fn of(&self, id: usize) -> f64 {
        match self {
            Self::Shared(value) => *value,
            Self::Each(values) => values[id],
        }
    }

    /// Returns the largest number.
    pub(crate) fn largest(&self) -> f64 {
        match self {
            Self::Shared(value) => *value,
            Self::Each(values) => values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// Writes the numbers of the agents with these ids to `out`; values in empty lanes are unspecified.
    #[inline(always)]
    pub(crate) fn gather(&self, ids: &[u32], out: &mut Column<f64>) {
        match self {
            Self::Shared(value) => out.fill(*value),
            Self::Each(values) => {
                for (number, &id) in out.iter_mut().zip(ids) {
                    *number = values[id as usize];
                }
            }
        }
    }
}

impl<'de> Deserialize<'de> for PerAgent {
    fn deserialize<T: Deserializer<'de>>(deserializer: T) -> std::result::Result<Self, T::Error> {
        deserializer.deserialize_any(NumberOrNumbers)
    }
}

/// Visitor for a number or a list of numbers. The derived code for an untagged enum would not name the bad
/// entry in its errors.
struct NumberOrNumbers;

impl<'de> Visitor<'de> for NumberOrNumbers {
    type Value = PerAgent;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a number or a list of numbers, one per agent")
    }

    fn visit_f64<E>(self, value: f64) -> std::result::Result<PerAgent, E> {
        Ok(PerAgent::Shared(value))
    }

    fn visit_u64<E>(self, value: u64) -> std::result::Result<PerAgent, E> {
        Ok(PerAgent::Shared(value as f64))
    }

    fn visit_i64<E>(self, value: i64) -> std::result::Result<PerAgent, E> {
        Ok(PerAgent::Shared(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(
        self,
        mut entries: A,
    ) -> std::result::Result<PerAgent, A::Error> {
        let mut values = Vec::new();
        while let Some(value) = entries.next_element()? {
            values.push(value);
        }
        Ok(PerAgent::Each(values))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::check::positive;
    use crate::base::document::parse_value;

    fn parse(document: &str) -> Result<PerAgent> {
        parse_value(&serde_json::from_str(document).expect("valid JSON"))
    }

    fn refused(document: &str) -> (String, String) {
        let parsed = parse(document);
        match parsed.and_then(|value| value.check("mass", 3, positive)) {
            Err(Error::Input {
                field, expected, ..
            }) => (field, expected),
            other => panic!("{document}: {other:?}"),
        }
    }

    #[test]
    fn one_number_or_one_per_agent() {
        for (document, expected) in [
            ("2", [2.0; 3]),
            ("0.5", [0.5; 3]),
            ("[1, 2.5, 3]", [1.0, 2.5, 3.0]),
        ] {
            let value = parse(document).expect("a good document");
            assert!(value.check("mass", 3, positive).is_ok());
            assert_eq!([0, 1, 2].map(|id| value.of(id)), expected);
            assert_eq!(value.largest(), expected[2]);
            let mut column = [0.0; crate::agents::GROUP];
            value.gather(&[2, 0], &mut column);
            assert_eq!(column[..2], [expected[2], expected[0]]);
        }
    }

    #[test]
    fn errors_name_the_entry() {
        let number = "a finite number above 0".to_owned();
        assert_eq!(refused("0"), ("mass".into(), number.clone()));
        assert_eq!(refused("[1, 0, 1]"), ("mass[1]".into(), number));
        assert_eq!(
            refused("[1, 1]"),
            ("mass".into(), "a number or 3 numbers".into())
        );
        assert_eq!(refused("[1, \"2\", 1]"), ("[1]".into(), "a number".into()));
        let either = "a number or a list of numbers, one per agent".to_owned();
        assert_eq!(refused("\"heavy\"").1, either);
        assert_eq!(refused("null").1, either);
    }
}
