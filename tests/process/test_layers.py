"""Layers of the Python packages: imports go down, without cycles; importing loads no heavy library."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path
from types import ModuleType

import pytest

import flockesc_env

ROOT = Path(flockesc_env.__file__).parents[1]
HEAVY = {
    *("torch", "stable_baselines3", "torchrl", "matplotlib", "scipy", "polars", "pygame", "imageio"),
    *("imageio_ffmpeg", "moviepy", "jinja2", "tqdm", "tyro", "ray", "submitit", "jax"),
}
ROOMS = (
    *("_core", "common", "scenario", "episodes", "models", "policies", "render", "watch", "notebook"),
    *("jax", "envs", "sb3", "taskset", "torchrl", "benchmarl", "jobs", "cli", "__main__"),
)
LAYERS = [*(f"flockesc_env.{room}" for room in ROOMS), "flockesc_env"]
LAYERS += ["training", "studies", "speed", "playground"]
"""From the lowest up: a module imports its own layer and lower ones, so no room imports the root."""


def imported(path: Path) -> set[str]:
    """Return the full names of all imports of a module, also inside functions."""
    names = set()
    for part in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(part, ast.Import):
            names |= {alias.name for alias in part.names}
        elif isinstance(part, ast.ImportFrom):
            names |= {f"{part.module}.{alias.name}" for alias in part.names}
            assert part.level == 0, f"{path}: relative import"
    return names


IMPORTS = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): imported(path)
    for package in LAYERS[len(ROOMS) :]
    for path in (ROOT / package).rglob("*.py")
}


def layer(module: str) -> int:
    parts = module.split(".")
    return LAYERS.index(".".join(parts[:2]) if ".".join(parts[:2]) in LAYERS else parts[0])


def arrows(imports: dict[str, set[str]]) -> dict[str, set[str]]:
    """Return the imported modules of our packages for each module."""
    modules, graph = imports.keys() | {"flockesc_env._core"}, {}
    for module, names in imports.items():
        ours = {name for name in names if name.partition(".")[0] in LAYERS}
        graph[module] = {name if name in modules else name.rpartition(".")[0] for name in ours} - {module}
    return graph


def upward(imports: dict[str, set[str]]) -> list[tuple[str, str]]:
    graph = arrows(imports)
    return [(module, to) for module in graph for to in graph[module] if layer(to) > layer(module)]


def test_imports_go_down_without_cycles() -> None:
    """The check sees a planted import."""
    assert upward(IMPORTS) == []
    TopologicalSorter(arrows(IMPORTS)).prepare()  # raises CycleError
    scenario = "flockesc_env.scenario.flock"
    planted = {**IMPORTS, scenario: {"flockesc_env.envs.gymnasium", "flockesc_env.FlockEscapeEnv"}}
    assert sorted(upward(planted)) == [(scenario, "flockesc_env"), (scenario, "flockesc_env.envs.gymnasium")]


@pytest.mark.parametrize(
    "statement",
    [
        "import flockesc_env.watch, flockesc_env.policies.registry, flockesc_env.models.records",
        "import flockesc_env.render, flockesc_env.render.video",
        "from flockesc_env import *; sweep(LineScenario(), [0.1], [0]).best_range()",
        "import gymnasium; gymnasium.make('flockesc_env:flockesc/FlockEscape-v1').reset(seed=0)",
        "import flockesc_env; flockesc_env.parallel_env().reset(seed=0)",
    ],
)
def test_importing_loads_nothing_heavy(statement: str) -> None:
    script = f"{statement}\nimport sys\nprint(*{{name.partition('.')[0] for name in sys.modules}})"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)  # noqa: S603
    loaded = set(run.stdout.split())
    assert "flockesc_env" in loaded
    assert not loaded & HEAVY


def test_rules_multiply_and_add_themselves() -> None:
    """The last bits of ``@`` and ``**`` depend on the machine. Ruff bans such functions (TID251)."""
    for path in (ROOT / "flockesc_env" / "policies").glob("*.py"):
        for part in ast.walk(ast.parse(path.read_text())):
            assert not isinstance(part, ast.BinOp) or not isinstance(part.op, ast.MatMult | ast.Pow), path


def test_all_public_names_exist() -> None:
    """No object hides a module of the same name: ``import package.module as x`` would return the object."""
    for module in IMPORTS:
        parent, _, name = module.rpartition(".")
        assert isinstance(vars(sys.modules.get(parent, ast)).get(name, ast), ModuleType), module
    assert len(set(flockesc_env.__all__)) == len(flockesc_env.__all__)
    assert all(hasattr(flockesc_env, name) for name in flockesc_env.__all__)
    assert (ROOT / "flockesc_env" / "py.typed").exists()
