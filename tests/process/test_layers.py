"""Layers of the Python package: imports go down, without cycles; importing loads no heavy library."""

from __future__ import annotations

import ast
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import flockesc_env

PACKAGE = Path(flockesc_env.__file__).parent
MODULES = sorted(PACKAGE.rglob("*.py"))

HEAVY = (
    "torch",
    "stable_baselines3",
    "torchrl",
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
    "ray",
    "submitit",
)
ROOMS = (
    "_core",
    "common",
    "scenario",
    "episodes",
    "models",
    "policies",
    "render",
    "watch",
    "notebook",
    "envs",
    "sb3",
    "torchrl",
    "benchmarl",
    "jobs",
    "cli",
    "__main__",
)
"""From the lowest layer up: a module imports its own layer and lower ones. No module imports the root."""

PROGRAMS = ("training", "studies")
"""Packages that are not in the wheel: each imports itself, the previous one and the package."""

MAY_IMPORT_SB3 = {"sb3.py"}
MAY_IMPORT_TORCHRL = {"torchrl.py", "benchmarl/__init__.py"}
MAY_IMPORT_PYGAME = {"render/canvas.py", "render/window.py"}


def imported(path: Path) -> set[str]:
    """Return the full names of all imports of a module, also inside functions."""
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
    """Return the top-level modules that a statement loads in a new interpreter."""
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


def arrows(root: Path, package: str) -> dict[str, set[str]]:
    """Return the import graph of a package: for each module the imported modules of the package."""
    modules = {
        ".".join((package, *path.relative_to(root).with_suffix("").parts)).removesuffix(".__init__"): path
        for path in root.rglob("*.py")
    }
    known = {*modules, f"{package}._core"}

    def target(name: str) -> str:
        return name if name in known else name.rpartition(".")[0]

    return {
        module: {target(name) for name in imported(path) if name.partition(".")[0] == package} - {module}
        for module, path in modules.items()
    }


def room(module: str) -> str:
    return module.split(".")[1] if "." in module else module


def upward(graph: dict[str, set[str]]) -> list[str]:
    """Return the imports that go up a layer or import the package's root."""
    level = {name: index for index, name in enumerate(ROOMS)}
    return [
        f"{module} -> {target}"
        for module, targets in graph.items()
        if module != "flockesc_env"
        for target in targets
        if target == "flockesc_env" or level[room(target)] > level[room(module)]
    ]


def circles(graph: dict[str, set[str]]) -> list[str]:
    """Return one import cycle, or nothing."""
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_import_goes_up() -> None:
    graph = arrows(PACKAGE, "flockesc_env")
    assert {room(module) for module in graph} - {"flockesc_env"} < set(ROOMS)
    assert upward(graph) == []


@pytest.mark.parametrize("package", ["flockesc_env", *PROGRAMS, "benchmarks"])
def test_there_are_no_import_cycles(package: str) -> None:
    root = PACKAGE if package == "flockesc_env" else PACKAGE.parent / package
    assert circles(arrows(root, package)) == []


def test_the_checks_see_planted_imports() -> None:
    graph = arrows(PACKAGE, "flockesc_env")
    graph["flockesc_env.scenario.flock"].add("flockesc_env.envs.gymnasium")
    graph["flockesc_env.models.graph"].add("flockesc_env")
    assert sorted(upward(graph)) == [
        "flockesc_env.models.graph -> flockesc_env",
        "flockesc_env.scenario.flock -> flockesc_env.envs.gymnasium",
    ]
    assert circles(graph)


def test_packages_outside_the_wheel_import_one_way() -> None:
    assert not who_imports("training") | who_imports("studies") | who_imports("benchmarks")
    for index, program in enumerate(PROGRAMS):
        for path in (PACKAGE.parent / program).rglob("*.py"):
            above = {name.partition(".")[0] for name in imported(path)} & set(PROGRAMS[index + 1 :])
            assert not above, path


def test_only_some_modules_import_sb3() -> None:
    assert who_imports("stable_baselines3") == MAY_IMPORT_SB3


def test_only_some_modules_import_torchrl() -> None:
    assert who_imports("torchrl") | who_imports("benchmarl") == MAY_IMPORT_TORCHRL


def test_only_some_modules_import_pygame() -> None:
    assert who_imports("pygame") == MAY_IMPORT_PYGAME


def test_all_public_names_exist() -> None:
    assert len(set(flockesc_env.__all__)) == len(flockesc_env.__all__)
    for name in flockesc_env.__all__:
        assert hasattr(flockesc_env, name)
    assert flockesc_env.__version__
    assert (PACKAGE / "py.typed").exists()
