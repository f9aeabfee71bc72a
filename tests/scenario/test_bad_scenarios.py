"""Scenarios and options whose parts do not fit together: a ScenarioError names the field.

Bad values of single fields are in ``test_arguments``.
"""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest

from flockesc_env import (
    AlignedHeadings,
    Clusters,
    ConstantVelocity,
    Encircle,
    FlockScenario,
    Herd,
    Intercept,
    PurePursuit,
    Ring,
    Segment,
    Vicsek,
)
from flockesc_env.common.errors import ScenarioError


@pytest.mark.parametrize(
    ("dimension", "predator", "field"),
    [
        (3, ConstantVelocity((1.0, 2.0, 3.0, 4.0)), "constant_velocity.position"),
        (2, PurePursuit(target="centroid", confusion_rate=1.0), "pure_pursuit.confusion_rate"),
        (2, PurePursuit(target="assigned", confusion_rate=1.0), "pure_pursuit.confusion_rate"),
        (2, PurePursuit(acceleration=1.0), "pure_pursuit.acceleration"),
        *(
            (2, make(max_speed=14.1), f"{make.kind}.max_speed")
            for make in (PurePursuit, Intercept, Encircle, Herd)
        ),
        *((2, Herd(partner=bad), "herd.partner") for bad in (1, 2)),
    ],
)
def test_predators(dimension: int, predator: Any, field: str) -> None:
    """The allowed values depend on other fields."""
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(dimension=dimension, predators=(ConstantVelocity(), predator))
    assert caught.value.field == f"predators[1].{field}"


def test_too_many_predators_with_assigned_targets() -> None:
    pack = (PurePursuit(target="assigned"),) * 64
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(predators=(*pack, PurePursuit(), PurePursuit(target="assigned")))
    assert caught.value.field == "predators"
    assert len(FlockScenario(predators=(*pack, PurePursuit())).predators) == 65


@pytest.mark.parametrize(
    ("part", "field"),
    [
        (Ring(5.0, 10.1), "positions.ring.width"),
        (Clusters(10**7 + 1), "positions.clusters.num_clusters"),
        *(
            (AlignedHeadings(bad), "headings.aligned.direction")
            for bad in ((0.0, 0.0), (-0.0, 0.0), (1e-200, 0.0))
        ),
        (AlignedHeadings((0.0, 1e300)), "headings.aligned.direction[1]"),
    ],
)
def test_initial_states(part: Any, field: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(**{"initial_" + field.partition(".")[0]: part})
    assert caught.value.field == f"initial_{field}"


@pytest.mark.parametrize(
    ("field", "part"),
    [
        ("initial_positions.segment.start[2]", Segment((0.0, 0.0, 1.0), (1.0, 1.0, 0.0))),
        ("initial_positions.segment.end[2]", Segment(end=(1.0, 1.0, -1.0))),
        ("initial_headings.aligned.direction[2]", AlignedHeadings((1.0, 0.0, 0.1))),
    ],
)
def test_a_start_in_the_plane_refuses_a_height(field: str, part: Any) -> None:
    name = field.partition(".")[0]
    space = FlockScenario(dimension=3, **{name: part})
    with pytest.raises(ScenarioError) as caught:
        space.replace(initial_plane=True)
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ({"num_agent": 5}, "num_agent"),
        (
            {"predators": [{"constant_velocity": {"positon": [0, 0]}}]},
            "predators[0].constant_velocity.positon",
        ),
        (
            {"predators": [{"constant_velocity": {"max_turn_rate": 1}}]},
            "predators[0].constant_velocity.max_turn_rate",
        ),
        ({"predators": [{"constant_velocity": {}}, {"hawk": {}}]}, "predators[1]"),
        ({"predators": [{"constant_velocity": {}, "pure_pursuit": {}}]}, "predators[0]"),
        ({"predators": [{}]}, "predators[0]"),
        ({"predators": [{"metric": {}}]}, "predators[0]"),
        ({"predators": [{"pure_pursuit": 5}]}, "predators[0].pure_pursuit"),
        ({"neighbor_rule": {"topological": {"k": 7}}}, "neighbor_rule.topological.k"),
        ({"initial_positions": {"torus": {}}}, "initial_positions"),
        ({"initial_headings": {"ring": {}}}, "initial_headings"),
        ({"speed": {"metric": {}}}, "speed"),
        ({"speed": np.nan}, "speed"),
        ([], "document"),
        (None, "document"),
        ("flock", "document"),
    ],
)
def test_documents(document: Any, field: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario.from_json(json.dumps(document))
    assert caught.value.field == field


@pytest.mark.parametrize("field", ["mass", "speed", "repulsion_strength", "alignment_strength"])
def test_one_number_per_agent(field: str) -> None:
    for values in ((1.0, 2.0), (1.0,) * 4, ()):
        with pytest.raises(ScenarioError, match=f"^{field}: expected a number or 3 numbers"):
            FlockScenario(num_agents=3, **{field: values})
    with pytest.raises(ScenarioError, match=rf"^{field}\[2\]"):
        FlockScenario(num_agents=3, **{field: (1.0, 2.0, -1.0)})


def test_vicsek_needs_constant_speed() -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(motion=Vicsek(), constant_speed=False)
    assert caught.value.field == "constant_speed"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"num_agents": 3.5}, "num_agents: expected an integer, got 3.5"),
        ({"mass": (0.1, "heavy")}, "mass[1]: expected a number, got 'heavy'"),
        ({"capture_radius": True}, "capture_radius: expected a number or None, got True"),
        ({"predators": PurePursuit()}, "predators: expected a tuple of predators, got PurePursuit"),
        (
            {"predators": (PurePursuit(target="nearst"),)},  # type: ignore[arg-type]
            "predators[0].pure_pursuit.target: expected one of nearest, centroid, most_isolated, assigned,"
            " got 'nearst' (did you mean nearest?)",
        ),
        ({"motion": {"reynolds": {"cohesion": 1}}}, "got 'cohesion' (did you mean cohesion_strength?)"),
    ],
)
def test_errors_name_type_and_value(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(message)):
        FlockScenario(**changes)
