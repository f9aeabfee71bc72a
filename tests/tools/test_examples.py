"""The files in ``examples`` run from beginning to end, and equal seeds give equal policies.

Those of libraries that are not in .venv run in ``make compat``.
"""

import re
import runpy
import sys
from pathlib import Path

import pytest
import torch

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = ("--iterations", "1", "--flocks", "1", "--held-out", "4")
GAIN = re.compile(
    r"^([+-]\d+\.\d) m \[([+-]\d+\.\d), ([+-]\d+\.\d)\] over the best fixed range$", re.MULTILINE
)


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
