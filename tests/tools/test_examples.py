"""Examples run and are seeded; committed notebooks have their outputs; runs replay in notebooks.

Examples of libraries that are not in .venv run in ``make compat``.
"""

import html
import json
import re
import runpy
import sys
from base64 import b64decode
from io import StringIO
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import torch

import flockesc_env as fe
from flockesc_env.notebook import Replay
from flockesc_env.watch.page import render, replay

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = ("--iterations", "1", "--flocks", "1", "--held-out", "4")
GAIN = re.compile(r"(?m)^([+-]\d+\.\d) m \[([+-]\d+\.\d), ([+-]\d+\.\d)\] over the best fixed range$")
FLOCK = fe.FlockScenario(num_agents=20, num_steps=12)
RUN = fe.simulate(FLOCK, 10.0, seed=1)
NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples").glob("*.ipynb"))


def gains(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> list[float]:
    monkeypatch.setattr(sys, "argv", [name, *SHORT])
    monkeypatch.chdir(folder)
    runpy.run_path(str(EXAMPLES / name), run_name="__main__")
    printed = capsys.readouterr().out
    assert re.search(r"^18000 samples in \d+\.\d s of CPU time, \d+ samples/s$", printed, re.MULTILINE)
    (found,) = GAIN.findall(printed)
    return [float(number) for number in found]


@pytest.mark.parametrize("name", ["sb3_ppo.py", "ppo_single_file.py"])
def test_training_runs_and_is_seeded(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    gain, low, high = gains(name, tmp_path, monkeypatch, capsys)
    assert low < gain < high
    assert gains(name, tmp_path, monkeypatch, capsys) == [gain, low, high]


def test_tracks_become_a_flock_and_tables(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    example = runpy.run_path(str(EXAMPLES / "tracks.py"))
    monkeypatch.setattr(sys, "argv", ["tracks.py"])
    example["main"]()
    assert capsys.readouterr().out.endswith("(204, 5) (51, 2, 1, 4) (204, 4)\n")
    positions, velocities = example["arrays"](pl.read_csv(StringIO(example["synthetic"]())))
    assert np.flatnonzero(np.isnan(positions[:, 2, 0])).tolist() == [2, 9, 16, 23]
    np.testing.assert_allclose(velocities[5, 2], [25 * 6 / 40, 25 * 3 / 40])  # 6 pixels right, 3 up


def test_advantages_of_the_single_file() -> None:
    """They are sums of discounted errors until the episode ends."""
    make = runpy.run_path(str(EXAMPLES / "ppo_single_file.py"))["Rollout"]
    generator = torch.Generator().manual_seed(0)
    samples = make(num_steps=6, slots=3, entries=1)
    for tensor in (samples.rewards, samples.values, samples.next_values):
        tensor.copy_(torch.randn(6, 3, generator=generator))
    samples.ends[2, 0] = samples.ends[5, 1] = samples.ends[0, 2] = 1
    gamma, decay = 0.9, 0.8
    errors = samples.rewards + gamma * samples.next_values - samples.values
    advantages = samples.advantages(gamma, decay)
    for slot in range(3):
        for step in range(6):
            ends = samples.ends[step:, slot].nonzero()
            last = step + int(ends[0]) if len(ends) else 5
            expected = sum((gamma * decay) ** (t - step) * errors[t, slot] for t in range(step, last + 1))
            torch.testing.assert_close(advantages[step, slot], expected)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_committed_outputs_are_complete_and_small(path: Path) -> None:
    assert path.stat().st_size < 300_000
    cells = [cell for cell in json.loads(path.read_text("utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert {output["output_type"] for output in outputs} == {"stream", "execute_result"}
    assert not any(output.get("name") == "stderr" for output in outputs)
    shown = ["".join(output.get("data", {}).get("text/html", "")) for output in outputs]
    assert any(text.startswith("<iframe") for text in shown)


def test_runs_replay_side_by_side() -> None:
    other = fe.simulate(FLOCK, policy="stubborn-leaders", seed=1)
    shown = Replay([("10 m", RUN), ("rule", other)])
    assert repr(shown) == "Replay(10 m, rule)"
    page, inside = re.findall(r'^<iframe srcdoc="([^"]*)"[^>]*>(.*)</iframe>$', shown._repr_html_())[0]
    assert html.unescape(page) == render(shown.runs, replay(shown.runs), with_engine=False)
    # Viewers that strip frames show what is inside.
    (image,) = re.findall(r'^<img alt="flocks" src="data:image/png;base64,([^"]+)">$', inside)
    assert b64decode(image).startswith(b"\x89PNG")
