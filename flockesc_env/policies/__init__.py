"""Policies that set interaction ranges or steer predators, by name and in files, and rollouts of them."""

from flockesc_env.policies.predators import FlyStraight, Pursue
from flockesc_env.policies.ranges import (
    FixedRange,
    Policy,
    RandomRange,
    SB3Policy,
    ScheduledRange,
    StubbornLeaders,
    StubbornWitnesses,
    bind,
)

__all__ = [
    "FixedRange",
    "FlyStraight",
    "Policy",
    "Pursue",
    "RandomRange",
    "SB3Policy",
    "ScheduledRange",
    "StubbornLeaders",
    "StubbornWitnesses",
    "bind",
]
