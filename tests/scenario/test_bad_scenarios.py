"""Scenarios whose parts do not fit together, and documents that are none: an error names the field.

Bad values of single fields are in ``test_arguments``.
"""

import json
import re
from typing import Any

import numpy as np
import pytest

import flockesc_env as fe
from flockesc_env import scenario as sc
from flockesc_env.common.errors import InputError

PATH, POINTS = ((0.0, 0.0), (1.0, 2.0)), ((1.0, 2.0),) * 4
IN_PLANE = {"dimension": 3, "initial_plane": True}
TOO_MANY, UNEVEN = sc.Clusters(10**7 + 1), sc.GivenPositions((*POINTS, (1.0, 2.0, 3.0)))
AT_REST = sc.GivenHeadings((*POINTS, (0.0, 0.0)))
CONTRADICTIONS: list[tuple[dict[str, Any], str]] = [
    ({"motion": sc.Vicsek(), "constant_speed": False}, "constant_speed"),
    ({"neighbor_rule": sc.Voronoi(), "dimension": 3}, "neighbor_rule"),
    ({"periodic_side": 100.0}, "periodic_side"),
    ({"periodic_side": 100.0, "predators": (), "neighbor_rule": sc.Voronoi()}, "periodic_side"),
    *(
        ({"periodic_side": 29.9, "predators": (), "initial_positions": positions}, "periodic_side")
        for positions in (sc.Square(), sc.Clusters(), sc.Disc(15.0), sc.Ring(14.0, 2.0))
    ),
    ({"mass": (1.0, 2.0)}, "mass"),
    ({"speed": (1.0, 2.0, -1.0, 1.0, 1.0)}, "speed[2]"),
    ({"predators": (sc.PurePursuit(target="assigned"),) * 65}, "predators"),
    ({"predators": (sc.ConstantVelocity(),) * 10_001}, "predators"),
    ({"randomization": (sc.Uniform("mass", 0.1, 1.0),) * 10_001}, "randomization"),
    *(
        ({"randomization": (sc.Uniform("speed", 5.0, 10.0), part)}, f"randomization[1].{field}")
        for part, field in (
            (sc.Uniform("wings", 0.0, 1.0), "uniform.field"),
            (sc.Uniform("time_step", 0.01, 0.05), "uniform.field"),
            (sc.Uniform("predators[2].pure_pursuit.sight", 1.0, 2.0), "uniform.field"),
            (sc.Uniform("speed", 1.0, 2.0), "uniform.field"),
            (sc.LogUniform("mass", 0.0, 1.0), "log_uniform.low"),
            (sc.RandomApproach(2), "random_approach.predator"),
        )
    ),
    *(
        ({"initial_positions": positions, **changes}, f"initial_positions.{field}")
        for positions, changes, field in (
            (sc.Ring(5.0, 10.1), {}, "ring.width"),
            (TOO_MANY, {}, "clusters.num_clusters"),
            (sc.GivenPositions(POINTS), {}, "given_positions.points"),
            (UNEVEN, {}, "given_positions.points[4]"),
            (sc.Segment(end=(1.0, 1.0, -1.0)), IN_PLANE, "segment.end[2]"),
        )
    ),
    *(
        ({"initial_headings": headings, **changes}, f"initial_headings.{field}")
        for headings, changes, field in (
            (sc.AlignedHeadings((1e-200, 0.0)), {}, "aligned.direction"),
            (sc.AlignedHeadings((0.0, 1e300)), {}, "aligned.direction[1]"),
            (sc.AlignedHeadings((1.0, 0.0, 0.1)), IN_PLANE, "aligned.direction[2]"),
            (AT_REST, {}, "given_headings.directions[4]"),
        )
    ),
    *(
        ({"predators": (sc.ConstantVelocity(), predator)}, f"predators[1].{field}")
        for predator, field in (
            (sc.ConstantVelocity((1.0, 2.0, 3.0, 4.0)), "constant_velocity.position"),
            (sc.PurePursuit(velocity=(1.0, 2.0, 3.0)), "pure_pursuit.velocity"),
            (sc.PurePursuit(target="centroid", confusion_rate=1.0), "pure_pursuit.confusion_rate"),
            (sc.PurePursuit(acceleration=1.0), "pure_pursuit.acceleration"),
            (sc.PurePursuit(max_speed=14.1), "pure_pursuit.max_speed"),
            (sc.Herd(partner=1), "herd.partner"),
            (sc.PrescribedPath(PATH[:1]), "prescribed_path.positions"),
            (sc.PrescribedPath(((0.0, 0.0), (1.0, 1e21))), "prescribed_path.positions[1][1]"),
        )
    ),
]


@pytest.mark.parametrize(("changes", "field"), CONTRADICTIONS)
def test_contradictions(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError) as caught:
        fe.FlockScenario(**{"num_agents": 5, **changes})
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ({"num_agent": 5}, "num_agent"),
        ({"predators": [{"constant_velocity": {"positon": [0]}}]}, "predators[0].constant_velocity.positon"),
        ({"predators": [{"constant_velocity": {}}, {"hawk": {}}]}, "predators[1]"),
        ({"predators": [{"constant_velocity": {}, "pure_pursuit": {}}]}, "predators[0]"),
        ({"predators": [{}]}, "predators[0]"),
        ({"predators": [{"pure_pursuit": 5}]}, "predators[0].pure_pursuit"),
        ({"speed": {"metric": {}}}, "speed"),
        ({"speed": np.nan}, "speed"),
        ([], "document"),
        (None, "document"),
    ],
)
def test_documents(document: Any, field: str) -> None:
    with pytest.raises(InputError) as caught:
        fe.FlockScenario.from_json(json.dumps(document))
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"num_agents": 3.5}, "num_agents: expected an integer, got 3.5"),
        ({"mass": (0.1, "heavy")}, "mass[1]: expected a number, got 'heavy'"),
        ({"predators": sc.PurePursuit()}, "predators: expected a tuple of predators, got PurePursuit"),
        ({"motion": {"reynolds": {"cohesion": 1}}}, "got 'cohesion' (did you mean cohesion_strength?)"),
        (
            {"dimension": 3, "predators": (sc.Wandering((1.0, 2.0)),)},
            "predators[0].wandering.position: expected 3 numbers, got 2 numbers",
        ),
        ({"predators": (sc.ConstantVelocity(),) * 10_001}, "expected at most 10000 predators, got 10001"),
    ],
)
def test_errors_name_type_and_value(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        fe.FlockScenario(**changes)


DEEP, HUGE = "[" * 100_000, "1" + "0" * 5000
HOSTILE = {
    "json": (DEEP, f'{{"num_agents": {HUGE}}}', '{"num_agents": 5, "num_agents": 6}', '{"\\ud800": 5}', "\0"),
    "toml": (f"mass = {DEEP}", f"num_agents = {HUGE}", "num_agents = 5\nnum_agents = 6", "mass = 1979-05-27"),
}


@pytest.mark.parametrize("model", [fe.FlockScenario, fe.LineScenario])
@pytest.mark.parametrize("language", HOSTILE)
def test_hostile_texts_have_short_errors(model: Any, language: str) -> None:
    """Deep, huge, repeated and foreign values."""
    read = model.from_json if language == "json" else model.from_toml
    for text in HOSTILE[language]:
        with pytest.raises(InputError) as caught:
            read(text)
        assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("field", ["num_agents", "num_steps", "sensing_delay"])
def test_large_numbers_take_no_memory_before_they_are_used(field: str) -> None:
    """Loading a scenario allocates no flock; only environments and simulations do."""
    assert getattr(fe.FlockScenario.from_json(json.dumps({field: 10**7})), field) == 10**7
