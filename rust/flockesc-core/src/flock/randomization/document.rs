//! Domain randomization of a scenario's document: validation of the distributions, and drawing of the
//! numbers.

use std::collections::BTreeMap;
use std::iter;

use serde_json::Value;

use super::distribution::{Distribution, End};
use crate::base::error::{Error, Result};
use crate::base::rng::{self, Stream};

/// Fields that cannot be randomized: the length scale of observations and the time step.
const FIXED: [&str; 2] = ["initial_side", "time_step"];

/// Checks that `accept` accepts the scenario with every possible draw.
///
/// Every bound of a scenario concerns one part of it, such as one predator. All parts are therefore tested at
/// once, and the number of calls of `accept` depends only on the largest number of distributions in one part.
/// A bound is one of three kinds:
///
/// 1. The accepted values of one number are an interval.
/// 2. The magnitudes of some numbers bound another one, as the speed bounds `max_speed`. The bound is strictest
///    if they are largest.
/// 3. A direction must not be 0. It is nearest to 0 if the magnitudes of all its entries are smallest.
///
/// A direction between accepted ends is 0 with a probability of at most 2^-53. The agent is then at rest.
///
/// # Errors
/// [`Error::Config`] if a distribution does not name a real number, or if a draw or a combination of draws is
/// rejected.
pub(crate) fn check(
    distributions: &[Distribution],
    scenario: Value,
    accept: impl Fn(&Value) -> Result<()>,
) -> Result<()> {
    let mut trial = Trial::new(distributions, scenario)?;
    let Err(error) = trial.check_together(&accept) else {
        return Ok(());
    };
    let together = trial.combination_error(&error);
    trial.check_one_by_one(&accept)?;
    Err(together)
}

/// Tests a scenario with combinations of the distributions' ends.
struct Trial<'a> {
    numbers: Vec<Number<'a>>,
    /// Index of the number at a path.
    indices: BTreeMap<&'a str, usize>,
    /// Index of the number and index of the end, for the smallest and largest values in a part.
    parts: BTreeMap<&'a str, Vec<(usize, usize)>>,
    scenario: Value,
}

/// A number of the scenario.
struct Number<'a> {
    distribution: &'a Distribution,
    ends: Vec<End>,
    /// Index of its end in the present combination.
    chosen: usize,
}

impl Number<'_> {
    fn value(&self) -> f64 {
        self.ends[self.chosen].1
    }
}

impl<'a> Trial<'a> {
    /// Checks the parameters and the field of every distribution.
    fn new(distributions: &'a [Distribution], mut scenario: Value) -> Result<Self> {
        let mut indices = BTreeMap::new();
        let mut parts: BTreeMap<_, Vec<_>> = BTreeMap::new();
        let mut numbers = Vec::with_capacity(distributions.len());
        for (index, distribution) in distributions.iter().enumerate() {
            let (path, field) = (path(index, distribution), distribution.field());
            distribution.check(&path)?;
            let is_real = number_at(&mut scenario, field).is_some_and(|value| value.is_f64());
            let is_first = indices.insert(field, index).is_none();
            if !is_real || !is_first || FIXED.contains(&field) {
                let expected = "the path of a real number of the scenario, such as predator_range, in only \
                                one distribution and not initial_side or time_step";
                let given = format!("{field:?}");
                return Err(Error::config(format!("{path}.field"), expected, given));
            }
            let ends = distribution.ends();
            let values = || ends.iter().map(|(_, value)| *value);
            let low = values().fold(f64::INFINITY, f64::min);
            let high = values().fold(f64::NEG_INFINITY, f64::max);
            let extremes = (0..ends.len()).filter(|&end| [low, high].contains(&ends[end].1));
            let tested = extremes.map(|end| (index, end));
            parts.entry(part(field)).or_default().extend(tested);
            numbers.push(Number {
                distribution,
                ends,
                chosen: 0,
            });
        }
        Ok(Self {
            numbers,
            indices,
            parts,
            scenario,
        })
    }

    /// Tests all numbers at their smallest magnitude, and the smallest and largest value of each number with the
    /// other numbers at their largest magnitude.
    fn check_together(&mut self, accept: &dyn Fn(&Value) -> Result<()>) -> Result<()> {
        self.combine(smallest, None);
        accept(&self.scenario)?;
        (0..self.rounds()).try_for_each(|round| {
            self.combine(largest, Some(round));
            accept(&self.scenario)
        })
    }

    /// Tests the smallest and largest value of each number with the other numbers at their first end. Errors name
    /// the distribution of the rejected field.
    fn check_one_by_one(&mut self, accept: &dyn Fn(&Value) -> Result<()>) -> Result<()> {
        let rounds = (0..self.rounds()).map(Some);
        iter::once(None).chain(rounds).try_for_each(|round| {
            self.combine(|_| 0, round);
            accept(&self.scenario).map_err(|error| self.named(error, round))
        })
    }

    /// Returns the largest number of tested values in a part.
    fn rounds(&self) -> usize {
        self.parts.values().map(Vec::len).max().unwrap_or(0)
    }

    /// Sets all numbers to the end that `others` returns. In a round, one number of each part has another end.
    fn combine(&mut self, others: impl Fn(&[End]) -> usize, round: Option<usize>) {
        for number in &mut self.numbers {
            number.chosen = others(&number.ends);
        }
        for ends in self.parts.values() {
            if let Some(&(index, end)) = round.and_then(|round| ends.get(round)) {
                self.numbers[index].chosen = end;
            }
        }
        for number in &self.numbers {
            set_number(&mut self.scenario, number.distribution, number.value());
        }
    }

    /// Returns the error with the name of the distribution to blame: that of the rejected field, or the one
    /// that has another end in this round.
    fn named(&self, error: Error, round: Option<usize>) -> Error {
        let Error::Config {
            field, expected, ..
        } = &error
        else {
            return error;
        };
        let varied = || {
            let ends = ancestors(field).find_map(|path| self.parts.get(path))?;
            ends.get(round?).map(|&(index, _)| index)
        };
        let Some(index) = self.indices.get(field.as_str()).copied().or_else(varied) else {
            return self.combination_error(&error);
        };
        let number = &self.numbers[index];
        let (end, value) = &number.ends[number.chosen];
        let path = format!("{}.{end}", path(index, number.distribution));
        Error::config(path, format!("{expected} ({field})"), value)
    }

    fn combination_error(&self, error: &Error) -> Error {
        let expected = format!("distributions with valid combinations of draws ({error})");
        let values: Vec<_> = self.numbers.iter().map(Number::value).collect();
        Error::config("randomization", expected, format!("{values:?}"))
    }
}

/// Returns the index of the end with the largest magnitude.
fn largest(ends: &[End]) -> usize {
    let magnitude = |end: &usize| ends[*end].1.abs();
    let largest = (0..ends.len()).max_by(|a, b| magnitude(a).total_cmp(&magnitude(b)));
    largest.unwrap_or(0)
}

/// Returns the index of the end with the smallest magnitude.
fn smallest(ends: &[End]) -> usize {
    let magnitude = |end: &usize| ends[*end].1.abs();
    let smallest = (0..ends.len()).min_by(|a, b| magnitude(a).total_cmp(&magnitude(b)));
    smallest.unwrap_or(0)
}

/// Returns the path of the smallest part of the scenario whose numbers can bound each other: the vector of a
/// list of vectors, the object around the number, or the number itself.
fn part(field: &str) -> &str {
    let vector = match field.rsplit_once('[') {
        Some((vector, _)) if field.ends_with(']') => vector,
        _ => field,
    };
    if vector.ends_with(']') {
        return vector;
    }
    field.rsplit_once('.').map_or(field, |(object, _)| object)
}

/// Returns a path and the paths of everything around it.
fn ancestors(path: &str) -> impl Iterator<Item = &str> {
    iter::successors(Some(path), |path| {
        path.rfind(['.', '[']).map(|end| &path[..end])
    })
}

/// Returns the path of a distribution in the scenario.
fn path(index: usize, distribution: &Distribution) -> String {
    format!("randomization[{index}].{}", distribution.as_ref())
}

/// Draws the randomized numbers of the episode with this seed and writes them to the scenario.
pub(crate) fn draw(distributions: &[Distribution], seed: u64, scenario: &mut Value) {
    let mut rng = rng::stream(seed, Stream::Scenario);
    for distribution in distributions {
        let value = distribution.draw(rng::uniform(&mut rng, 1.0));
        set_number(scenario, distribution, value);
    }
}

/// Writes the number of a distribution to the scenario.
fn set_number(scenario: &mut Value, distribution: &Distribution, value: f64) {
    if let Some(number) = number_at(scenario, distribution.field()) {
        *number = Value::from(value);
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
