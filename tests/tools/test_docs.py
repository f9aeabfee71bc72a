"""Files, folders, headings, modules, functions and tests that the documentation names exist."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import pytest

from flockesc_env.common.extras import MissingExtraError

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SOURCES = (
    *("compat", "docs", "examples", "flockesc_env", "fuzz", "results", "rust", "scoreboard", "speed"),
    *("playground", "studies", "tests", "training"),
)
SUFFIX = re.compile(r"\.(css|gif|html|js|json|lock|md|parquet|png|py|pyi|rs|svg|toml)$")

FILES = [path.relative_to(ROOT).as_posix() for path in ROOT.iterdir()]
FILES += [path.relative_to(ROOT).as_posix() for source in SOURCES for path in (ROOT / source).rglob("*")]
ENDINGS = {"/".join(parts[at:]) for parts in (name.split("/") for name in FILES) for at in range(len(parts))}

TESTS = {
    name
    for folder in ("tests", "compat")
    for path in (ROOT / folder).rglob("test_*.py")
    for name in (path.name, *re.findall(r"^ *def (test_\w+)", path.read_text("utf-8"), re.MULTILINE))
}

CODE_ROW = re.compile(r"\| (?P<what>[^|]+) \| (?P<code>[^|]*\]\(\.\./[^|]*) \| (?P<function>[^|]*) \|")


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


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_links_headings_and_tests_that_a_page_names_exist(page: Path) -> None:
    text = prose(page)
    named = {code for code in re.findall(r"`([^`\n]+)`", text) if is_path(code)}
    assert sorted(code for code in named if code.rstrip("/") not in ENDINGS) == []
    links = [link for link in re.findall(r"\]\(([^)#\s]+)", text) if not re.match(r"https?:|mailto:", link)]
    assert [link for link in links if not (page.parent / link).exists()] == []
    headings = re.findall(r"\]\(([\w./-]*\.md)?#([^)\s]+)\)", text)
    assert [at for name, at in headings if at not in anchors(page.parent / name if name else page)] == []
    assert sorted(set(re.findall(r"\btest_\w+(?:\.py)?\b", text)) - TESTS) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_modules_that_a_page_names_exist(page: Path) -> None:
    for name in set(re.findall(r"`(flockesc_env(?:\.\w+)+)", prose(page))):
        module, rest = name.split("."), list[str]()
        while module:
            try:
                found = import_module(".".join(module))
                break
            except MissingExtraError:  # the module exists; its framework is not installed
                rest.clear()
                break
            except ModuleNotFoundError:
                rest.insert(0, module.pop())
        for part in rest:
            found = getattr(found, part)


def test_every_row_of_the_code_table_names_existing_code() -> None:
    page = ROOT / "docs" / "model.md"
    table = page.read_text("utf-8").split("\n## Code\n")[1].split("\n## ")[0]
    rows = list(CODE_ROW.finditer(table))
    assert len(rows) == table.count("](../") - sum(row["code"].count("](") - 1 for row in rows)
    for row in rows:
        links = re.findall(r"\[`([^`]+)`\]\(([^)]+)\)", row["code"])
        for label, link in links:
            assert link.endswith(f"/{label}")
        for function in re.findall(r"`(\w+)`", row["function"]):
            code = "".join((page.parent / link).read_text("utf-8") for _, link in links)
            assert re.search(rf"\b(fn|class|def|struct|enum) {function}\b", code), row["what"]
