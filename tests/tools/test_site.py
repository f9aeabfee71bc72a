"""The site has every page and public name, docstrings run, and the files of a release agree."""

from __future__ import annotations

import doctest
import re
import tomllib
from collections import Counter
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
DIRECTIVE = re.compile(r"^\.\. (?:auto|py:)(?:class|data|exception|function):: ([\w.]+)", re.MULTILINE)
DOCUMENTED = Counter(
    name
    for page in sorted((ROOT / "docs" / "api").glob("*.rst"))
    for name in DIRECTIVE.findall(page.read_text("utf-8"))
)
MODULES = (
    "flockesc_env",
    "flockesc_env.jobs",
    "flockesc_env.notebook",
    "flockesc_env.policies",
    "flockesc_env.sb3",
    "flockesc_env.watch",
)
WITH_EXAMPLES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for path in sorted((ROOT / "flockesc_env").rglob("*.py"))
    if ">>> " in path.read_text("utf-8")
]


def resolved(name: str) -> object:
    module, _, attribute = name.rpartition(".")
    return getattr(import_module(module), attribute)


def public(module: ModuleType) -> set[str]:
    own = {name for name, item in vars(module).items() if getattr(item, "__module__", "") == module.__name__}
    return {name for name in getattr(module, "__all__", own) if not name.startswith("_")}


@pytest.mark.parametrize("module", MODULES)
def test_every_public_name_is_documented(module: str) -> None:
    documented = {id(resolved(name)) for name in DOCUMENTED}
    names = public(import_module(module))
    assert names
    assert sorted(name for name in names if id(resolved(f"{module}.{name}")) not in documented) == []


def test_the_contents_have_every_page() -> None:
    contents = (ROOT / "docs" / "index.md").read_text("utf-8").splitlines()
    pages = {page.stem for page in (ROOT / "docs").glob("*.md")} - {"index"}
    assert sorted(pages - set(contents)) == []
    assert [name for name, count in DOCUMENTED.items() if count > 1] == []


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_in_docstrings_run(module: str) -> None:
    results = doctest.testmod(import_module(module))
    assert results.attempted > 0
    assert results.failed == 0


WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def test_all_files_have_the_version_of_the_crates() -> None:
    version = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text("utf-8")


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.stem)
def test_actions_are_pinned_by_commit(workflow: Path) -> None:
    actions = re.findall(r"uses: (.+)", workflow.read_text("utf-8"))
    assert actions
    for action in actions:
        assert re.fullmatch(r"[\w-]+/[\w-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", action), action
