"""Who may import whom: heavy libraries stay out of the package, and the core behind few modules."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import flockesc_env

PACKAGE = Path(flockesc_env.__file__).parent
MODULES = sorted(PACKAGE.rglob("*.py"))

HEAVY = (
    "torch",
    "stable_baselines3",
    "matplotlib",
    "scipy",
    "polars",
    "pygame",
    "imageio",
    "imageio_ffmpeg",
    "moviepy",
    "jinja2",
    "tqdm",
    "tyro",
)
MAY_IMPORT_CORE = {
    "__init__.py",
    "batch.py",
    "envs/line.py",
    "graph.py",
    "rollout_line.py",
    "scenario.py",
    "seeds.py",
    "simulate.py",
    "spaces.py",
    "sweep.py",
}
MAY_IMPORT_SB3 = {"sb3.py"}
MAY_IMPORT_PYGAME = {"render/canvas.py", "render/window.py"}


def imported(path: Path) -> set[str]:
    """Return the full names of everything that a module imports, wherever in it."""
    names = set()
    for part in ast.walk(ast.parse(path.read_text())):
        if isinstance(part, ast.Import):
            names |= {alias.name for alias in part.names}
        elif isinstance(part, ast.ImportFrom):
            names |= {f"{part.module}.{alias.name}" for alias in part.names}
            assert part.level == 0, f"{path}: relative import"
    return names


def who_imports(name: str) -> set[str]:
    def uses(path: Path) -> bool:
        return any(f"{module}.".startswith(f"{name}.") for module in imported(path))

    return {path.relative_to(PACKAGE).as_posix() for path in MODULES if uses(path)}


def loaded_after(statement: str) -> set[str]:
    """Return the top-level modules of a fresh interpreter that has run a statement."""
    script = f"{statement}\nimport sys\nprint(*{{name.partition('.')[0] for name in sys.modules}})"
    command = [sys.executable, "-c", script]
    run = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603
    return set(run.stdout.split())


@pytest.mark.parametrize(
    "statement",
    [
        "import flockesc_env",
        "import flockesc_env.watch, flockesc_env.policies.registry, flockesc_env.models.records",
        "import flockesc_env.render, flockesc_env.render.video",
        "from flockesc_env import *",
        "import gymnasium; gymnasium.make('flockesc_env:flockesc/FlockEscape-v0').reset(seed=0)",
        "import flockesc_env; flockesc_env.parallel_env().reset(seed=0)",
        "from flockesc_env import *; sweep(LineScenario(), [0.1], [0]).best_range()",
    ],
)
def test_importing_loads_nothing_heavy(statement: str) -> None:
    loaded = loaded_after(statement)
    assert "flockesc_env" in loaded
    assert not loaded & set(HEAVY)


def test_the_check_sees_heavy_modules() -> None:
    assert "scipy" in loaded_after("import scipy.sparse")


def test_core_is_imported_where_it_may_be() -> None:
    assert who_imports("flockesc_env._core") == MAY_IMPORT_CORE


def test_sb3_is_imported_where_it_may_be() -> None:
    assert who_imports("stable_baselines3") == MAY_IMPORT_SB3


def test_pygame_is_imported_where_it_may_be() -> None:
    assert who_imports("pygame") == MAY_IMPORT_PYGAME


def test_the_package_never_imports_training() -> None:
    assert not who_imports("training")


def test_everything_public_is_there() -> None:
    assert len(set(flockesc_env.__all__)) == len(flockesc_env.__all__)
    for name in flockesc_env.__all__:
        assert hasattr(flockesc_env, name)
    assert flockesc_env.__version__
    assert (PACKAGE / "py.typed").exists()
