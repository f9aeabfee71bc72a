"""Names of settings and policies in figures, and of references."""

from __future__ import annotations

from studies.findings.kinds import searched_rule
from studies.findings.results import BEST_FIXED, ORACLE, Study

SETTINGS = {
    "shared": "one range for the flock",
    "per-agent-visible": "one range per agent, predator always visible",
    "per-agent-local": "one range per agent, predator visible within 30 m",
    "shared-minimum": "one range for the flock",
    "per-agent-visible-minimum": "one range per agent, predator always visible",
    "per-agent-local-minimum": "one range per agent, predator visible within 30 m",
    "per-agent-visible-derived": "one range per agent, predator always visible, escape direction",
    "per-agent-visible-profile": "one range per agent, predator always visible, profile of 8 ranges",
    "line": "one range for the line",
    "steering-predator": "one range per agent, pursuing predator",
}
"""Short titles; the panel or the caption names the objective."""

POLICIES = {
    "search": "network (search)",
    "ppo": "PPO",
    "tqc": "TQC",
    "imitation": "network (imitation)",
    "schedule": "network (schedule of time)",
    "ppo-team": "PPO: team reward",
    "ppo-own-minimum": "PPO: own running minimum",
    "ppo-own-change": "PPO: own distance change",
    "ppo-neighborhood": "PPO: neighborhood's distance change",
    "ppo-difference": "PPO: difference reward",
    BEST_FIXED: "best fixed range",
    ORACLE: "best fixed range of each flock",
    "listen-while-fleeing": "rule: listen while fleeing",
    "listen-while-threatened": "rule: listen while threatened",
    "turn-away": "rule: turn away",
    "keep-distance": "rule: keep distance",
    "head-away": "rule: head away",
    "stubborn-leaders": "rule: stubborn leaders",
    "stubborn-leaders-local": "rule: stubborn leaders, local",
    "stubborn-witnesses": "rule: stubborn witnesses",
    "win-stay-lose-shift": "rule: win stay, lose shift",
    "win-stay-lose-shift-escape": "rule: win stay, lose shift",
}


PLANNER = "planner (whole state)"
CLAIRVOYANT = "clairvoyant schedule"
FREE_HEADINGS = "free headings"
INFORMED_GREEDY = "informed greedy rule"

KNOWLEDGE = {
    PLANNER: "positions and velocities of all, and what each choice leads to until the end of the episode",
    CLAIRVOYANT: "how hundreds of episodes of this very flock ended; its 12 ranges were optimized on them",
    INFORMED_GREEDY: "the predator at any distance, and what each of 15 ranges would bring at every step",
    FREE_HEADINGS: "where the predator will be; its agents turn at once and follow nobody: an upper bound",
}
"""What each reference knows or can do that a policy does not or cannot."""


def setting_title(study: Study) -> str:
    """Return a short title of a setting."""
    return SETTINGS.get(study.setting, study.title)


def policy_title(study: Study, name: str) -> str:
    """Return a readable name of a policy."""
    began = searched_rule(study, name) if name in study.learners else ""
    return POLICIES[began].replace("rule", "searched rule") if began else POLICIES.get(name, name)
