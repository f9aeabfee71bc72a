"""Every Python snippet of the README runs as it stands."""

import re
from pathlib import Path

import pytest

README = Path(__file__).parent.parent / "README.md"
SNIPPETS = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)


def test_there_is_a_snippet_for_every_interface() -> None:
    text = "\n".join(SNIPPETS)
    for name in ("simulate(", "sweep(", "gymnasium.make(", "parallel_env(", "AgentVecEnv(", "simulate_line("):
        assert name in text


@pytest.mark.parametrize("snippet", SNIPPETS, ids=lambda text: text.split("\n", 1)[0])
def test_snippet_runs(snippet: str) -> None:
    exec(compile(snippet, "README.md", "exec"), {})  # noqa: S102, our own text
