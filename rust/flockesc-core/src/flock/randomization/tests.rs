use std::cell::Cell;
use std::sync::Arc;

use serde_json::{Value, json};

use super::{Distribution, check};
use crate::base::error::{Error, Result};
use crate::flock::FlockConfig;
use crate::flock::scenario::tests::paper;

fn scenario(randomization: Value) -> Result<Arc<FlockConfig>> {
    let mut document = paper();
    document["num_agents"] = json!(5);
    document["initial_positions"] = json!({"ring": {"radius": 40.0, "width": 10.0}});
    document["randomization"] = randomization;
    FlockConfig::from_json(&document.to_string()).map(Arc::new)
}

fn uniform(field: &str, low: f64, high: f64) -> Value {
    json!({"uniform": {"field": field, "low": low, "high": high}})
}

/// These numbers must never change, on any machine, because they determine what a seed generates.
#[test]
fn a_seed_draws_the_same_numbers() {
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
fn draws_have_their_distribution() {
    let config = scenario(json!([
        uniform("predator_range", 20.0, 40.0),
        {"log_uniform": {"field": "mass", "low": 0.01, "high": 1.0}},
        {"choice": {"field": "repulsion_strength", "values": [1.0, 2.0, 4.0]}},
    ]))
    .expect("it is good");
    let drawn: Vec<_> = (0..3000).map(|seed| config.drawn(seed)).collect();
    let share = |holds: &dyn Fn(&FlockConfig) -> bool| {
        drawn.iter().filter(|config| holds(config)).count() as f64 / 3000.0
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
fn equal_ends_are_drawn_exactly() {
    let config = scenario(json!([uniform("speed", 0.1, 0.1)])).expect("it is good");
    assert!((0..100).all(|seed| config.drawn(seed).speed.of(0) == 0.1));
}

#[test]
fn invalid_distributions_are_rejected_by_field() {
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

/// Every end is valid by itself, but not every combination.
#[test]
fn invalid_combinations_are_rejected() {
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

/// If all combinations of the ends are valid, every draw between them is valid.
#[test]
fn all_draws_between_valid_ends_are_valid() {
    let pursuer = "predators[0].pure_pursuit";
    let mut document = paper();
    document["initial_positions"] = json!({"ring": {"radius": 40.0, "width": 10.0}});
    document["predators"] = json!([{"pure_pursuit": {
        "position": [0.0, 0.0], "velocity": [1.0, 0.0], "max_turn_rate": 1.0, "max_speed": 9.0, "acceleration": 1.0,
        "target": "nearest", "confusion_rate": 0.0, "sight": 30.0,
    }}]);
    document["randomization"] = json!([
        uniform("initial_positions.ring.radius", 1.0, 40.0),
        uniform("initial_positions.ring.width", 0.0, 2.0),
        uniform(&format!("{pursuer}.velocity[0]"), -3.0, 3.0),
        uniform(&format!("{pursuer}.velocity[1]"), -4.0, 4.0),
        uniform(&format!("{pursuer}.max_speed"), 5.0, 9.0),
    ]);
    let config = Arc::new(FlockConfig::from_json(&document.to_string()).expect("it is good"));
    assert!((0..2000).all(|seed| config.drawn(seed).check().is_ok()));
    document["randomization"][4] = uniform(&format!("{pursuer}.max_speed"), 4.5, 9.0);
    let error = FlockConfig::from_json(&document.to_string()).expect_err("5 m/s is too fast");
    assert!(error.to_string().contains("max_speed"), "{error}");
}

/// A test of the scenario takes time proportional to its size, and the number of tests depends neither on the
/// number of randomized numbers nor on the number of values.
#[test]
fn the_number_of_tests_does_not_grow_with_the_document() {
    let calls = |numbers: &[&str], parts: usize, values: usize| {
        let predator = json!({"velocity": [1.0, 1.0], "max_speed": 9.0});
        let document = json!({
            "mass": vec![0.1; parts],
            "points": vec![vec![0.0; 2]; parts],
            "predators": vec![json!({"herd": predator}); parts],
        });
        let values: Vec<f64> = (0..values).map(|k| k as f64 - 1.0).collect();
        let distributions: Vec<_> = (0..parts)
            .flat_map(|k| {
                numbers
                    .iter()
                    .map(move |number| number.replace('#', &k.to_string()))
            })
            .map(|field| {
                let values = values.clone();
                Distribution::Choice { field, values }
            })
            .collect();
        let calls = Cell::new(0);
        let accept = |_: &Value| {
            calls.set(calls.get() + 1);
            Ok(())
        };
        check(&distributions, document, accept).expect("every test is accepted");
        calls.get()
    };
    for numbers in [
        &["mass[#]"][..],
        &["points[#][0]", "points[#][1]"],
        &[
            "predators[#].herd.velocity[0]",
            "predators[#].herd.velocity[1]",
            "predators[#].herd.max_speed",
        ],
    ] {
        let few = calls(numbers, 1, 3);
        assert!(few <= 2 * numbers.len() + 1, "{few}");
        assert_eq!(calls(numbers, 500, 200), few);
    }
}

#[test]
fn every_end_of_many_values_is_tested() {
    let bounds = |first: f64| {
        let values: Vec<f64> = (0..70).map(|k| first + f64::from(k)).collect();
        let choices = ["position[0]", "position[1]"].map(|number| {
            let field = format!("predators[0].constant_velocity.{number}");
            json!({"choice": {"field": field, "values": values}})
        });
        scenario(json!(choices))
    };
    assert!(bounds(-20.0).is_ok());
    for first in [-1e21, 1e21] {
        assert!(bounds(first).is_err(), "{first}");
    }
}
