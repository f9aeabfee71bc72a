"""Mutation testing: changes the package in a seeded sample of places, one at a time, and runs the tests.

``make mutants`` runs it on a copy of the tree, in an environment that has Cosmic Ray. Each line of its output
is a change and the test that found it. Changes without a test need one.
"""

import argparse
import os
import random
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

ROOT = Path(__file__).parents[1]
LEFT_OUT = (".compat", ".git", ".venv", "__pycache__", "dist", "runs", "target")
TIMEOUT = 900.0  # seconds
OPERATORS = re.compile(
    "Comparison|AndWith|OrWith|AddNot|Number|True|False|(Add|Sub|Mul|Div)_(Add|Sub|Mul|Div)|Zero"
)


def mutants(text: str) -> Iterator[str]:
    """Yield the text of a module with one change, for every change of every operator."""
    for name in operator_names():
        occurrence = 0
        while OPERATORS.search(name) and (changed := mutate_code(text, get_operator(name)(), occurrence)):
            occurrence += 1
            yield changed


def sample(size: int, seed: int) -> Iterator[tuple[Path, str, str]]:
    """Yield modules, drawn in proportion to their length, with their text and a mutant of it."""
    rng = random.Random(seed)  # noqa: S311, a sample
    paths = sorted((ROOT / "flockesc_env").rglob("*.py"))
    for path in rng.choices(paths, [path.stat().st_size for path in paths], k=size):
        text = path.read_text()
        if found := list(mutants(text)):
            yield path.relative_to(ROOT), text, rng.choice(found)


def first_failure(tree: Path, path: Path, timeout: float) -> str:
    """Return the test that fails first, of those of the changed room, then of all; or nothing."""
    rooms = [room for room in (tree / "tests" / path.parts[1],) if room.exists()]
    command = [ROOT / ".venv" / "bin" / "python", "-m", "pytest", "-x", "--tb=no", *rooms, tree / "tests"]
    environment = {**os.environ, "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        ended = subprocess.run(  # noqa: S603
            command, cwd=tree, env=environment, timeout=timeout, capture_output=True, text=True
        )
    except subprocess.TimeoutExpired:
        return "a test that did not end"
    failed = re.search("^(FAILED|ERROR).*$", ended.stdout, re.MULTILINE)
    return failed[0] if failed else "" if ended.returncode == 0 else "the import"


def main() -> None:
    """Run the tests on a sample of changes, and print which test finds each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("size", type=int)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    found, total = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        tree = shutil.copytree(ROOT, Path(folder) / "copy", ignore=shutil.ignore_patterns(*LEFT_OUT))
        if failure := first_failure(tree, Path("flockesc_env/common"), TIMEOUT):
            raise SystemExit(f"The tests fail without a change: {failure}")
        for path, text, changed in sample(chosen.size, chosen.seed):
            (tree / path).write_text(changed)
            failure = first_failure(tree, path, TIMEOUT)
            (tree / path).write_text(text)
            total, found = total + 1, found + bool(failure)
            pairs = zip(text.splitlines(), changed.splitlines(), strict=False)
            (row, (old, new)) = next((n, pair) for n, pair in enumerate(pairs, 1) if pair[0] != pair[1])
            print(f"{path}:{row}: {old.strip()} -> {new.strip()}: {failure or 'NOT FOUND'}", flush=True)
    print(f"{found} of {total} found")


if __name__ == "__main__":
    main()
