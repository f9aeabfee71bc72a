"""Table of the arguments of scenarios, parts, options, policies and results (see ``argument_table``)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from unittest import mock

import numpy as np
import pytest
from argument_kinds import (
    Bools,
    Call,
    Choice,
    Count,
    File,
    Flag,
    Floats,
    Index,
    Kind,
    Number,
    Part,
    Seed,
    Text,
)
from argument_table import (
    ENV_OPTIONS,
    FIXED,
    FLOCK,
    LINE,
    LINE_OPTIONS,
    NET,
    POINTS,
    RUN,
    RUNS,
    SCENARIO,
    SWEPT,
    Row,
    optional,
)

import flockesc_env as fe
from flockesc_env import policies, watch
from flockesc_env.common import stats
from flockesc_env.policies import network, registry
from flockesc_env.policies import predators as predator_policies
from flockesc_env.render import draw, video
from flockesc_env.watch.document import check_runs, run_document

PRESET = fe.preset("randomized").replace(num_agents=5, num_steps=24)
RENDER_OPTIONS: dict[str, Kind] = {
    "size": Count(160, low=160),
    "show": Choice("discs"),
    "agents": Part((0, 2), True, confusing=((-1,), (0.5,), ((0,),), "ab")),
    "trail": Number(2.0, low=0.0),
    "color": Choice("range"),
    "largest_range": optional(Number(20.0, low=0.0)),
}


class Model:
    """The interface of a stable-baselines3 model."""

    def predict(self, observations: Any, *, deterministic: bool) -> tuple[Any, None]:
        return np.zeros((len(observations), 1)), None


FIXED_LENGTH = Floats([1.0, 2.0, 4.0], has_extremes=False)
THE_FLOCK = Part(FLOCK, confusing=(LINE,))


def served(**arguments: Any) -> None:
    """Start a server and stop it before its first request."""
    with mock.patch("flockesc_env.watch.server._Server.work", side_effect=KeyboardInterrupt):
        watch.serve(**arguments)


PER_AGENT = Floats(np.arange(1.0, 6.0), low=0.0, is_scalar_fine=True)
POINT = Floats([1.0, 2.0])
LEAST_0 = Number(2.0, low=0.0)
FLOCK_FIELDS: dict[str, Kind] = {
    "num_agents": Count(5),
    "dimension": Count(2),
    "num_steps": Count(24),
    "time_step": Number(0.25, low=0.0, is_above=True),
    "mass": PER_AGENT,
    "speed": PER_AGENT,
    "initial_side": Number(30.0, low=0.0, is_above=True),
    "initial_positions": Part(fe.Disc(), confusing=(fe.RandomHeadings(), fe.Metric())),
    "initial_headings": Part(fe.RandomHeadings(), confusing=(fe.Disc(), fe.Metric())),
    "initial_plane": Flag(False),
    "predator_range": Number(30.0, low=0.0),
    "repulsion_strength": PER_AGENT,
    "alignment_strength": PER_AGENT,
    "motion": Part(fe.Reynolds(), confusing=(fe.Metric(),)),
    "angular_noise": Number(1.0, low=0.0, high=2 * np.pi),
    "sensing_noise": Number(1.0, low=0.0),
    "sensing_delay": Count(1, low=0),
    "constant_speed": Flag(True),
    "capture_radius": Number(1.0, True, low=0.0),
    "predators": Part((), accepts=("nothing",), confusing=((fe.Disc(),), fe.PurePursuit(), (None,), (5,))),
    "neighbor_rule": Part(fe.Metric(), confusing=(fe.Disc(), fe.PurePursuit())),
    "blind_angle": Number(1.0, low=0.0, high=2 * np.pi),
    "mutual": Flag(True),
    "frozen_graph": Flag(True),
    "periodic_side": Number(30.0, True, low=0.0, is_above=True),
    "randomization": Part((), accepts=("nothing",), confusing=((fe.Disc(),), (5,), fe.Metric())),
}
LINE_FIELDS: dict[str, Kind] = {
    "num_agents": Count(5),
    "predator_position": Number(0.5, True),
    "predator_range": Number(0.25, low=0.0),
    "repulsion_strength": Number(2.0, low=0.0),
    "escape_force": Choice("linear"),
    "tolerance": Number(0.25, low=0.0),
    "max_steps": Count(24),
}
START: dict[str, Kind] = {"position": Floats([1.0, 2.0], True), "velocity": Floats([1.0, 2.0], True)}
STEERING: dict[str, Kind] = START | {
    "max_turn_rate": LEAST_0,
    "max_speed": Number(40.0, True, low=np.hypot(1.0, 2.0)),
    "acceleration": LEAST_0,
}
PREDATORS: dict[type[Any], dict[str, Kind]] = {
    fe.ConstantVelocity: START,
    fe.PurePursuit: STEERING | {"target": Choice("nearest"), "confusion_rate": LEAST_0, "sight": LEAST_0},
    fe.Intercept: STEERING | {"navigation_constant": LEAST_0},
    fe.Encircle: STEERING | {"radius": LEAST_0, "closing_speed": LEAST_0},
    fe.Herd: STEERING | {"distance": LEAST_0, "partner": Count(0, low=0)},
    fe.Wandering: START | {"angular_diffusion": LEAST_0},
    fe.PrescribedPath: {
        "positions": Floats([[1.0, 2.0], [3.0, 5.0]], is_any_length=True),
        "interval": Number(0.5, True, low=0.0, is_above=True),
    },
    fe.Learned: START | {"max_acceleration": LEAST_0, "max_speed": Number(15.0, low=0.0, is_above=True)},
}
LENGTH = Number(8.0, low=0.0, is_above=True)
POSITIONS: dict[type[Any], dict[str, Kind]] = {
    fe.Square: {},
    fe.Disc: {"radius": LENGTH},
    fe.Ring: {"radius": LENGTH, "width": Number(4.0, low=0.0, high=16.0)},
    fe.Segment: {"start": POINT, "end": POINT},
    fe.Gaussian: {"standard_deviation": LEAST_0},
    fe.Clusters: {"num_clusters": Count(2), "standard_deviation": LEAST_0},
    fe.GivenPositions: {"points": Floats(POINTS)},
}
HEADINGS: dict[type[Any], dict[str, Kind]] = {
    fe.RandomHeadings: {},
    fe.AlignedHeadings: {"direction": POINT, "max_angle": Number(1.0, low=0.0, high=np.pi)},
    fe.GivenHeadings: {"directions": Floats(POINTS + 1.0)},
}
MOTIONS: dict[type[Any], dict[str, Kind]] = {
    fe.Inertial: {},
    fe.Vicsek: {},
    fe.Reynolds: {
        "separation_strength": LEAST_0,
        "cohesion_strength": LEAST_0,
        "separation_range": LEAST_0,
    },
}
RULES: dict[type[Any], dict[str, Kind]] = {fe.Metric: {}, fe.Topological: {}, fe.Voronoi: {}}
DRAWS: dict[type[Any], dict[str, Kind]] = {
    fe.Uniform: {"field": Choice("speed"), "low": Number(2.0), "high": Number(4.0, low=2.0)},
    fe.LogUniform: {
        "field": Choice("speed"),
        "low": Number(2.0, low=0.0, is_above=True),
        "high": Number(4.0, low=2.0),
    },
    fe.Choice: {"field": Choice("speed"), "values": Floats([2.0, 4.0], is_any_length=True)},
}
SLOTS: dict[str, tuple[Callable[[Any], Any], dict[type[Any], dict[str, Kind]]]] = {
    "predators": (lambda part: (fe.ConstantVelocity(), part), PREDATORS),
    "initial_positions": (lambda part: part, POSITIONS),
    "initial_headings": (lambda part: part, HEADINGS),
    "motion": (lambda part: part, MOTIONS),
    "neighbor_rule": (lambda part: part, RULES),
    "randomization": (lambda part: (part,), DRAWS),
}

PARTS = [
    pytest.param(slot, kind(**{name: given.good for name, given in arguments.items()}), id=kind.kind)
    for slot, (_, kinds) in SLOTS.items()
    for kind, arguments in kinds.items()
]
"""Slot and part, one entry per kind of part."""


def _part(slot: str, place: Callable[[Any], Any], kind: type[Any]) -> Callable[..., Any]:
    """Return a function that puts a part with some arguments into a scenario, which checks them."""
    return lambda **arguments: FLOCK.replace(**{slot: place(kind(**arguments))})


SCENARIOS: dict[str, Row] = {
    "FlockScenario": Row(fe.FlockScenario, FLOCK_FIELDS),
    "LineScenario": Row(fe.LineScenario, LINE_FIELDS),
    **{
        kind.__name__: Row(
            _part(slot, place, kind), arguments, named={name: (f"{kind.kind}.{name}",) for name in arguments}
        )
        for slot, (place, kinds) in SLOTS.items()
        for kind, arguments in kinds.items()
    },
    "FlockScenario.from_json": Row(fe.FlockScenario.from_json, {"document": Text(FLOCK.to_json())}),
    "FlockScenario.from_toml": Row(fe.FlockScenario.from_toml, {"document": Text(FLOCK.to_toml())}),
    "FlockScenario.drawn": Row(PRESET.drawn, {"seed": Seed(3)}),
    "FlockScenario.replace": Row(FLOCK.replace, others=FLOCK_FIELDS),
    "LineScenario.from_json": Row(fe.LineScenario.from_json, {"document": Text(LINE.to_json())}),
    "LineScenario.from_toml": Row(fe.LineScenario.from_toml, {"document": Text(LINE.to_toml())}),
    "LineScenario.replace": Row(LINE.replace, others=LINE_FIELDS),
    "EnvOptions": Row(fe.EnvOptions, ENV_OPTIONS),
    "EnvOptions.replace": Row(fe.EnvOptions().replace, others=ENV_OPTIONS),
    "LineOptions": Row(fe.LineOptions, LINE_OPTIONS),
    "LineOptions.replace": Row(fe.LineOptions().replace, others=LINE_OPTIONS),
    "RenderOptions": Row(fe.RenderOptions, RENDER_OPTIONS),
}
RANGE = Number(4.0, low=0.0)
_RULE: dict[str, Kind] = {
    "patience": Number(0.25, low=0.0),
    "first_range": Number(8.0, low=0.0),
    "interaction_range": Number(4.0, low=0.0),
    "growth": Number(3.0, low=0.0),
    "min_neighbors": Number(2.0, low=0.0),
    "crowding": Number(1.0, low=0.0),
    "agreement": Number(1.0, low=0.0),
}
POLICIES: dict[str, Row] = {
    "FixedRange": Row(policies.FixedRange, {"interaction_range": RANGE}, after=vars),
    "RandomRange": Row(
        policies.RandomRange, {"seed": Seed(3, True)}, after=lambda made: made._rng.bit_generator.state
    ),
    "ScheduledRange": Row(
        policies.ScheduledRange,
        {"schedule": Floats(np.full((24, 5), 4.0), low=0.0, is_any_length=True)},
        after=vars,
    ),
    "StubbornLeaders": Row(
        policies.StubbornLeaders, {"min_cosine": Number(0.5), "interaction_range": RANGE}, after=vars
    ),
    "ListenWhileFleeing": Row(
        policies.ListenWhileFleeing, {"min_cosine": Number(0.1), "interaction_range": RANGE}, after=vars
    ),
    "StubbornWitnesses": Row(
        policies.StubbornWitnesses,
        _RULE,
        after=vars,
        named=dict.fromkeys(_RULE, tuple(_RULE)),
    ),
    "ListenWhileThreatened": Row(
        policies.ListenWhileThreatened,
        {name: Number(20.0, low=0.0) for name in ("unaware_range", "aware_range", "safe_distance")},
        after=vars,
    ),
    "WinStayLoseShift": Row(
        policies.WinStayLoseShift,
        {
            **{name: Number(2.0, low=0.0) for name in ("short_range", "long_range", "threshold", "pause")},
            "criterion": Choice("escape_direction"),
        },
        after=vars,
    ),
    "SpreadOut": Row(
        policies.SpreadOut,
        {name: Number(0.5, low=0.0) for name in ("spread_time", "gain", "interaction_range")},
        after=vars,
    ),
    "BestNextHeading": Row(policies.BestNextHeading, {"turn": Number(0.5, low=0.0)}, after=vars),
    "StepAside": Row(
        policies.StepAside, {name: Number(0.5, low=0.0) for name in ("aside_time", "weight")}, after=vars
    ),
    "BestCandidate": Row(
        policies.BestCandidate,
        {
            "entry": Text("escape_cosine"),
            "per_agent": Flag(True),
            "unaware_range": Number(20.0, low=0.0),
            "polarization_cost": Number(0.5, low=0.0),
        },
        after=vars,
    ),
    "SB3Policy": Row(
        policies.SB3Policy, {"model": Part(Model()), "deterministic": Flag(True)}, after=lambda _: None
    ),
    "bind": Row(
        policies.bind, {"policy": Part(FIXED), "env": Part(fe.FlockEscapeEnv(FLOCK))}, after=lambda _: None
    ),
    "FlyStraight": Row(predator_policies.FlyStraight, after=vars),
    "Pursue": Row(predator_policies.Pursue, {"target": Choice("nearest")}, after=vars),
    "Architecture": Row(
        network.Architecture,
        {
            "inputs": Part(("time",), confusing=((1,), "time")),
            "hidden": Part((2,), accepts=("nothing",), confusing=((0,), (2.0,), (-1,), (True,))),
            "memory": Count(1, low=0),
            "mirror": Flag(True),
            "squash": Choice("tanh"),
            "candidate_inputs": Part((), accepts=("nothing",), confusing=((1,), "range")),
        },
    ),
    "NetworkPolicy": Row(
        network.NetworkPolicy,
        {"architecture": Part(NET), "parameters": Floats(np.arange(NET.size) * 1.0)},
        after=lambda made: made.parameters,
    ),
    "NamedPolicy": Row(
        registry.NamedPolicy,
        {
            "name": Text("a name"),
            "policy": Part(FIXED),
            "per_agent": Flag(True),
            "options": Part({}, accepts=("dict",)),
            "scenario": Part(FLOCK, True, confusing=(fe.Disc(),)),
        },
    ),
    "NamedPolicy.record": Row(
        registry.NamedPolicy("fixed", FIXED).record, {"seed": Seed(3), "scenario": SCENARIO}
    ),
}
VALUES = Floats([1.0, 2.0, 4.0], is_any_length=True, has_extremes=False)
RESULTS: dict[str, Row] = {
    "FlockSweepResult.values": Row(SWEPT.values, {"objective": Choice("mean", True)}),
    "FlockSweepResult.best_range": Row(SWEPT.best_range, {"objective": Choice("mean", True)}),
    "FlockSweepResult.hindsight_oracle": Row(SWEPT.hindsight_oracle, {"objective": Choice("mean", True)}),
    "FlockSweepResult.mean_with_interval": Row(
        SWEPT.mean_with_interval,
        {"objective": Choice("mean", True), "confidence": Number(0.5, low=0.0, high=1.0, is_above=True)},
    ),
    "FlockSweepResult.plot": Row(
        lambda objective: SWEPT.plot(objective).axes[0].lines[0].get_xydata(),
        {"objective": Choice("mean", True)},
    ),
    "FlockSweepResult.to_parquet": Row(SWEPT.to_parquet, {"path": File("made.parquet")}),
    "stats.mean": Row(stats.mean, {"values": VALUES}),
    "stats.improvement": Row(
        stats.improvement,
        {"values": FIXED_LENGTH, "baseline": FIXED_LENGTH},
        named={"values": ("values", "baseline")},
    ),
    "stats.share": Row(stats.share, {"is_so": Bools(np.array([True, False]))}),
    "stats.argmax": Row(
        stats.argmax,
        {
            "positions": Floats([1.0, 2.0], has_extremes=False),
            "values": Floats([[1.0, 2.0, 4.0], [2.0, 4.0, 1.0]], has_extremes=False),
        },
        named={"positions": ("positions", "values")},
    ),
    "watch.write_page": Row(watch.write_page, {"runs": RUNS, "path": File("made.html")}),
    "watch.run_document": Row(run_document, {"name": Text("a"), "trajectory": Part(RUN, confusing=(FLOCK,))}),
    "watch.serve": Row(
        served,
        {
            "runs": RUNS,
            "scenario": THE_FLOCK,
            "seed": Seed(3),
            "port": Index(0, high=2**16 - 1),
            "open_browser": Flag(False),
        },
    ),
    "video.write_video": Row(
        video.write_video,
        {"runs": RUNS, "path": File("made.mp4"), "options": Part(fe.RenderOptions(size=160), True)},
        others={
            "fps": Count(4),
            "speed": Number(4.0, low=0.0, is_above=True),
            "objective": Choice("minimum"),
            "progress": Call(None, True),
        },
    ),
    "watch.check_runs": Row(check_runs, {"runs": RUNS}),
    "render.draw": Row(
        draw,
        {
            "run": Part(RUN, confusing=(FLOCK,)),
            "step": Count(3, low=0),
            "options": optional(Part(fe.RenderOptions())),
            "title": Text("a run"),
            "objective": Choice("survival"),
        },
    ),
}
