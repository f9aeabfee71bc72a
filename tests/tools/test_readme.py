"""Every Python snippet of the README and of the model's page runs as it stands."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TEXT = "\n".join((ROOT / name).read_text() for name in ("README.md", "docs/model.md"))
SNIPPETS = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)
INTERFACES = (
    "simulate(",
    "sweep(",
    "gymnasium.make(",
    "gymnasium.make_vec(",
    "parallel_env(",
    "AgentVecEnv(",
    "simulate_line(",
    "episode_seed(",
)


def test_there_is_a_snippet_for_every_interface() -> None:
    text = "\n".join(SNIPPETS)
    for name in INTERFACES:
        assert name in text


@pytest.mark.parametrize("snippet", SNIPPETS, ids=lambda text: text.split("\n", 1)[0])
def test_snippet_runs(snippet: str) -> None:
    exec(compile(snippet, "snippet", "exec"), {})  # noqa: S102, our own text
