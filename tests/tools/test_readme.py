"""The README and the pages: snippets run, figures are those of committed results, lists are complete."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from textwrap import dedent
from typing import Any, get_args

import gymnasium
import pytest

from flockesc_env import (
    PRESETS,
    EnvOptions,
    FixedRange,
    FlockEscapeEnv,
    FlockScenario,
    ScenarioError,
    parallel_env,
    rollout,
)
from flockesc_env.episodes.objectives import OBJECTIVES
from flockesc_env.episodes.options import IndividualReward, TeamReward
from flockesc_env.policies import NAMES, bind
from flockesc_env.policies.registry import built_in

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
PROSE = " ".join(README.split())
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCED = re.compile(r"^( *)```python\n(.*?)^\1```", flags=re.DOTALL | re.MULTILINE)
RUN_ELSEWHERE = {"README-0", "cluster-0"}  # below, and in tests/jobs/test_backends.py
SNIPPETS = [
    pytest.param(dedent(code), id=f"{page.stem}-{number}")
    for page in PAGES
    for number, (_, code) in enumerate(FENCED.findall(page.read_text("utf-8")))
    if f"{page.stem}-{number}" not in RUN_ELSEWHERE
    and not re.search(r"flockesc_env\.(torchrl|benchmarl)", code)  # these run in compat/
]


@pytest.mark.parametrize("snippet", SNIPPETS)
def test_snippet_runs(snippet: str) -> None:
    exec(compile(snippet, "snippet", "exec"), {})  # noqa: S102, our own text


@pytest.mark.parametrize("name", ["fixed:10", *NAMES[1:]])
def test_the_loop_of_the_readme_plays_every_policy_in_every_preset(name: str) -> None:
    """Agents are caught on the way; a policy for the flock plays the loop of Gymnasium."""
    entry = built_in(name)
    options: dict[str, Any] = {"max_range": 150.0, **entry.options}
    were_caught = 0
    for scenario in (preset.scenario for preset in PRESETS.values()):
        if not isinstance(scenario, FlockScenario) or not scenario.predators:
            continue
        count = scenario.num_agents
        unlike = {
            field: value[:8]
            for field, value in vars(scenario).items()
            if isinstance(value, tuple) and len(value) == count
        }
        flock = scenario.replace(num_agents=8, num_steps=9, capture_radius=70.0, **unlike)
        try:
            env: Any = parallel_env(flock, **options) if entry.per_agent else FlockEscapeEnv(flock, **options)
        except ScenarioError:  # this preset has no profile
            assert "profile_ranges" in options
            continue
        policy = bind(entry.policy, env)
        observations, _ = env.reset(seed=7)
        if not entry.per_agent:
            has_ended = False
            while not has_ended:
                observations, _, terminated, truncated, _ = env.step(policy(observations))
                has_ended = terminated or truncated
            continue
        while env.agents:
            were_caught += len(env.agents) < len(env.possible_agents)
            observations, *_ = env.step(policy(observations))
    assert were_caught or not entry.per_agent


def test_the_snippet_and_the_caption_of_the_readme_have_the_numbers_of_their_flock(
    capsys: pytest.CaptureFixture[str],
) -> None:
    (_, snippet), *_ = FENCED.findall(README)
    exec(compile(snippet, "snippet", "exec"), {})  # noqa: S102, our own text
    learned = float(capsys.readouterr().out)
    assert f"# {learned:.2f} m\n" in snippet
    (fixed,) = rollout("paper-flock", FixedRange(12.0), [242]).min_mean_distance
    assert f"12 m, their mean distance to the predator falls to {fixed:.1f} m" in PROSE
    assert f"under a learned policy it stays at {learned:.1f} m or more" in PROSE


def test_the_table_of_the_demo_is_the_committed_one() -> None:
    table = (ROOT / "results" / "demo" / "table.md").read_text("utf-8").strip().split("\n\n")[-1]
    assert table in (ROOT / "docs" / "getting-started.md").read_text("utf-8")


@pytest.mark.parametrize(
    ("page", "names"),
    [
        ("worlds", PRESETS),
        ("worlds", [field.name for field in fields(FlockScenario)]),
        ("environments", [field.name for field in fields(EnvOptions)]),
        (
            "environments",
            [f'"{reward}"' for kind in (TeamReward, IndividualReward) for reward in get_args(kind)],
        ),
        ("policies", NAMES),
        ("environments", [name for spec in OBJECTIVES for name in (spec.series, spec.column)]),
        ("model", [name for spec in OBJECTIVES for name in (spec.series, spec.column)]),
    ],
    ids=["presets", "fields", "options", "rewards", "policies", "info", "columns"],
)
def test_a_users_page_names_all_that_there_is(page: str, names: Iterable[str]) -> None:
    text = (ROOT / "docs" / f"{page}.md").read_text("utf-8")
    assert [name for name in names if f"`{name}" not in text and f"{name}`" not in text] == []


def test_a_users_page_names_every_registered_environment() -> None:
    text = (ROOT / "docs" / "environments.md").read_text("utf-8")
    ids = [name for name in gymnasium.registry if name.startswith("flockesc/")]
    assert [name for name in ids if f"flockesc_env:{name}" not in text] == []
