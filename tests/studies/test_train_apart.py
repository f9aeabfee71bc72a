"""Training runs in processes of their own: their flags say what their arguments are."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest
from tiny_studies import TINY, Spy

import training.train
from training.config import POLICY_FILE, Args, RunRecord, train_presets
from training.policies import named_policy
from training.processes import train_apart

CHANGES: list[tuple[str, dict[str, Any]]] = [
    ("demo-ppo", {}),
    ("demo-ppo", {"seed": 7, "learning_rate": 3.3e-4, "net_arch": (8, 4)}),
    ("demo-ppo", {"anneal": False, "tensorboard": True, "per_agent": False, "predator_visible": False}),
    ("shared-tqc", {"objective": "minimum", "buffer_size": 5, "max_range": 12.5}),
    (
        "per-agent-visible-search",
        {"mirror": False, "memory": 3, "inputs": ("time", "speed"), "hidden": (4, 4)},
    ),
    ("per-agent-visible-search", {"step_size": 0.1 + 0.2, "scenario": "pursuit", "checkpoint_every": 1}),
]


@pytest.mark.parametrize(("name", "changes"), CHANGES)
def test_flags_say_what_differs_from_the_preset(
    name: str, changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    given: list[Args] = []
    monkeypatch.setattr(training.train, "train", given.append)
    spy = Spy(monkeypatch)
    args = dataclasses.replace(train_presets()[name], run=tmp_path / "a run", **changes)
    train_apart(name, args)
    assert given == [dataclasses.replace(args, progress=False)]
    (command,) = spy.commands
    flags = sum(word.startswith("--") for word in command)
    assert flags == 2 + len(changes)  # --no-progress and --run


def test_a_process_trains_on_one_core_or_says_why_not(tmp_path: Path) -> None:
    scenario = tmp_path / "tiny.toml"
    scenario.write_text(TINY.to_toml())
    args = dataclasses.replace(
        train_presets()["per-agent-visible-search"],
        run=tmp_path / "run",
        scenario=str(scenario),
        population=4,
        final_flocks=2,
        generations=1,
    )
    train_apart("per-agent-visible-search", args)
    assert RunRecord.read(args.run).args == dataclasses.replace(args, progress=False)
    before = (args.run / POLICY_FILE).read_bytes()
    assert named_policy(str(args.run)).scenario == TINY
    with pytest.raises(RuntimeError, match=r"(?s)-m training train .* failed:.*without a finished run"):
        train_apart("per-agent-visible-search", args)
    assert (args.run / POLICY_FILE).read_bytes() == before
