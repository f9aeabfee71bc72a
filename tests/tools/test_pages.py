"""All code blocks of the README and of the pages in docs/ run."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from sybil import Example, Sybil
from sybil.parsers.markdown import CodeBlockParser

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
REPLACED = ROOT / "tests" / "support" / "blocks.sh"


def run_python(example: Example) -> None:
    """Run a block alone: no block needs another one. A first line ``# needs NAME`` names a library."""
    code = str(example.parsed)
    before, _, library = code.partition("\n")[0].partition("# needs ")
    if library and not before:
        pytest.importorskip(library, reason=f"{library} is not installed")
    exec(compile(code, example.path, "exec"), {"__name__": "example"})  # noqa: S102, our own text


def run_shell(example: Example) -> None:
    """Run a block with the commands of this environment. ``blocks.sh`` replaces long ones."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "BROWSER": "true", "ROOT": str(ROOT)}
    command = ["bash", "-euo", "pipefail", "-c", f'source "{REPLACED}"\n{example.parsed}']
    ran = subprocess.run(  # noqa: S603, our own text
        command, env=environment, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr


SYBIL = Sybil([CodeBlockParser("python", run_python), CodeBlockParser("sh", run_shell)])
BLOCKS = [
    pytest.param(example, id=f"{page.stem}-{example.line}")
    for page in PAGES
    for example in SYBIL.parse(page).examples()
]


@pytest.mark.parametrize("block", BLOCKS)
def test_a_block_runs(block: Example, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder sees the files of the repository, but not runs/, where blocks write."""
    for path in ROOT.iterdir():
        if path.name != "runs":
            (tmp_path / path.name).symlink_to(path)
    monkeypatch.chdir(tmp_path)
    block.evaluate()
