"""Pages are short, their links and names exist, lists of names are complete, and numbers are measured."""

import doctest
import json
import re
import subprocess
import tomllib
from collections.abc import Iterable
from dataclasses import fields
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, get_args

import pytest
from option_table import IDS

import flockesc_env as fe
from flockesc_env.policies import NAMES
from flockesc_env.scenario.objectives import OBJECTIVES
from flockesc_env.scenario.options import IndividualReward, TeamReward

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
WORDS = {
    "index": 600,
    "first-policy": 900,
    "train": 900,
    "enter": 500,
    "your-own-parts": 1200,
    "long-work": 1200,
    "environments": 2200,
    "scenarios": 1300,
    "model": 6000,
    "policies": 900,
    "scoreboard": 1800,
    "findings": 2500,
    "paper": 3000,
    "engineering": 2500,
}
"""The largest number of words of every page in docs/."""
PAGES = [ROOT / "README.md", *(ROOT / "docs" / f"{name}.md" for name in WORDS)]
REPORTS = [*sorted((ROOT / "results").glob("*/README.md")), ROOT / "speed" / "results" / "README.md"]
TEXTS = [*PAGES, *REPORTS, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
texts = pytest.mark.parametrize("page", TEXTS, ids=lambda page: page.relative_to(ROOT).as_posix())

FRAMEWORKS = ("flockesc_env.torchrl", "flockesc_env.benchmarl")
"""Modules that compat/ imports."""
FRAMEWORKS += () if find_spec("jax") else ("flockesc_env.jax",)
WITH_EXAMPLES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for path in sorted((ROOT / "flockesc_env").rglob("*.py"))
    if ">>> " in path.read_text("utf-8")
]

SOURCES = (
    *("compat", "docs", "examples", "flockesc_env", "fuzz", "results", "rust", "scoreboard", "speed"),
    *("paper", "playground", "studies", "tests", "training"),
)
SUFFIX = re.compile(r"\w\.(css|gif|html|js|json|lock|md|parquet|png|py|pyi|rs|svg|toml)$")

FILES = [path.relative_to(ROOT).as_posix() for path in ROOT.iterdir()]
FILES += [path.relative_to(ROOT).as_posix() for source in SOURCES for path in (ROOT / source).rglob("*")]
ENDINGS = {"/".join(parts[at:]) for parts in (name.split("/") for name in FILES) for at in range(len(parts))}

TESTS = {
    name
    for folder in ("tests", "compat")
    for path in (ROOT / folder).rglob("test_*.py")
    for name in (path.name, *re.findall(r"^ *def (test_\w+)", path.read_text("utf-8"), re.MULTILINE))
}

DIRECTIVE = re.compile(r"^\.\. (?:auto|py:)(?:class|data|exception|function):: ([\w.]+)", re.MULTILINE)
DOCUMENTED = {
    name
    for page in sorted((ROOT / "docs" / "api").glob("*.rst"))
    for name in DIRECTIVE.findall(page.read_text("utf-8"))
}
MODULES = (
    "flockesc_env",
    *(f"flockesc_env.{name}" for name in ["jobs", "notebook", "policies", "sb3", "watch"]),
)
DECIMAL = re.compile(r"(?<![\d.])\d+\.\d+(?![\d.]*\d)")


def test_every_page_is_short() -> None:
    words = {path.stem: len(path.read_text("utf-8").split()) for path in (ROOT / "docs").glob("*.md")}
    assert words.keys() == WORDS.keys()
    long = [f"{name}: {n} of at most {WORDS[name]} words" for name, n in words.items() if n > WORDS[name]]
    assert long == []
    assert len(README.splitlines()) <= 75


@pytest.mark.parametrize("name", ["README", "docs/findings", "docs/paper", "docs/scoreboard"])
def test_measured_numbers_stand_in_the_reports_that_their_section_links(name: str) -> None:
    page = ROOT / f"{name}.md"
    _, *sections = re.split(r"^(?=## |\*\*Tasks\*\*)", prose(page), flags=re.MULTILINE)
    for section in sections:
        links = re.findall(r"\]\(([^)#\s]*results/[^)#\s]*\.(?:json|md|txt))", section)
        reports = [(page.parent / link).read_text("utf-8") for link in links]
        reported = {number for report in reports for number in DECIMAL.findall(report)}
        numbers = DECIMAL.findall(re.sub(r"\]\([^)]*\)", "]", section))
        assert sorted({number for number in numbers if number not in reported}) == [], section[:60]


def test_every_result_is_on_a_page_or_written_by_the_code() -> None:
    code = [path for folder in ("studies", "training") for path in (ROOT / folder).rglob("*.py")]
    known = "".join(path.read_text("utf-8") for path in (*TEXTS, *code))
    files = [path for path in (ROOT / "results").glob("*/*.*") if path.suffix != ".npz"]
    assert [path for path in files if path.name not in known and f'"{path.stem}"' not in known] == []


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_in_docstrings_run(module: str) -> None:
    results = doctest.testmod(import_module(module))
    assert results.attempted > 0
    assert results.failed == 0


def test_the_snippet_and_the_caption_of_the_readme_have_the_numbers_of_their_flock() -> None:
    (learned,) = fe.rollout("per-agent-visible/search", [242]).min_mean_distance
    assert f'print(infos["agent_0"]["min_mean_distance"])  # {learned:.2f} m\n' in README
    (fixed,) = fe.rollout("paper-flock", fe.FixedRange(12.0), [242]).min_mean_distance
    assert f"12 m, their mean distance to the predator falls to {fixed:.1f} m" in " ".join(README.split())
    assert f"under a learned policy it stays at {learned:.1f} m or more" in " ".join(README.split())


def test_the_table_of_the_demo_is_the_committed_one() -> None:
    table = (ROOT / "results" / "demo" / "table.md").read_text("utf-8").strip().split("\n\n")[-1]
    assert table in (ROOT / "docs" / "first-policy.md").read_text("utf-8")


def test_every_environment_of_compat_passed_within_200_commits() -> None:
    entries = json.loads((ROOT / "results/scoreboard/compat.json").read_text())
    assert set(entries) == {path.stem for path in (ROOT / "compat").glob("*.in")}
    count = ["git", "rev-list", "--count", "HEAD"]
    counted = subprocess.run(count, capture_output=True, text=True, cwd=ROOT)  # noqa: S603
    for name, entry in entries.items():
        assert entry["failures"] == 0, name
        # An archive of the source has no history.
        assert counted.returncode or int(counted.stdout) - entry["commits"] <= 200, f"make compat-{name}"


def test_all_files_have_the_version_of_the_crates() -> None:
    version = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text("utf-8")


@pytest.mark.parametrize(
    ("page", "names"),
    [
        ("scenarios", fe.PRESETS),
        ("scenarios", [field.name for field in fields(fe.FlockScenario)]),
        ("environments", [field.name for field in fields(fe.EnvOptions)]),
        ("environments", [f'"{name}"' for kind in (TeamReward, IndividualReward) for name in get_args(kind)]),
        ("environments", [f"flockesc_env:{name}" for name in IDS]),
        ("policies", NAMES),
        ("environments", [name for spec in OBJECTIVES for name in (spec.series, spec.name)]),
        ("model", [name for spec in OBJECTIVES for name in (spec.series, spec.name)]),
    ],
    ids=["presets", "fields", "options", "rewards", "ids", "policies", "info", "columns"],
)
def test_a_users_page_names_all_that_there_is(page: str, names: Iterable[str]) -> None:
    text = (ROOT / "docs" / f"{page}.md").read_text("utf-8")
    assert [name for name in names if f"`{name}" not in text and f"{name}`" not in text] == []


@pytest.mark.parametrize("module", MODULES)
def test_every_public_name_is_documented(module: str) -> None:
    documented = {id(resolve_name(":".join(name.rsplit(".", 1)))) for name in DOCUMENTED}
    items = vars(import_module(module))
    own = {name for name, item in items.items() if getattr(item, "__module__", "") == module}
    names = {name for name in items.get("__all__", own) if not name.startswith("_")}
    modules = {name.split(".")[1] for name in DOCUMENTED if module == "flockesc_env" and name.count(".") > 1}
    assert names
    assert sorted((names | modules) - {*dir(import_module(module))}) == []
    assert sorted(name for name in names if id(resolve_name(f"{module}:{name}")) not in documented) == []


def prose(page: Path) -> str:
    return re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)


def anchors(page: Path) -> set[str]:
    """Return the anchors that GitHub makes of the headings of a page, and those written as HTML."""
    text = prose(page)
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    names = {re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings}
    return names | set(re.findall(r'(?:id|name)="([^"]+)"', text))


def is_path(code: str) -> bool:
    if not re.fullmatch(r"[\w./-]+", code) or code.startswith(("runs/", "target/")):  # output of commands
        return False
    return bool(SUFFIX.search(code)) or code.endswith("/") or code.split("/")[0] in SOURCES


@texts
def test_files_links_headings_and_tests_that_a_page_names_exist(page: Path) -> None:
    text = prose(page)
    named = {code for code in re.findall(r"`([^`\n]+)`", text) if is_path(code)}
    assert sorted(code for code in named if code.rstrip("/") not in ENDINGS) == []
    links = [link for link in re.findall(r"\]\(([^)#\s]+)", text) if not re.match(r"https?:|mailto:", link)]
    assert [link for link in links if not (page.parent / link).exists()] == []
    headings = re.findall(r"\]\(([\w./-]*\.md)?#([^)\s]+)\)", text)
    assert [at for name, at in headings if at not in anchors(page.parent / name if name else page)] == []
    assert sorted(set(re.findall(r"\btest_\w+(?:\.py)?\b", text)) - TESTS) == []


@texts
def test_items_of_lists_begin_lines(page: Path) -> None:
    assert re.findall(r".*[.:] [-*] (?=[A-Z`*\[]).*", prose(page)) == []


@texts
def test_modules_that_a_page_names_exist(page: Path) -> None:
    for name in set(re.findall(r"`(flockesc_env(?:\.\w+)+)", prose(page))):
        if not name.startswith(FRAMEWORKS):
            resolve_name(name)


@pytest.mark.parametrize("name", ["fixed:10", *NAMES[1:]])
def test_the_loop_of_the_readme_plays_every_policy_in_every_preset(name: str) -> None:
    """Agents are caught on the way; a policy for the flock plays the loop of Gymnasium."""
    entry = fe.load_policy(name)
    options: dict[str, Any] = {"max_range": 150.0, **(entry.options or {})}
    were_caught, per_agent = 0, bool(entry.per_agent)
    for scenario in (preset.scenario for preset in fe.PRESETS.values()):
        if not isinstance(scenario, fe.FlockScenario) or not scenario.predators:
            continue
        fields = vars(scenario).items()
        unlike = {k: v[:8] for k, v in fields if isinstance(v, tuple) and len(v) == scenario.num_agents}
        flock = scenario.replace(num_agents=8, num_steps=9, capture_radius=70.0, **unlike)
        try:
            env: Any = fe.parallel_env(flock, **options) if per_agent else fe.FlockEscapeEnv(flock, **options)
        except fe.InputError:  # this preset has no profile
            assert "profile_ranges" in options
            continue
        act = entry.bind(env)
        observations, _ = env.reset(seed=7)
        has_ended = False
        while not has_ended:
            observations, _, terminated, truncated, _ = env.step(act(observations))
            has_ended = not env.agents if per_agent else terminated or truncated
            were_caught += per_agent and 0 < len(env.agents) < 8
    assert were_caught or not per_agent
