"""Scenarios, and their parts: initial states, predators, neighbor rules, laws of motion, distributions."""

from flockesc_env.scenario.approach import approach
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.initial import (
    AlignedHeadings,
    Clusters,
    Disc,
    Gaussian,
    GivenHeadings,
    GivenPositions,
    RandomHeadings,
    Ring,
    Segment,
    Square,
)
from flockesc_env.scenario.initial_files import read_initial_state
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.motion import FirstOrder, Inertial, PreferredDistance, Reynolds, Vicsek, Zones
from flockesc_env.scenario.neighbors import Metric, NeighborRule, Topological, Voronoi
from flockesc_env.scenario.predators import (
    Attracted,
    ConstantVelocity,
    Encircle,
    Herd,
    Intercept,
    Learned,
    PrescribedPath,
    PurePursuit,
    Wandering,
)
from flockesc_env.scenario.presets import PRESETS, preset
from flockesc_env.scenario.randomization import Choice, LogUniform, RandomApproach, Uniform

__all__ = [
    "PRESETS",
    "AlignedHeadings",
    "Attracted",
    "Choice",
    "Clusters",
    "ConstantVelocity",
    "Disc",
    "Encircle",
    "FirstOrder",
    "FlockScenario",
    "Gaussian",
    "GivenHeadings",
    "GivenPositions",
    "Herd",
    "Inertial",
    "Intercept",
    "Learned",
    "LineScenario",
    "LogUniform",
    "Metric",
    "NeighborRule",
    "PreferredDistance",
    "PrescribedPath",
    "PurePursuit",
    "RandomApproach",
    "RandomHeadings",
    "Reynolds",
    "Ring",
    "Segment",
    "Square",
    "Topological",
    "Uniform",
    "Vicsek",
    "Voronoi",
    "Wandering",
    "Zones",
    "approach",
    "preset",
    "read_initial_state",
]
