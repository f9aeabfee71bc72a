use std::sync::Arc;

use serde_json::{Value, json};

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
    let drawn = config.drawn(0).expect("a good draw");
    let predator = format!("{:?}", drawn.predators);
    assert_eq!(drawn.predator_range, 23.105478078486367);
    assert_eq!(drawn.mass.of(0), 0.06568521508434387);
    assert!(predator.contains("[-30.0, -30.0]"), "{predator}");
    assert_eq!(drawn.drawn(1), Ok(drawn.clone()));
    let approach = json!({"predator": 0, "distance": 100.0, "low": 10.0, "high": 20.0});
    let config = scenario(json!([{"random_approach": approach}])).expect("it is good");
    let predator = format!("{:?}", config.drawn(0).expect("a good draw").predators);
    let expected = "position: [-15.192533633347587, -52.03094248625163], \
                    velocity: [8.65485196418211, 12.782492738138505]";
    assert!(predator.contains(expected), "{predator}");
    assert_ne!(config.drawn(1).expect("a good draw").mass, drawn.mass);
}

#[test]
fn draws_have_their_distribution() {
    let config = scenario(json!([
        uniform("predator_range", 20.0, 40.0),
        {"log_uniform": {"field": "mass", "low": 0.01, "high": 1.0}},
        {"choice": {"field": "repulsion_strength", "values": [1.0, 2.0, 4.0]}},
    ]))
    .expect("it is good");
    let drawn: Result<Vec<_>> = (0..3000).map(|seed| config.drawn(seed)).collect();
    let drawn = drawn.expect("good draws");
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
    assert!((0..100).all(|seed| {
        config
            .drawn(seed)
            .is_ok_and(|drawn| drawn.speed.of(0) == 0.1)
    }));
}

#[test]
fn invalid_distributions_are_rejected_by_field() {
    let log = json!({"log_uniform": {"field": "mass", "low": 0.0, "high": 1.0}});
    let reversed = uniform("mass", 1.0, 0.5);
    let twice = json!([uniform("mass", 1.0, 2.0), uniform("mass", 1.0, 2.0)]);
    let approach = |predator: usize, low: f64| json!([{"random_approach": {"predator": predator, "distance": 9.0, "low": low, "high": 2.0}}]);
    let choice = |values: Value| json!([{"choice": {"field": "mass", "values": values}}]);
    for (randomization, field) in [
        (json!([log]), "randomization[0].log_uniform.low"),
        (json!([reversed]), "randomization[0].uniform.high"),
        (twice, "randomization[1].uniform.field"),
        (choice(json!([])), "randomization[0].choice.values"),
        (json!([{"normal": {}}]), "randomization[0]"),
        (
            approach(1, 1.0),
            "randomization[0].random_approach.predator",
        ),
        (approach(0, 3.0), "randomization[0].random_approach.high"),
    ] {
        match scenario(randomization.clone()) {
            Err(Error::Input { field: named, .. }) => assert_eq!(named, field),
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
            Err(Error::Input { field: named, .. }) => {
                assert_eq!(named, "randomization[0].uniform.field");
            }
            other => panic!("{field}: {other:?}"),
        }
    }
}

/// A draw is checked with the other numbers of the scenario.
#[test]
fn draws_out_of_bounds_are_rejected_by_field() {
    let config = scenario(json!([
        {"choice": {"field": "initial_positions.ring.radius", "values": [40.0, 5.0]}},
        {"choice": {"field": "initial_positions.ring.width", "values": [0.0, 80.0]}},
    ]))
    .expect("the distributions are good");
    let checks: Vec<_> = (0..100).map(|seed| config.drawn(seed)).collect();
    let accepted = checks.iter().filter(|check| check.is_ok()).count();
    assert!((60..90).contains(&accepted), "{accepted}");
    for (seed, error) in checks.into_iter().enumerate() {
        if let Err(error) = error {
            let (field, given) = ("initial_positions.ring.width: ", format!("seed {seed}"));
            let text = error.to_string();
            assert!(text.starts_with(field) && text.ends_with(&given), "{text}");
        }
    }
}
