"""The package without extras: features that need an extra name it, everything else runs."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import gymnasium
import pytest

import flockesc_env

FLOCKESC = Path(sys.prefix, "bin", "flockesc")
SMALL = ("--scenario", "small.toml")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(flockesc_env.FlockScenario(num_agents=5, num_steps=10).to_toml())


def flockesc(*arguments: str) -> tuple[int, str]:
    done = subprocess.run([FLOCKESC, *arguments], capture_output=True, text=True, check=False)  # noqa: S603
    return done.returncode, done.stdout + done.stderr


def test_environments_play() -> None:
    env = gymnasium.make("flockesc_env:flockesc/FlockEscape-v1", scenario="pursuit", action_mode="range")
    env.reset(seed=7)
    env.step([10.0])
    parallel = flockesc_env.parallel_env()
    parallel.reset(seed=7)
    parallel.step({agent: parallel.action_space(agent).sample() for agent in parallel.agents})


@pytest.mark.parametrize(
    "arguments",
    [
        ("presets",),
        ("simulate", *SMALL, "fixed:10", "--seed", "7"),
        ("simulate", *SMALL, "stubborn-leaders", "--seed", "7"),
        ("sweep", *SMALL, "--max-range", "20", "--seeds", "0:4"),
        ("watch", *SMALL, "fixed:15", "--seed", "7", "--output", "escape.html"),
    ],
)
def test_commands_run(arguments: tuple[str, ...]) -> None:
    assert flockesc(*arguments)[0] == 0


def test_a_run_is_saved_and_replayed() -> None:
    assert flockesc("simulate", *SMALL, "fixed:10", "--seed", "7", "--output", "run.npz")[0] == 0
    assert flockesc("replay", "run.npz")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "extra"),
    [
        (("sweep", *SMALL, "--max-range", "20", "--seeds", "0:4", "--output", "curve.png"), "analysis"),
        (("sweep", *SMALL, "--max-range", "20", "--seeds", "0:4", "--output", "table.parquet"), "analysis"),
        (("watch", *SMALL, "fixed:15", "--seed", "7", "--output", "escape.mp4"), "video"),
    ],
)
def test_missing_extras_are_named(arguments: tuple[str, ...], extra: str) -> None:
    code, said = flockesc(*arguments)
    assert code == 2
    assert f"flockesc-env[{extra}]" in said
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("module", "extra"), [("sb3", "sb3"), ("torchrl", "torchrl"), ("benchmarl", "benchmarl")]
)
def test_missing_frameworks_are_named(module: str, extra: str) -> None:
    with pytest.raises(ImportError, match=rf"flockesc-env\[{extra}\]"):
        importlib.import_module(f"flockesc_env.{module}")
