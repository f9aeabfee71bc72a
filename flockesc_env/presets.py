"""Scenarios by name: the paper's, and variations of it that differ in one thing each."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple, TypeVar

from flockesc_env.approach import approach
from flockesc_env.errors import ScenarioError
from flockesc_env.initial import AlignedHeadings, Clusters, Disc
from flockesc_env.predators import ConstantVelocity, Intercept, PurePursuit, Wandering
from flockesc_env.randomization import LogUniform, Uniform
from flockesc_env.scenario import FlockScenario, LineScenario, Scenario

_T = TypeVar("_T", bound=Scenario)


class Preset(NamedTuple):
    """A scenario and what it is, in one line."""

    description: str
    scenario: Scenario


PRESETS: Final[Mapping[str, Preset]] = MappingProxyType(
    {
        "paper-flock": Preset("the paper's flock and its predator, which flies straight on", FlockScenario()),
        "paper-line": Preset("the paper's line, with the linear escape force", LineScenario()),
        "constant-line": Preset(
            "the line with the constant escape force", LineScenario(escape_force="constant")
        ),
        "edge-attack": Preset(
            "a path 50 m to the left of the flock's center, along its edge",
            FlockScenario(predators=(ConstantVelocity(*approach(50.0)),)),
        ),
        "pursuit": Preset(
            "a predator that turns toward the nearest agent", FlockScenario(predators=(PurePursuit(),))
        ),
        "isolated-prey": Preset(
            "a pursuer of the agent that is farthest from all others",
            FlockScenario(predators=(PurePursuit(target="most_isolated"),)),
        ),
        "confused-pursuit": Preset(
            "a pursuer that loses its prey among many",
            FlockScenario(predators=(PurePursuit(confusion_rate=0.1),)),
        ),
        "intercept": Preset(
            "a predator that leads its prey by proportional navigation",
            FlockScenario(predators=(Intercept(),)),
        ),
        "wandering": Preset("a predator without a plan", FlockScenario(predators=(Wandering(),))),
        "two-predators": Preset(
            "a second predator comes from the opposite corner",
            FlockScenario(predators=(ConstantVelocity(), ConstantVelocity((130.0, 130.0), (-10.0, -10.0)))),
        ),
        "space": Preset(
            "a flock in a cube, attacked along its diagonal",
            FlockScenario(
                dimension=3,
                predators=(ConstantVelocity((-30.0, -30.0, -30.0), (10.0, 10.0, 10.0)),),
            ),
        ),
        "randomized": Preset(
            "aim, speed and range of the predator, drawn anew each episode",
            FlockScenario(
                predators=(ConstantVelocity(*approach(direction=(1.0, 0.0))),),
                randomization=(
                    Uniform("predators[0].constant_velocity.position[1]", 0.0, 100.0),
                    Uniform("predators[0].constant_velocity.velocity[0]", 10.0, 20.0),
                    LogUniform("predator_range", 15.0, 60.0),
                ),
            ),
        ),
        "literal-law": Preset(
            "the printed law, under which agents do not keep their speed", FlockScenario(constant_speed=False)
        ),
        "clusters": Preset(
            "five groups, each denser than the paper's flock", FlockScenario(initial_positions=Clusters())
        ),
        "head-on": Preset(
            "a disc of agents that all head toward the predator",
            FlockScenario(initial_positions=Disc(), initial_headings=AlignedHeadings(direction=(-1.0, -1.0))),
        ),
    }
)


def preset(name: str) -> Scenario:
    """Return a scenario by its name in ``PRESETS``.

    Raises:
        ScenarioError: for an unknown name.
    """
    if not isinstance(name, str) or name not in PRESETS:
        raise ScenarioError("scenario", f"one of {', '.join(PRESETS)}", repr(name))
    return PRESETS[name].scenario


def as_scenario(value: _T | str | None, model: type[_T]) -> _T:
    """Return a scenario of one model: ``value`` itself, the preset of that name, the paper's for ``None``.

    Raises:
        ScenarioError: for an unknown name, or a scenario of the other model.
    """
    if value is None:
        return model()
    scenario = preset(value) if isinstance(value, str) else value
    if not isinstance(scenario, model):
        known = [name for name, (_, known) in PRESETS.items() if isinstance(known, model)]
        raise ScenarioError("scenario", f"a {model.__name__} or one of {', '.join(known)}", repr(value))
    return scenario
