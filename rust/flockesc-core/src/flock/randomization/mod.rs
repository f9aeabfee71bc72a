//! Domain randomization: every episode draws some numbers of the scenario from its seed.

mod distribution;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use serde_json::Value;

use crate::base::error::{Error, Result};
use crate::base::rng::{self, Stream};

pub use distribution::Distribution;

/// Fields that cannot be randomized: the length scale of observations and the time step.
const FIXED: [&str; 2] = ["initial_side", "time_step"];

/// Checks the parameters and the numbers of every distribution. [`FlockConfig::drawn`] checks what they draw.
///
/// [`FlockConfig::drawn`]: crate::FlockConfig::drawn
///
/// # Errors
/// [`Error::Input`] if a parameter is out of bounds, or if a distribution does not name real numbers or names one
/// that another distribution names.
pub(crate) fn check(distributions: &[Distribution], mut scenario: Value) -> Result<()> {
    let mut fields = BTreeSet::new();
    for (index, distribution) in distributions.iter().enumerate() {
        let path = format!("randomization[{index}].{}", distribution.as_ref());
        let numbers = distribution.fields(&scenario);
        distribution.check(&path)?;
        let mut is_free = |field: &String| {
            let is_real = number_at(&mut scenario, field).is_some_and(|value| value.is_f64());
            is_real && !FIXED.contains(&field.as_str()) && fields.insert(field.clone())
        };
        if numbers.is_empty() || !numbers.iter().all(&mut is_free) {
            let (parameter, expected, given) = match distribution {
                Distribution::RandomApproach { predator, .. } => (
                    "predator",
                    "the index of a predator with a start, in only one distribution",
                    predator.to_string(),
                ),
                Distribution::Uniform { field, .. }
                | Distribution::LogUniform { field, .. }
                | Distribution::Choice { field, .. } => (
                    "field",
                    "the path of a real number of the scenario, such as predator_range, in only \
                     one distribution and not initial_side or time_step",
                    format!("{field:?}"),
                ),
            };
            return Err(Error::input(format!("{path}.{parameter}"), expected, given));
        }
    }
    Ok(())
}

/// Draws the randomized numbers of the episode with this seed and writes them to the scenario.
pub(crate) fn draw(distributions: &[Distribution], seed: u64, scenario: &mut Value) {
    let mut rng = rng::stream(seed, Stream::Scenario);
    for distribution in distributions {
        let (fields, values) = (
            distribution.fields(scenario),
            distribution.draw(scenario, &mut rng),
        );
        for (field, value) in fields.iter().zip(values) {
            if let Some(number) = number_at(scenario, field) {
                *number = Value::from(value);
            }
        }
    }
}

/// Returns the entry of a document at a path such as `predators[0].constant_velocity.position[1]`.
fn number_at<'a>(document: &'a mut Value, path: &str) -> Option<&'a mut Value> {
    path.split('.').try_fold(document, |object, part| {
        let mut steps = part.split('[');
        let list = object.get_mut(steps.next()?)?;
        steps.try_fold(list, |list, step| {
            let digits = step.strip_suffix(']')?;
            let index: usize = digits.parse().ok()?;
            // Only one spelling is accepted, so that two distributions cannot name the same number.
            (index.to_string() == digits).then(|| list.get_mut(index))?
        })
    })
}
