"""The question that every setting answers, in the order of the page."""

from __future__ import annotations

from typing import Final

QUESTIONS: Final = {
    "shared": "Does one range for all agents that changes over time beat the best constant one?",
    "per-agent-visible": "Does one range per agent help where every agent sees the predator?",
    "per-agent-local": "Does one range per agent help where only agents near the predator see it?",
    "shared-minimum": "Does one range for all agents save the nearest agent too?",
    "per-agent-visible-minimum": (
        "Does one range per agent save the nearest agent, where every agent sees the predator?"
    ),
    "per-agent-local-minimum": (
        "Does one range per agent save the nearest agent, where only agents near the predator see it?"
    ),
    "per-agent-visible-derived": "What is it worth to know the direction of escape?",
    "per-agent-visible-profile": "What is it worth to know what each of 8 ranges would bring?",
    "line": "Does a range that changes over time move the line away farther than a constant one?",
    "steering-predator": "Does learning help against a predator that steers?",
}


def question_of(setting: str, title: str) -> str:
    """Return the question of a setting; by its title if it is not listed."""
    return QUESTIONS.get(setting, f"Does learning help: {title}?")
