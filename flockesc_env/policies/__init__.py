"""Range policies and predator policies, built-in and from files, rollouts of them, and the planner."""

from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import Policy, RowMemory, bind
from flockesc_env.policies.files import find_policy, load_policy, save_policy
from flockesc_env.policies.memory_rules import ListenWhileThreatened, StubbornWitnesses, WinStayLoseShift
from flockesc_env.policies.network import Architecture, NetworkPolicy, torch_network
from flockesc_env.policies.planner import Plan, PlannedEpisode, Planner
from flockesc_env.policies.predators import FlyStraight, Pursue
from flockesc_env.policies.ranges import FixedRange, RandomRange, ScheduledRange
from flockesc_env.policies.registry import NAMES, NamedPolicy, built_in
from flockesc_env.policies.rules import BestCandidate, BestNextHeading, ListenWhileFleeing, StubbornLeaders
from flockesc_env.policies.sb3 import SB3Policy

__all__ = [
    "NAMES",
    "Architecture",
    "BestCandidate",
    "BestNextHeading",
    "FixedRange",
    "FlyStraight",
    "ListenWhileFleeing",
    "ListenWhileThreatened",
    "NamedPolicy",
    "NetworkPolicy",
    "Plan",
    "PlannedEpisode",
    "Planner",
    "Policy",
    "PolicySpec",
    "Pursue",
    "RandomRange",
    "RowMemory",
    "SB3Policy",
    "ScheduledRange",
    "StubbornLeaders",
    "StubbornWitnesses",
    "WinStayLoseShift",
    "bind",
    "built_in",
    "find_policy",
    "load_policy",
    "save_policy",
    "torch_network",
]
