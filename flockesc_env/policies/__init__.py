"""Range policies and predator policies, built-in and from files, and rollouts of them."""

from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import BasePolicy, Policy, RowMemory
from flockesc_env.policies.memory_rules import ListenWhileThreatened, StubbornWitnesses, WinStayLoseShift
from flockesc_env.policies.network import Architecture, NetworkPolicy, PredatorNetwork, torch_network
from flockesc_env.policies.outcomes import Episodes, LineEpisodes
from flockesc_env.policies.registry import NAMES, as_policy, bind, load_policy, save_policy, trained
from flockesc_env.policies.rules import (
    BestCandidate,
    BestNextHeading,
    FixedRange,
    FlyStraight,
    ListenWhileFleeing,
    Pursue,
    RandomRange,
    ScheduledRange,
    StubbornLeaders,
)
from flockesc_env.policies.sb3 import SB3Policy

__all__ = [
    "NAMES",
    "Architecture",
    "BasePolicy",
    "BestCandidate",
    "BestNextHeading",
    "Episodes",
    "FixedRange",
    "FlyStraight",
    "LineEpisodes",
    "ListenWhileFleeing",
    "ListenWhileThreatened",
    "NetworkPolicy",
    "Policy",
    "PolicySpec",
    "PredatorNetwork",
    "Pursue",
    "RandomRange",
    "RowMemory",
    "SB3Policy",
    "ScheduledRange",
    "StubbornLeaders",
    "StubbornWitnesses",
    "WinStayLoseShift",
    "as_policy",
    "bind",
    "load_policy",
    "save_policy",
    "torch_network",
    "trained",
]
