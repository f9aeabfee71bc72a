//! Distributions and the document of a scenario: which draws fit, and the document with drawn numbers.

use serde_json::Value;

use super::Distribution;
use super::distribution::End;
use crate::base::error::{Error, Result};
use crate::base::rng::{self, Stream};

/// Fields that stay: the length scale of observations, and the time between two steps.
const FIXED: [&str; 2] = ["initial_side", "time_step"];

/// Most combinations of ends that one part of a scenario may have.
const MOST_COMBINATIONS: usize = 4096;

/// Checks that `accept` takes the scenario with every draw.
///
/// A bound of a scenario concerns one part of it, such as one predator, and the numbers that a bound accepts are a convex
/// set. So every draw is accepted if all combinations of the distributions' ends in a part are. A direction must not be
/// 0, which is not convex: between accepted ends it is drawn with probability 2^-53 at most, and then means rest.
///
/// # Errors
/// [`Error::Config`] for a distribution of no real number, and for draws that do not fit, one by one or together.
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

/// A scenario under combinations of the distributions' ends; entry k of a combination is an end of distribution k.
struct Trial<'a> {
    distributions: &'a [Distribution],
    scenario: &'a Value,
    ends: Vec<Vec<End>>,
    accept: &'a dyn Fn(&Value) -> Result<()>,
}

impl Trial<'_> {
    /// Every end, the other distributions at their first one. An error is on the distribution of the refused field.
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
            return Err(self.not_together(&error, combination));
        };
        let (end, value) = &self.ends[index][combination[index]];
        let path = format!("{}.{end}", path(self.distributions, index));
        Err(Error::config(path, format!("{expected} ({field})"), value))
    }

    /// All combinations of the ends in every part of the scenario.
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
                if combinations.len() * ends.len() > MOST_COMBINATIONS {
                    let of = part(index).unwrap_or_default();
                    let expected = format!("at most {MOST_COMBINATIONS} combinations in {of}");
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
                    .map_err(|error| self.not_together(&error, &combination))?;
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
        put(self.distributions, &self.values(combination), &mut drawn);
        drawn
    }

    fn not_together(&self, error: &Error, combination: &[usize]) -> Error {
        let expected = format!("distributions whose draws all fit together ({error})");
        let given = format!("{:?}", self.values(combination));
        Error::config("randomization", expected, given)
    }
}

/// Checks one distribution by itself, and its field.
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
    let expected = "the path of a real number of the scenario other than initial_side and time_step, \
                    such as predator_range, once";
    Err(Error::config(
        format!("{path}.field"),
        expected,
        format!("{field:?}"),
    ))
}

/// The path of a distribution in the scenario.
fn path(distributions: &[Distribution], index: usize) -> String {
    format!("randomization[{index}].{}", distributions[index].kind())
}

/// Puts the numbers that the episode with this seed draws into the scenario.
pub(in crate::flock) fn draw(distributions: &[Distribution], seed: u64, scenario: &mut Value) {
    let mut rng = rng::stream(seed, Stream::Scenario);
    let draws = distributions
        .iter()
        .map(|distribution| distribution.as_draw().draw(rng::uniform(&mut rng, 1.0)));
    let values: Vec<f64> = draws.collect();
    put(distributions, &values, scenario);
}

/// Puts these numbers into the scenario.
fn put(distributions: &[Distribution], values: &[f64], scenario: &mut Value) {
    for (distribution, value) in distributions.iter().zip(values) {
        if let Some(number) = number_at(scenario, distribution.as_draw().field()) {
            *number = Value::from(*value);
        }
    }
}

/// The entry of a document at a path such as `predators[0].constant_velocity.position[1]`.
fn number_at<'a>(document: &'a mut Value, path: &str) -> Option<&'a mut Value> {
    path.split('.').try_fold(document, |object, part| {
        let mut steps = part.split('[');
        let list = object.get_mut(steps.next()?)?;
        steps.try_fold(list, |list, step| {
            let digits = step.strip_suffix(']')?;
            let index: usize = digits.parse().ok()?;
            // One spelling per number: two distributions cannot set the same.
            (index.to_string() == digits).then(|| list.get_mut(index))?
        })
    })
}
