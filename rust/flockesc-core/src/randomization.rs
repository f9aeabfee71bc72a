//! Domain randomization: numbers of a scenario that every episode draws anew, from its seed.

use rand_chacha::ChaCha8Rng;
use serde::Deserialize;
use serde_json::Value;

use crate::config::{FlockConfig, finite, positive};
use crate::error::{Error, Result};
use crate::rng::{self, Stream};

/// Fields that stay: the length scale of observations, and the time between two steps.
const FIXED: [&str; 2] = ["initial_side", "time_step"];

/// Draws that are tried when a scenario is made. Those of an episode are repeated while they are refused: were a share p of
/// all accepted, p^32 (1 - p)^64 < 1e-26 bounds the chance that the first succeed and the second come to nothing.
const TRIALS: u64 = 32;
const ATTEMPTS: usize = 64;

/// What a number of the scenario is drawn from.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// Uniform.
    Uniform(Interval),
    /// Uniform in its logarithm; above 0.
    LogUniform(Interval),
    /// One of some values, all as likely.
    Choice(Choice),
}

/// A number between two others.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interval {
    /// Path of the number in the scenario, as errors name it.
    pub field: String,
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
}

/// One of some numbers.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// Path of the number in the scenario, as errors name it.
    pub field: String,
    /// At least one.
    pub values: Vec<f64>,
}

impl Distribution {
    fn kind(&self) -> &'static str {
        match self {
            Self::Uniform(_) => "uniform",
            Self::LogUniform(_) => "log_uniform",
            Self::Choice(_) => "choice",
        }
    }

    fn field(&self) -> &str {
        match self {
            Self::Uniform(interval) | Self::LogUniform(interval) => &interval.field,
            Self::Choice(choice) => &choice.field,
        }
    }

    fn check(&self, path: &str) -> Result<()> {
        match self {
            Self::Uniform(interval) => interval.check(path),
            Self::LogUniform(interval) => {
                positive(&format!("{path}.low"), interval.low)?;
                interval.check(path)
            }
            Self::Choice(choice) => {
                let field = format!("{path}.values");
                if choice.values.is_empty() {
                    return Err(Error::config(field, "at least one number", "none"));
                }
                let mut places = choice.values.iter().enumerate();
                places.try_for_each(|(k, &value)| finite(&format!("{field}[{k}]"), value))
            }
        }
    }

    /// The smallest and the largest value, or all of them, each with the name of where it stands.
    fn ends(&self) -> Vec<(String, f64)> {
        match self {
            Self::Uniform(Interval { low, high, .. })
            | Self::LogUniform(Interval { low, high, .. }) => {
                vec![("low".to_owned(), *low), ("high".to_owned(), *high)]
            }
            Self::Choice(choice) => (0..)
                .zip(&choice.values)
                .map(|(k, &value)| (format!("values[{k}]"), value))
                .collect(),
        }
    }

    /// One uniform number makes one value; rounding does not carry it beyond the ends.
    fn draw(&self, rng: &mut ChaCha8Rng) -> f64 {
        let part = rng::uniform(rng, 1.0);
        let between = |low: f64, high: f64| low * (1.0 - part) + high * part;
        match self {
            Self::Uniform(Interval { low, high, .. }) => between(*low, *high).clamp(*low, *high),
            Self::LogUniform(Interval { low, high, .. }) => {
                // libm, not the platform's: a seed means the same scenario on every machine.
                libm::exp(between(libm::log(*low), libm::log(*high))).clamp(*low, *high)
            }
            Self::Choice(Choice { values, .. }) => {
                let place = (part * values.len() as f64) as usize;
                values[place.min(values.len() - 1)]
            }
        }
    }
}

impl Interval {
    fn check(&self, path: &str) -> Result<()> {
        finite(&format!("{path}.low"), self.low)?;
        let field = format!("{path}.high");
        finite(&field, self.high)?;
        if self.low <= self.high {
            return Ok(());
        }
        let expected = format!("a number of at least low = {:?}", self.low);
        Err(Error::config(field, expected, self.high))
    }
}

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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use serde_json::json;

    use super::*;

    fn scenario(randomization: Value) -> Result<Arc<FlockConfig>> {
        let document = json!({
            "num_agents": 5, "dimension": 2, "num_steps": 240, "time_step": 0.05, "mass": 0.1,
            "speed": 10.0, "initial_side": 100.0, "predator_range": 30.0,
            "initial_positions": {"ring": {"radius": 40.0, "width": 10.0}},
            "initial_headings": {"random": {}},
            "initial_plane": false, "repulsion_strength": 10.0, "constant_speed": true,
            "predators": [{"constant_velocity": {"position": [-30.0, -30.0], "velocity": [10.0, 10.0]}}],
            "neighbor_rule": {"metric": {}}, "randomization": randomization
        });
        FlockConfig::from_json(&document.to_string()).map(Arc::new)
    }

    fn uniform(field: &str, low: f64, high: f64) -> Value {
        json!({"uniform": {"field": field, "low": low, "high": high}})
    }

    /// The meaning of a seed: these numbers must never change, on any machine.
    #[test]
    fn a_seed_is_a_scenario() {
        let config = scenario(json!([
            uniform("predator_range", 20.0, 40.0),
            {"log_uniform": {"field": "mass", "low": 0.01, "high": 1.0}},
            {"choice": {"field": "predators[0].constant_velocity.position[1]", "values": [-30.0, 0.0, 30.0]}},
        ]))
        .expect("it is good");
        let drawn = config.drawn(0);
        let predator = format!("{:?}", drawn.predators);
        assert_eq!(drawn.predator_range, 23.105478078486367);
        assert_eq!(drawn.mass.of(0), 0.06568521508434387);
        assert!(predator.contains("[-30.0, -30.0]"), "{predator}");
        assert_eq!(drawn.drawn(1), drawn);
        assert_ne!(config.drawn(1).mass, drawn.mass);
    }

    #[test]
    fn draws_spread_between_the_ends() {
        let config = scenario(json!([
            uniform("predator_range", 20.0, 40.0),
            {"log_uniform": {"field": "mass", "low": 0.01, "high": 1.0}},
            {"choice": {"field": "repulsion_strength", "values": [1.0, 2.0, 4.0]}},
        ]))
        .expect("it is good");
        let drawn: Vec<_> = (0..3000).map(|seed| config.drawn(seed)).collect();
        let share = |is_so: &dyn Fn(&FlockConfig) -> bool| {
            drawn.iter().filter(|config| is_so(config)).count() as f64 / 3000.0
        };
        assert_eq!(share(&|c| (20.0..=40.0).contains(&c.predator_range)), 1.0);
        assert_eq!(share(&|c| (0.01..=1.0).contains(&c.mass.of(0))), 1.0);
        for (found, expected) in [
            (share(&|c| c.predator_range < 25.0), 0.25),
            (share(&|c| c.mass.of(0) < 0.1), 0.5),
            (share(&|c| c.repulsion_strength.of(0) == 4.0), 1.0 / 3.0),
        ] {
            assert!((found - expected).abs() < 0.03, "{found} {expected}");
        }
    }

    #[test]
    fn ends_that_are_equal_are_hit_exactly() {
        let config = scenario(json!([uniform("speed", 0.1, 0.1)])).expect("it is good");
        assert!((0..100).all(|seed| config.drawn(seed).speed.of(0) == 0.1));
    }

    #[test]
    fn what_is_never_good_is_refused_by_its_field() {
        let log = json!({"log_uniform": {"field": "mass", "low": 0.0, "high": 1.0}});
        let reversed = uniform("mass", 1.0, 0.5);
        let twice = json!([uniform("mass", 1.0, 2.0), uniform("mass", 1.0, 2.0)]);
        let choice = |values: Value| json!([{"choice": {"field": "mass", "values": values}}]);
        for (randomization, field) in [
            (
                json!([uniform("mass", -1.0, 1.0)]),
                "randomization[0].uniform.low",
            ),
            (json!([log]), "randomization[0].log_uniform.low"),
            (json!([reversed]), "randomization[0].uniform.high"),
            (twice, "randomization[1].uniform.field"),
            (choice(json!([])), "randomization[0].choice.values"),
            (
                choice(json!([1.0, 0.0])),
                "randomization[0].choice.values[1]",
            ),
            (json!([{"normal": {}}]), "randomization[0]"),
            (
                json!([uniform("speed", 1.0, 2.0), uniform("mass", -1.0, 1.0)]),
                "randomization[1].uniform.low",
            ),
            (
                json!([uniform("initial_positions.ring.width", 0.0, 81.0)]),
                "randomization[0].uniform.high",
            ),
        ] {
            match scenario(randomization.clone()) {
                Err(Error::Config { field: named, .. }) => assert_eq!(named, field),
                other => panic!("{randomization}: {other:?}"),
            }
        }
        for field in [
            "num_agents",
            "initial_side",
            "time_step",
            "constant_speed",
            "predators",
            "predators[1].constant_velocity.position[0]",
            "predators[00].constant_velocity.position[0]",
            "predators.0.constant_velocity.position[0]",
            "predators[0].constant_velocity.position[2]",
            "randomization[0].uniform.low",
            "wings",
            "",
            "mass.",
            "mass]",
            "mass[0]",
        ] {
            match scenario(json!([uniform(field, 1.0, 2.0)])) {
                Err(Error::Config { field: named, .. }) => {
                    assert_eq!(named, "randomization[0].uniform.field");
                }
                other => panic!("{field}: {other:?}"),
            }
        }
    }

    /// Ends that are good one by one do not make every draw good.
    #[test]
    fn distributions_that_do_not_go_together_are_refused() {
        let together = scenario(json!([
            uniform("initial_positions.ring.radius", 10.0, 40.0),
            uniform("initial_positions.ring.width", 0.0, 20.0),
        ]));
        assert!(together.is_ok());
        let sometimes = scenario(json!([
            {"choice": {"field": "initial_positions.ring.radius", "values": [40.0, 5.0]}},
            {"choice": {"field": "initial_positions.ring.width", "values": [0.0, 80.0]}},
        ]));
        match sometimes {
            Err(Error::Config {
                field, expected, ..
            }) => {
                assert_eq!(field, "randomization");
                assert!(
                    expected.contains("initial_positions.ring.width"),
                    "{expected}"
                );
            }
            other => panic!("{other:?}"),
        }
    }
}
