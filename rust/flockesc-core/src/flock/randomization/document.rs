//! Domain randomization of a scenario's document: validation of the distributions, and drawing of the
//! numbers.

use serde_json::Value;

use super::Distribution;
use super::distribution::End;
use crate::base::error::{Error, Result};
use crate::base::rng::{self, Stream};

/// Fields that cannot be randomized: the length scale of observations and the time step.
const FIXED: [&str; 2] = ["initial_side", "time_step"];

/// Largest number of combinations of ends in one part of a scenario.
const MAX_COMBINATIONS: usize = 4096;

/// Checks that `accept` accepts the scenario with every possible draw.
///
/// Every bound of a scenario concerns one part of it, such as one predator, and the accepted numbers are a
/// convex set. If all combinations of the distributions' ends in each part are accepted, every draw is
/// accepted. The one exception is a direction, which must not be 0. Between accepted ends it is 0 with a
/// probability of at most 2^-53, and the agent is then at rest.
///
/// # Errors
/// [`Error::Config`] if a distribution does not name a real number, or if a draw or a combination of draws is
/// rejected.
pub(in crate::flock) fn check(
    distributions: &[Distribution],
    scenario: &Value,
    accept: impl Fn(&Value) -> Result<()>,
) -> Result<()> {
    for index in 0..distributions.len() {
        check_field(distributions, index, scenario)?;
    }
    let trial = Trial {
        distributions,
        scenario,
        ends: distributions.iter().map(|d| d.as_draw().ends()).collect(),
        accept: &accept,
    };
    trial.check_one_by_one()?;
    trial.check_together()
}

/// Tests a scenario with combinations of the distributions' ends. Entry k of a combination is the index of an
/// end of distribution k.
struct Trial<'a> {
    distributions: &'a [Distribution],
    scenario: &'a Value,
    ends: Vec<Vec<End>>,
    accept: &'a dyn Fn(&Value) -> Result<()>,
}

impl Trial<'_> {
    /// Tests every end of every distribution, with the other distributions at their first end. Errors name
    /// the distribution of the rejected field.
    fn check_one_by_one(&self) -> Result<()> {
        let first = vec![0; self.ends.len()];
        self.check_end(&first, None)?;
        for (index, ends) in self.ends.iter().enumerate() {
            for end in 1..ends.len() {
                let mut combination = first.clone();
                combination[index] = end;
                self.check_end(&combination, Some(index))?;
            }
        }
        Ok(())
    }

    fn check_end(&self, combination: &[usize], varied: Option<usize>) -> Result<()> {
        let Err(error) = (self.accept)(&self.drawn(combination)) else {
            return Ok(());
        };
        let Error::Config {
            field, expected, ..
        } = &error
        else {
            return Err(error);
        };
        let mut fields = self.distributions.iter().map(|d| d.as_draw().field());
        let Some(index) = fields.position(|set| set == field).or(varied) else {
            return Err(self.combination_error(&error, combination));
        };
        let (end, value) = &self.ends[index][combination[index]];
        let path = format!("{}.{end}", path(self.distributions, index));
        Err(Error::config(path, format!("{expected} ({field})"), value))
    }

    /// Tests all combinations of the ends in every part of the scenario.
    fn check_together(&self) -> Result<()> {
        let part = |index: usize| {
            self.distributions[index]
                .as_draw()
                .field()
                .split('.')
                .next()
        };
        let all = 0..self.ends.len();
        for index in all.clone() {
            if (0..index).any(|earlier| part(earlier) == part(index)) {
                continue;
            }
            let mut combinations = vec![vec![0; self.ends.len()]];
            for member in all.clone().filter(|other| part(*other) == part(index)) {
                let ends = 0..self.ends[member].len();
                if combinations.len() * ends.len() > MAX_COMBINATIONS {
                    let part = part(index).unwrap_or_default();
                    let expected = format!("at most {MAX_COMBINATIONS} combinations in {part}");
                    return Err(Error::config("randomization", expected, "more"));
                }
                let with = |combination: Vec<usize>, end| {
                    let mut combination = combination;
                    combination[member] = end;
                    combination
                };
                combinations = (combinations.into_iter())
                    .flat_map(|combination| {
                        ends.clone().map(move |end| with(combination.clone(), end))
                    })
                    .collect();
            }
            for combination in combinations {
                (self.accept)(&self.drawn(&combination))
                    .map_err(|error| self.combination_error(&error, &combination))?;
            }
        }
        Ok(())
    }

    fn values(&self, combination: &[usize]) -> Vec<f64> {
        let chosen = self.ends.iter().zip(combination);
        chosen.map(|(ends, &end)| ends[end].1).collect()
    }

    fn drawn(&self, combination: &[usize]) -> Value {
        let mut drawn = self.scenario.clone();
        set_numbers(self.distributions, &self.values(combination), &mut drawn);
        drawn
    }

    fn combination_error(&self, error: &Error, combination: &[usize]) -> Error {
        let expected = format!("distributions with valid combinations of draws ({error})");
        let given = format!("{:?}", self.values(combination));
        Error::config("randomization", expected, given)
    }
}

/// Checks the parameters and the field of one distribution.
fn check_field(distributions: &[Distribution], index: usize, scenario: &Value) -> Result<()> {
    let (path, field) = (
        path(distributions, index),
        distributions[index].as_draw().field(),
    );
    distributions[index].as_draw().check(&path)?;
    let mut earlier = distributions[..index].iter();
    let mut scenario = scenario.clone();
    let is_real = number_at(&mut scenario, field).is_some_and(|value| value.is_f64());
    let is_first = earlier.all(|other| other.as_draw().field() != field);
    if is_real && is_first && !FIXED.contains(&field) {
        return Ok(());
    }
    let expected = "the path of a real number of the scenario, such as predator_range, in only one \
                    distribution and not initial_side or time_step";
    Err(Error::config(
        format!("{path}.field"),
        expected,
        format!("{field:?}"),
    ))
}

/// Returns the path of a distribution in the scenario.
fn path(distributions: &[Distribution], index: usize) -> String {
    format!("randomization[{index}].{}", distributions[index].kind())
}

/// Draws the randomized numbers of the episode with this seed and writes them to the scenario.
pub(in crate::flock) fn draw(distributions: &[Distribution], seed: u64, scenario: &mut Value) {
    let mut rng = rng::stream(seed, Stream::Scenario);
    let draws = distributions
        .iter()
        .map(|distribution| distribution.as_draw().draw(rng::uniform(&mut rng, 1.0)));
    let values: Vec<f64> = draws.collect();
    set_numbers(distributions, &values, scenario);
}

/// Writes the numbers of the distributions to the scenario.
fn set_numbers(distributions: &[Distribution], values: &[f64], scenario: &mut Value) {
    for (distribution, value) in distributions.iter().zip(values) {
        if let Some(number) = number_at(scenario, distribution.as_draw().field()) {
            *number = Value::from(*value);
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
