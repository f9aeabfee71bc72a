"""Scenarios, and their parts: initial states, predators, neighbor rules, laws of motion, distributions."""

from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.parts import *
from flockesc_env.scenario.predators import *
from flockesc_env.scenario.presets import PRESETS, preset

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
]
