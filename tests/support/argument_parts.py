"""Table of the arguments of scenarios, parts, options, policies and results (see ``argument_table``)."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, get_args
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
    Text,
)
from argument_table import (
    A_RUN,
    ENV_OPTIONS,
    FIXED,
    FLOCK,
    LINE,
    LINE_OPTIONS,
    NET,
    POINTS,
    SWEPT,
    Row,
)

import flockesc_env as fe
from flockesc_env import policies, watch
from flockesc_env.common import stats
from flockesc_env.policies import network, registry
from flockesc_env.policies import predators as predator_policies
from flockesc_env.render import draw, video
from flockesc_env.scenario import initial, motion, neighbors, predators, randomization
from flockesc_env.watch.document import check_runs, run_document

PRESET = fe.preset("randomized").replace(num_agents=5, num_steps=24)
RENDER_OPTIONS: dict[str, Kind] = {
    "size": Count(160, low=160),
    "show": Choice("discs"),
    "agents": Part((0, 2), True, confusing=((-1,), (0.5,), ((0,),), "ab")),
    "color": Choice("range"),
    "largest_range": Number(20.0, low=0.0),
}


class Model:
    """The interface of a stable-baselines3 model."""

    def predict(self, observations: Any, *, deterministic: bool) -> tuple[Any, None]:
        return np.zeros((len(observations), 1)), None


FIXED_LENGTH = Floats([1.0, 2.0, 4.0], has_extremes=False)


def served(**arguments: Any) -> None:
    with mock.patch("flockesc_env.watch.server.Server.serve_forever", side_effect=KeyboardInterrupt):
        watch.serve(**arguments)


PER_AGENT = Floats(np.arange(1.0, 6.0), low=0.0, is_scalar_fine=True)
POINT = Floats([1.0, 2.0])
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
    "repulsion_strength": PER_AGENT,
    "alignment_strength": PER_AGENT,
    "motion": Part(fe.Reynolds(), confusing=(fe.Metric(),)),
    "angular_noise": Number(1.0, low=0.0, high=2 * np.pi),
    "sensing_delay": Count(1, low=0),
    "capture_radius": Number(1.0, True, low=0.0),
    "predators": Part((), accepts=("nothing",), confusing=((fe.Disc(),), fe.PurePursuit(), (None,), (5,))),
    "neighbor_rule": Part(fe.Metric(), confusing=(fe.Disc(), fe.PurePursuit())),
    "blind_angle": Number(1.0, low=0.0, high=2 * np.pi),
    "periodic_side": Number(30.0, True, low=0.0, is_above=True),
    "randomization": Part((), accepts=("nothing",), confusing=((fe.Disc(),), (5,), fe.Metric())),
}
LINE_FIELDS: dict[str, Kind] = {
    "num_agents": Count(5),
    "predator_position": Number(0.5, True),
    "predator_range": Number(0.25, low=0.0),
    "repulsion_strength": Number(2.0, low=0.0),
    "escape_force": Choice("linear"),
    "max_steps": Count(24),
}
RADIUS = {"radius": Number(8.0, low=0.0, is_above=True)}
HIGH = Number(4.0, low=2.0)
BOUNDS: dict[type[Any], dict[str, Kind]] = {
    fe.PurePursuit: {"target": Choice("nearest")},
    fe.Herd: {"partner": Count(0, low=0)},
    fe.PrescribedPath: {
        "positions": Floats([[1.0, 2.0], [3.0, 5.0]], is_any_length=True),
        "interval": Number(0.5, low=0.0, is_above=True),
    },
    fe.Learned: {"max_speed": Number(15.0, low=0.0, is_above=True)},
    fe.Disc: RADIUS,
    fe.Ring: RADIUS | {"width": Number(4.0, low=0.0, high=16.0)},
    fe.Segment: {"start": POINT, "end": POINT},
    fe.Clusters: {"num_clusters": Count(2)},
    fe.GivenPositions: {"points": Floats(POINTS)},
    fe.AlignedHeadings: {"direction": POINT, "max_angle": Number(1.0, low=0.0, high=np.pi)},
    fe.GivenHeadings: {"directions": Floats(POINTS + 1.0)},
    fe.Uniform: {"low": Number(2.0), "high": HIGH},
    fe.LogUniform: {"low": Number(2.0, low=0.0, is_above=True), "high": HIGH},
    fe.Choice: {"values": Floats([2.0, 4.0], is_any_length=True)},
}
"""Arguments of parts whose bounds do not follow from their name or type."""
SLOTS: dict[str, tuple[Callable[[Any], Any], Any]] = {
    "predators": (lambda part: (fe.ConstantVelocity(), part), predators.Predator),
    "initial_positions": (lambda part: part, initial.InitialPositions),
    "initial_headings": (lambda part: part, initial.InitialHeadings),
    "motion": (lambda part: part, motion.Motion),
    "neighbor_rule": (lambda part: part, neighbors.NeighborRule),
    "randomization": (lambda part: (part,), randomization.Distribution),
}
"""A scenario with a part of each family, and the classes of the family."""

SLOT_ROWS = [
    Row(
        lambda slot=slot, place=place, kind=kind, **given: FLOCK.replace(**{slot: place(kind(**given))}),
        BOUNDS.get(kind, {}),
        named={name: (f"{kind.kind}.{name}",) for name in inspect.signature(kind).parameters},
        like=kind,
    )
    for slot, (place, family) in SLOTS.items()
    for kind in get_args(family)
]
"""A scenario checks its parts."""

PARTS = [
    pytest.param(
        slot, row.like(**{name: given.good for name, given in row.arguments.items()}), id=row.like.kind
    )
    for slot, (_, family) in SLOTS.items()
    for row in SLOT_ROWS
    if row.like in get_args(family)
]
"""Slot and part, one entry per kind of part."""

FLOCK_ROW, LINE_ROW = Row(fe.FlockScenario, FLOCK_FIELDS), Row(fe.LineScenario, LINE_FIELDS)
SCENARIOS: dict[str, Row] = {
    "FlockScenario": FLOCK_ROW,
    "LineScenario": LINE_ROW,
    **{row.like.__name__: row for row in SLOT_ROWS},
    "FlockScenario.from_json": Row(fe.FlockScenario.from_json, {"document": Text(FLOCK.to_json())}),
    "FlockScenario.from_toml": Row(fe.FlockScenario.from_toml, {"document": Text(FLOCK.to_toml())}),
    "FlockScenario.drawn": Row(PRESET.drawn),
    "FlockScenario.replace": Row(FLOCK.replace, others=FLOCK_ROW.arguments),
    "LineScenario.from_json": Row(fe.LineScenario.from_json, {"document": Text(LINE.to_json())}),
    "LineScenario.from_toml": Row(fe.LineScenario.from_toml, {"document": Text(LINE.to_toml())}),
    "LineScenario.replace": Row(LINE.replace, others=LINE_ROW.arguments),
    "EnvOptions": Row(fe.EnvOptions, ENV_OPTIONS),
    "EnvOptions.replace": Row(fe.EnvOptions().replace, others=ENV_OPTIONS),
    "LineOptions": Row(fe.LineOptions, LINE_OPTIONS),
    "LineOptions.replace": Row(fe.LineOptions().replace, others=LINE_OPTIONS),
    "RenderOptions": Row(fe.RenderOptions, RENDER_OPTIONS),
}
THRESHOLDS = (
    "patience",
    "first_range",
    "interaction_range",
    "growth",
    "min_neighbors",
    "crowding",
    "agreement",
)
POLICIES: dict[str, Row] = {
    **{
        rule.__name__: Row(rule, arguments, after=vars)
        for rule, arguments in {
            policies.FixedRange: {},
            policies.ScheduledRange: {"schedule": Floats(np.full((24, 5), 4.0), low=0.0, is_any_length=True)},
            policies.StubbornLeaders: {"min_cosine": Number(0.5)},
            policies.ListenWhileFleeing: {"min_cosine": Number(0.1)},
            policies.ListenWhileThreatened: {},
            policies.WinStayLoseShift: {"criterion": Choice("escape_direction")},
            policies.SpreadOut: {},
            policies.BestNextHeading: {},
            policies.StepAside: {},
            policies.BestCandidate: {"entry": Text("escape_cosine")},
            predator_policies.FlyStraight: {},
            predator_policies.Pursue: {"target": Choice("nearest")},
        }.items()
    },
    "StubbornWitnesses": Row(
        policies.StubbornWitnesses, after=vars, named=dict.fromkeys(THRESHOLDS, THRESHOLDS)
    ),
    "RandomRange": Row(policies.RandomRange, after=lambda made: made._rng.bit_generator.state),
    "SB3Policy": Row(policies.SB3Policy, {"model": Part(Model())}, after=lambda _: None),
    "bind": Row(policies.bind, {"env": Part(fe.FlockEscapeEnv(FLOCK))}, after=lambda _: None),
    "Architecture": Row(
        network.Architecture,
        {
            "inputs": Part(("time",), confusing=((1,), "time")),
            "hidden": Part((2,), accepts=("nothing",), confusing=((0,), (2.0,), (-1,), (True,))),
            "memory": Count(1, low=0),
            "squash": Choice("tanh"),
            "candidate_inputs": Part((), accepts=("nothing",), confusing=((1,), "range")),
            "ranges": Part((), accepts=("nothing",), confusing=(("far",), (-1.0,), 3.0)),
        },
    ),
    "NetworkPolicy": Row(
        network.NetworkPolicy,
        {"architecture": Part(NET), "parameters": Floats(np.arange(NET.size) * 1.0)},
        after=lambda made: made.parameters,
    ),
    "NamedPolicy": Row(
        registry.NamedPolicy,
        {"options": Part({}, accepts=("dict",)), "scenario": Part(FLOCK, True, confusing=(fe.Disc(),))},
    ),
    "NamedPolicy.record": Row(registry.NamedPolicy("fixed", FIXED).record),
}
VALUES = Floats([1.0, 2.0, 4.0], is_any_length=True, has_extremes=False)
RESULTS: dict[str, Row] = {
    "FlockSweepResult.values": Row(SWEPT.values),
    "FlockSweepResult.best_range": Row(SWEPT.best_range),
    "FlockSweepResult.hindsight_oracle": Row(SWEPT.hindsight_oracle),
    "FlockSweepResult.mean_with_interval": Row(
        SWEPT.mean_with_interval, {"confidence": Number(0.5, low=0.0, high=1.0, is_above=True)}
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
    "watch.write_page": Row(watch.write_page, {"path": File("made.html")}),
    "watch.run_document": Row(run_document),
    "watch.serve": Row(
        served,
        {
            "scenario": Part(FLOCK, confusing=(LINE,)),
            "port": Index(0, high=2**16 - 1),
            "open_browser": Flag(False),
        },
        like=watch.serve,
    ),
    "video.write_video": Row(
        video.write_video,
        {
            "path": File("made.mp4"),
            "options": Part(fe.RenderOptions(size=160)),
            "fps": Count(4),
            "speed": Number(4.0, low=0.0, is_above=True),
            "objective": Choice("minimum"),
            "progress": Call(None),
        },
    ),
    "watch.check_runs": Row(check_runs),
    "render.draw": Row(
        draw,
        {
            "run": A_RUN,
            "step": Count(3, low=0),
            "options": Part(fe.RenderOptions()),
            "title": Text("a run"),
            "objective": Choice("survival"),
        },
    ),
}
