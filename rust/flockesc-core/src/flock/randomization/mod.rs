//! Domain randomization: numbers of a scenario that every episode draws anew, from its seed.

mod distribution;
#[cfg(test)]
mod tests;

use rand_chacha::ChaCha8Rng;
use serde::Deserialize;
use serde_json::Value;

use crate::base::error::{Error, Result};
use crate::base::rng::{self, Stream};
use crate::flock::scenario::FlockConfig;
pub use distribution::{Choice, Distribution, Interval};

/// Fields that stay: the length scale of observations, and the time between two steps.
const FIXED: [&str; 2] = ["initial_side", "time_step"];

/// Draws that are tried when a scenario is made. Those of an episode are repeated while they are refused: were a share p of
/// all accepted, p^32 (1 - p)^64 < 1e-26 bounds the chance that the first succeed and the second come to nothing.
const TRIALS: u64 = 32;
const ATTEMPTS: usize = 64;

/// What every episode draws, in this order.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(from = "Vec<Distribution>")]
pub struct Randomization {
    distributions: Vec<Distribution>,
    /// The scenario that drawn numbers are put into; null where nothing is drawn.
    scenario: Value,
}

impl From<Vec<Distribution>> for Randomization {
    fn from(distributions: Vec<Distribution>) -> Self {
        Self {
            distributions,
            scenario: Value::Null,
        }
    }
}

impl Randomization {
    /// Takes the scenario, which is good as it stands, and checks that it stays so under whatever is drawn: under both
    /// ends of every distribution, the others at their lows, and under some draws.
    pub(crate) fn prepare(&mut self, mut scenario: Value) -> Result<()> {
        if self.distributions.is_empty() {
            return Ok(());
        }
        scenario["randomization"] = Value::Array(Vec::new());
        for index in 0..self.distributions.len() {
            self.check(index, &mut scenario)?;
        }
        self.scenario = scenario;
        let lows = vec![0; self.distributions.len()];
        self.check_ends(&lows, None)?;
        for (index, distribution) in self.distributions.iter().enumerate() {
            for end in 1..distribution.ends().len() {
                let mut ends = lows.clone();
                ends[index] = end;
                self.check_ends(&ends, Some(index))?;
            }
        }
        for seed in 0..TRIALS {
            let values = self.values(&mut rng::stream(seed, Stream::Scenario));
            FlockConfig::from_value(&self.with(&values)).map_err(|error| apart(&error, &values))?;
        }
        Ok(())
    }

    fn check(&self, index: usize, scenario: &mut Value) -> Result<()> {
        let distribution = &self.distributions[index];
        let (path, field) = (self.path(index), distribution.field());
        distribution.check(&path)?;
        let mut earlier = self.distributions[..index].iter();
        let is_real = number_at(scenario, field).is_some_and(|value| value.is_f64());
        if is_real && !FIXED.contains(&field) && earlier.all(|other| other.field() != field) {
            return Ok(());
        }
        let expected = "the path of a real number of the scenario other than initial_side and time_step, \
                        such as predators[0].pure_pursuit.max_turn_rate, once";
        Err(Error::config(
            format!("{path}.field"),
            expected,
            format!("{field:?}"),
        ))
    }

    fn path(&self, index: usize) -> String {
        format!(
            "randomization[{index}].{}",
            self.distributions[index].kind()
        )
    }

    /// Checks the scenario with the end `ends[k]` of every distribution k. An error is on the one that sets the refused
    /// field, or else on `varied`.
    fn check_ends(&self, ends: &[usize], varied: Option<usize>) -> Result<()> {
        let mut chosen: Vec<(String, f64)> = (self.distributions.iter().zip(ends))
            .map(|(distribution, &end)| distribution.ends().swap_remove(end))
            .collect();
        let values: Vec<f64> = chosen.iter().map(|(_, value)| *value).collect();
        let error = match FlockConfig::from_value(&self.with(&values)) {
            Err(error) => error,
            Ok(_) => return Ok(()),
        };
        let Error::Config {
            field, expected, ..
        } = &error
        else {
            return Err(error);
        };
        let mut fields = self.distributions.iter().map(Distribution::field);
        let Some(index) = fields.position(|set| set == field).or(varied) else {
            return Err(apart(&error, &values));
        };
        let (end, value) = chosen.swap_remove(index);
        let path = format!("{}.{end}", self.path(index));
        Err(Error::config(path, format!("{expected} ({field})"), value))
    }

    fn values(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        self.distributions.iter().map(|d| d.draw(rng)).collect()
    }

    /// The scenario with these numbers.
    fn with(&self, values: &[f64]) -> Value {
        let mut scenario = self.scenario.clone();
        for (distribution, value) in self.distributions.iter().zip(values) {
            if let Some(number) = number_at(&mut scenario, distribution.field()) {
                *number = Value::from(*value);
            }
        }
        scenario
    }

    /// The scenario of the episode with this seed, as document and parsed; `None` where nothing is drawn.
    pub(crate) fn draw(&self, seed: u64) -> Option<(Value, FlockConfig)> {
        if self.distributions.is_empty() {
            return None;
        }
        let mut rng = rng::stream(seed, Stream::Scenario);
        (0..ATTEMPTS).find_map(|_| {
            let scenario = self.with(&self.values(&mut rng));
            let config = FlockConfig::from_value(&scenario).ok()?;
            Some((scenario, config))
        })
    }
}

/// Values that are refused together.
fn apart(error: &Error, values: &[f64]) -> Error {
    let expected = format!("distributions of which all draws are good ({error})");
    Error::config("randomization", expected, format!("{values:?}"))
}

/// The entry of a document at a path such as `predators[0].pure_pursuit.position[1]`.
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
