"""The README and the pages: snippets run, figures are those of committed results, lists are complete."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import fields
from pathlib import Path
from textwrap import dedent
from typing import Any, get_args

import polars as pl
import pytest

from flockesc_env import PRESETS, EnvOptions, FlockEscapeEnv, FlockScenario, ScenarioError, parallel_env
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.options import IndividualReward, TeamReward
from flockesc_env.policies import NAMES, bind
from flockesc_env.policies.registry import built_in
from flockesc_env.scenario.predators import Predator
from studies.learned.aggregate import aggregate
from studies.learned.names import FREE_HEADINGS
from studies.learned.results import BEST_FIXED, load_study
from studies.paper.page import PaperResults
from studies.robustness.findings import Finding
from studies.robustness.page import RobustnessResults

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "results"
ROBUSTNESS = RobustnessResults.from_json((RESULTS / "robustness" / "results.json").read_text("utf-8"))
README = (ROOT / "README.md").read_text("utf-8")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCED = re.compile(r"^( *)```python\n(.*?)^\1```", flags=re.DOTALL | re.MULTILINE)
SNIPPETS = [
    pytest.param(dedent(code), id=f"{page.stem}-{number}")
    for page in PAGES
    for number, (_, code) in enumerate(FENCED.findall(page.read_text("utf-8")))
    if not re.search(r"flockesc_env\.(torchrl|benchmarl)", code)  # these run in compat/
]
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
    text = "\n".join(str(snippet.values[0]) for snippet in SNIPPETS)
    for name in INTERFACES:
        assert name in text


@pytest.mark.parametrize("snippet", SNIPPETS)
def test_snippet_runs(snippet: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)  # where commands of the pages run, too
    exec(compile(snippet, "snippet", "exec"), {})  # noqa: S102, our own text


@pytest.mark.parametrize("name", ["fixed:10", *NAMES[1:]])
def test_the_loop_of_the_readme_plays_every_policy_in_every_preset(name: str) -> None:
    """Agents are caught on the way; a policy for the flock plays the loop of Gymnasium."""
    entry = built_in(name)
    options: dict[str, Any] = {"max_range": 150.0, **entry.options}
    were_caught = 0
    for scenario in (preset.scenario for preset in PRESETS.values()):
        if not isinstance(scenario, FlockScenario):
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


def test_the_readme_is_short() -> None:
    assert len(README.splitlines()) <= 200


def test_the_headline_is_that_of_committed_results() -> None:
    study = load_study(RESULTS / "learned" / VISIBLE)
    found = aggregate(study.values("search"), study.values(BEST_FIXED)[0])
    assert f"{found.difference:.1f}".replace(" [", " m [") in README.split("```", 1)[0]
    assert f"{found.objective.mean:.1f} m against {study.values(BEST_FIXED).mean():.1f} m" in README


def interior_presets(symbol: str) -> int:
    return sum(preset.outcomes[symbol].finding == Finding.INTERIOR for preset in ROBUSTNESS.presets)


def flocks(setting: str, policy: str) -> FloatArray:
    """Return the objective on every held-out flock, mean over training seeds."""
    study = load_study(RESULTS / "learned" / setting)
    is_reference = policy in study.reference_names
    return study.reference(policy)[0] if is_reference else study.values(policy).mean(axis=0)


def gain(setting: str, policy: str, baseline: str, of: str) -> float:
    return float((flocks(setting, policy) - flocks(of, baseline)).mean())


def loss_without(group: str) -> float:
    table = load_study(RESULTS / "learned" / "per-agent-visible").ablation
    assert table is not None
    shown, hidden = (table.filter(removed=name)["objective"].to_numpy() for name in ("nothing", group))
    return float(shown.mean() - hidden.mean())


def gain_of_the_demo() -> float:
    table = pl.read_parquet(RESULTS / "demo" / "table.parquet")
    return float(table.filter(policy="demo")["difference"].item())


def paper_results() -> PaperResults:
    return PaperResults.from_json((RESULTS / "paper" / "results.json").read_text("utf-8"))


def control_of_the_force(what: str) -> float:
    rows = [row for row in paper_results().claims if row.where == "I, J_mean"]
    return next(q.value.mean for row in rows for q in row.measured if q.what == what)


PROFILE, VISIBLE, DERIVED = (f"per-agent-visible{end}" for end in ("-profile", "", "-derived"))
BLIND_RULE = "win-stay-lose-shift-escape"
FORCE_AT_THE_BEST = "at the best ranges, with the force minus without"
STATED: list[tuple[str, str, Callable[[], float]]] = [
    ("README", "untrained rule reaches {:.1f} m", lambda: flocks(VISIBLE, "stubborn-leaders").mean()),
    ("README", "{:.0f} m is best, too", lambda: control_of_the_force("best range without the force")),
    ("README", "only {:.1f} m smaller", lambda: control_of_the_force(FORCE_AT_THE_BEST)),
    ("README", "its figures, and {} claims", lambda: len(paper_results().claims)),
    ("README", "loses {:.1f} m if", lambda: loss_without("predator direction")),
    ("README", "worth {:.1f} m to a rule", lambda: gain(PROFILE, "turn-away", BLIND_RULE, DERIVED)),
    ("README", "reaches {:.1f} m without training", lambda: flocks(PROFILE, "head-away").mean()),
    ("README", "more than {:.1f} m in the mean", lambda: flocks(VISIBLE, FREE_HEADINGS).mean()),
    ("README", "{:.0f} of 28 presets. The", lambda: interior_presets("J_mean")),
    ("README", "{:.0f} of 28 presets.", lambda: interior_presets("J_min")),
    ("README", "best fixed range in {} presets", lambda: len(ROBUSTNESS.presets)),
    ("README", "{} presets: predators", lambda: len(PRESETS)),
    ("worlds", "lists {} scenarios", lambda: len(PRESETS)),
    ("worlds", "in {} of them", lambda: len(ROBUSTNESS.presets)),
    ("getting-started", "180 iterations and gains {:.1f} m", gain_of_the_demo),
    (
        "getting-started",
        "200 iterations gain {:.1f} m on average",
        lambda: gain(VISIBLE, "ppo", BEST_FIXED, VISIBLE),
    ),
]
"""A page, some words of it, and the number among them."""


@pytest.mark.parametrize(("page", "words", "number"), STATED, ids=[words for _, words, _ in STATED])
def test_a_number_in_prose_is_that_of_committed_results(
    page: str, words: str, number: Callable[[], float]
) -> None:
    (text,) = (path.read_text("utf-8") for path in PAGES if path.stem == page)
    assert words.format(number()) in " ".join(text.split())


def test_the_table_of_the_demo_is_the_committed_one() -> None:
    table = (ROOT / "results" / "demo" / "table.md").read_text("utf-8").strip().split("\n\n")[-1]
    assert table in (ROOT / "docs" / "getting-started.md").read_text("utf-8")


@pytest.mark.parametrize(
    ("page", "names"),
    [
        ("worlds", PRESETS),
        ("worlds", [field.name for field in fields(FlockScenario)]),
        ("worlds", [predator.__name__ for predator in get_args(Predator)]),
        ("environments", [field.name for field in fields(EnvOptions)]),
        (
            "environments",
            [f'"{reward}"' for kind in (TeamReward, IndividualReward) for reward in get_args(kind)],
        ),
        ("policies", NAMES),
    ],
    ids=["presets", "fields", "predators", "options", "rewards", "policies"],
)
def test_a_users_page_names_all_that_there_is(page: str, names: Iterable[str]) -> None:
    text = (ROOT / "docs" / f"{page}.md").read_text("utf-8")
    assert [name for name in names if f"`{name}" not in text and f"{name}`" not in text] == []
