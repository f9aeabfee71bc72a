"""Presets: named scenarios, the paper's, variations that differ from it in one respect, and other models."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, Final, TypeVar

from flockesc_env.common.checks import as_choice
from flockesc_env.common.errors import InputError, shown
from flockesc_env.scenario import parts, predators
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.predators import approach

Scenario = FlockScenario | LineScenario

MODELS: Final[Mapping[str, type[Scenario]]] = MappingProxyType({"flock": FlockScenario, "line": LineScenario})

_T = TypeVar("_T", bound=Scenario)


@dataclass(frozen=True)
class Preset:
    """A named scenario with a line that describes it. To make all of them is slow: each waits for its use."""

    description: str
    model: type[Scenario]
    differences: Mapping[str, Any]  # from the model's defaults

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario."""
        return self.model(**self.differences)


def _flock(description: str, **differences: Any) -> Preset:
    """Return a variation of the paper's flock, with some fields changed."""
    return Preset(description, FlockScenario, differences)


_VARIATIONS: Final = {
    "paper-flock": _flock("the paper's flock and its predator, which flies straight on"),
    "paper-line": Preset("the paper's line, with the linear escape force", LineScenario, {}),
    "constant-line": Preset(
        "the line with the constant escape force", LineScenario, {"escape_force": "constant"}
    ),
    "literal-law": _flock("the law as printed in the paper, under which speeds vary", constant_speed=False),
    # predators
    "edge-attack": _flock(
        "a path 50 m to the left of the flock's center, along its edge",
        predators=(predators.ConstantVelocity(*approach(50.0)),),
    ),
    "pursuit": _flock("a predator that turns toward the nearest agent", predators=(predators.PurePursuit(),)),
    "isolated-prey": _flock(
        "a pursuer of the most isolated agent", predators=(predators.PurePursuit(target="most_isolated"),)
    ),
    "confused-pursuit": _flock(
        "a pursuer that other agents distract from its target",
        predators=(predators.PurePursuit(confusion_rate=0.1),),
    ),
    "intercept": _flock("an interceptor with proportional navigation", predators=(predators.Intercept(),)),
    "wandering": _flock(
        "a predator whose heading performs a random walk", predators=(predators.Wandering(),)
    ),
    "two-predators": _flock(
        "a second predator comes from the opposite corner",
        predators=(predators.ConstantVelocity(), predators.ConstantVelocity((130.0, 130.0), (-10.0, -10.0))),
    ),
    "assigned-pair": _flock(
        "two pursuers of different agents",
        predators=(
            predators.PurePursuit((-20.0, -40.0), target="assigned"),
            predators.PurePursuit((-40.0, -20.0), target="assigned"),
        ),
    ),
    "encircled": _flock(
        "four predators on a circle around the flock",
        predators=(
            predators.Encircle((-30.0, -30.0), (10.0, 10.0), max_turn_rate=2.0),
            predators.Encircle((130.0, -30.0), (-10.0, 10.0), max_turn_rate=2.0),
            predators.Encircle((130.0, 130.0), (-10.0, -10.0), max_turn_rate=2.0),
            predators.Encircle((-30.0, 130.0), (10.0, -10.0), max_turn_rate=2.0),
        ),
    ),
    "herded": _flock(
        "one predator drives the flock toward another, which waits",
        predators=(predators.ConstantVelocity((130.0, 130.0), (0.0, 0.0)), predators.Herd(partner=0)),
    ),
    "capture": _flock(
        "a pursuer twice as fast as the agents, which catches them",
        predators=(predators.PurePursuit(*approach(speed=20.0), max_turn_rate=3.0),),
        capture_radius=2.0,
    ),
    "learned-predator": _flock("a predator that a policy controls", predators=(predators.Learned(),)),
    # neighbors
    "topological": _flock("agents listen to the k nearest", neighbor_rule=parts.Topological()),
    "mutual": _flock(
        "only agents among each other's k nearest are neighbors",
        neighbor_rule=parts.Topological(),
        mutual=True,
    ),
    "voronoi": _flock("agents listen to those in adjacent Voronoi cells", neighbor_rule=parts.Voronoi()),
    "field-of-view": _flock("agents are blind in the 120 degrees behind them", blind_angle=2 * math.pi / 3),
    "frozen-graph": _flock(
        "a control: all steps use the neighbor graph of the first step", frozen_graph=True
    ),
    # motion
    "vicsek": _flock(
        "the Vicsek model: headings without inertia, with noise", motion=parts.Vicsek(), angular_noise=1.0
    ),
    "reynolds": _flock("the Reynolds model (boids), with cohesion and separation", motion=parts.Reynolds()),
    "noisy-hearing": _flock("neighbors' velocities are sensed with noise of size v0", sensing_noise=1.0),
    "delayed-hearing": _flock("agents react to their neighbors with a delay of 0.5 s", sensing_delay=10),
    "leaders": _flock(
        "a tenth of the agents ignore their neighbors", alignment_strength=(0.0,) * 30 + (1.0,) * 270
    ),
    "fearless": _flock("a control: a flock that does not flee", repulsion_strength=0.0),
    # starts
    "space": _flock("a flock in a cube, attacked along its diagonal", dimension=3),
    "clusters": _flock(
        "five clusters, each denser than the paper's flock", initial_positions=parts.Clusters()
    ),
    "head-on": _flock(
        "a disc of agents that fly toward the predator",
        initial_positions=parts.Disc(),
        initial_headings=parts.AlignedHeadings(direction=(-1.0, -1.0)),
    ),
    "randomized": _flock(
        "the predator's aim, speed and range are random in each episode",
        predators=(predators.ConstantVelocity(*approach(direction=(1.0, 0.0))),),
        randomization=(
            parts.Uniform("predators[0].constant_velocity.position[1]", 0.0, 100.0),
            parts.Uniform("predators[0].constant_velocity.velocity[0]", 10.0, 20.0),
            parts.LogUniform("predator_range", 15.0, 60.0),
        ),
    ),
}

LITERATURE: Final = {
    "cohesive": _flock(
        "a school in which neighbors keep a distance of 5 m",
        motion=parts.PreferredDistance(),
        initial_positions=parts.Disc(radius=40.0),
    ),
    "order": _flock(
        "the model of Vicsek et al. in their periodic domain, which 10 m orders at little noise",
        num_agents=400,
        speed=6.0,
        motion=parts.Vicsek(),
        angular_noise=2.0,
        periodic_side=100.0,
        predators=(),
    ),
    "torus": _flock(
        "the model of Couzin et al., in which 60 m makes a school that mills; the attack is slow",
        num_agents=200,
        num_steps=1000,
        motion=parts.Zones(),
        blind_angle=math.pi / 2,
        angular_noise=0.1,
        initial_positions=parts.Disc(radius=30.0),
        predators=(predators.ConstantVelocity((-80.0, -80.0), (3.0, 3.0)),),
    ),
    "ring": _flock(
        "the model of Chen and Kolokolnikov, in which agents form a ring around the predator",
        speed=30.0,
        constant_speed=False,
        motion=parts.FirstOrder(repulsion=900.0, attraction=1.0),
        alignment_strength=0.0,
        repulsion_strength=180.0,
        predator_range=1000.0,
        predators=(predators.Attracted(position=(40.0, 50.0), velocity=(0.0, 0.0)),),
    ),
}
"""Models of other authors, which differ from the paper's flock in several respects."""

_STARTLED: Final[dict[str, Any]] = {
    "initial_headings": parts.AlignedHeadings(direction=(-1.0, -1.0), max_angle=0.5),
    "repulsion_strength": 100.0,
}

# A new preset needs its row in tests/golden/presets.json and in the table of docs/scenarios.md.
OF_TASKS: Final = {
    "flock-100": _flock("the paper's flock with 100 agents", num_agents=100),
    "flock-1000": _flock("the paper's flock with 1,000 agents", num_agents=1000),
    "varied": _flock(
        "the predator comes from a random side at a random speed", randomization=(parts.RandomApproach(),)
    ),
    "startled": _flock("a flock that flies toward the predator and flees strongly", **_STARTLED),
    "startled-pursuit": _flock(
        "the same flock and a pursuer", predators=(predators.PurePursuit(),), **_STARTLED
    ),
    "blocked-warnings": _flock(
        "a control: agents that no predator has reached do not hear those that one has", blocks_warnings=True
    ),
}
PRESETS: Final[Mapping[str, Preset]] = MappingProxyType(_VARIATIONS | OF_TASKS | LITERATURE)


def preset(name: str) -> Scenario:
    """Return the scenario of a preset, a key of ``PRESETS``."""
    return PRESETS[as_choice(name, "scenario", PRESETS)].scenario


def as_model(value: Any) -> Scenario:
    """Return a scenario of either model, given as itself or the name of a preset."""
    scenario = preset(value) if isinstance(value, str) else value
    if not isinstance(scenario, FlockScenario | LineScenario):
        raise InputError("scenario", "a FlockScenario, a LineScenario or a preset's name", shown(value))
    return scenario


def as_scenario(value: _T | str | None, model: type[_T]) -> _T:
    """Return a scenario of one model, given as itself or the name of a preset; ``None``: the paper's."""
    if value is None:
        return model()
    scenario = preset(value) if isinstance(value, str) else value
    if not isinstance(scenario, model):
        known = [name for name, each in PRESETS.items() if each.model is model]
        raise InputError("scenario", f"a {model.__name__} or one of {', '.join(known)}", shown(value))
    return scenario
