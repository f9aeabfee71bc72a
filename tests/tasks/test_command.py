"""``flockesc tasks``: lists tasks, scores, verifies and compares policies, and names bad input."""

import errno
import re
from pathlib import Path

import pytest
from cli_runs import Cli, Ran, policy_file

from flockesc_env import StubbornLeaders, load_policy, tasks
from flockesc_env.cli import tasks as command
from flockesc_env.cli.output import Exit
from flockesc_env.taskset import draw_flocks, read_result

TASK = "per-agent-visible"


class Rule(StubbornLeaders):
    """Code of a user."""


def rule() -> Rule:
    return Rule().with_options(name="own", **dict(load_policy("stubborn-leaders").options or {}))


@pytest.fixture
def folder(few_flocks: range, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with the policy file of a learner."""
    assert few_flocks
    monkeypatch.chdir(tmp_path)
    policy_file(tmp_path / "mine-0.npz")
    return tmp_path


def score(cli: Cli, *words: str) -> Ran:
    return cli("score", *words, "--task", TASK)


def test_tasks_are_listed(cli: Cli) -> None:
    listed = cli("tasks")
    assert listed.code == Exit.DONE
    for name, task in tasks.items():
        assert f"\n{name} " in f"\n{listed.out}"
        explained = cli("tasks", name).out
        for scenario, scale in task.scales.items():
            assert f"{task.spec.text(scale.zero)} in {scenario} (best" in explained
            assert f"{task.spec.text(scale.one)} in {scenario} ({scale.reference})" in explained


def test_policies_are_scored_verified_and_compared(few_flocks: range, folder: Path, cli: Cli) -> None:
    ran = score(cli, "mine-0.npz", "--learner", "mine", "--output", "mine.json")
    result = read_result(folder / "mine.json")
    assert (ran.code, result.learner, result.training) == (Exit.DONE, "mine", None)
    assert ran.out.startswith(f"{TASK}, mine: score {result.scores()[0]:.3f}\n")

    score(cli, "stubborn-leaders", "--output", "rule.json")
    (folder / "other.json").write_text((folder / "rule.json").read_text().replace('"v1"', '"v2"'))
    flags = ("mine.json", "rule.json", "--flocks", 4)
    ran = cli("verify", *flags)
    assert ran.code == Exit.DONE
    assert "mine.json: verified: 4 of 6 flocks, 1 policies; not verified: learner, training and" in ran.out
    assert "score" not in ran.out
    seed = int(re.fullmatch(r"flockesc: playing 4 of 6 flocks, which --draw (\d+) repeats\n", ran.err)[1])
    assert cli("verify", *flags, "--draw", seed).out == ran.out
    at = [flock - few_flocks.start for flock in draw_flocks(4, seed)]
    mean = result.values("paper-flock")[:, at].mean()
    assert f"means of these flocks\n  paper-flock: J_mean {mean:.1f} m\n" in ran.out
    ran = cli("verify", "other.json", "mine.json", "none.json")
    assert ran.code == Exit.REFUSED
    assert "refused: other.json: version: expected v1, got 'v2'" in ran.err
    assert "refused: none.json: No such file or directory (flockesc score --output none.json" in ran.err
    assert ran.out.startswith("mine.json: verified: 6 of 6 flocks, 1 policies")
    assert f"score {result.scores()[0]:.3f}" in ran.out


def test_a_full_disk_loses_no_score(folder: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*arguments: object, **options: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(command, "write_result", full)
    ran = score(cli, "mine-0.npz", "--output", "mine.json")
    assert ran.code == Exit.REFUSED
    assert "score 0." in ran.out


def test_code_is_scored_with_a_mark_and_not_verified(folder: Path, cli: Cli) -> None:
    ran = score(cli, f"{__name__}:rule", "--output", "code.json")
    assert ran.code == Exit.DONE, ran.err
    assert "; played by its author's code" in ran.out
    assert read_result(folder / "code.json").is_code
    score(cli, "stubborn-leaders", "--output", "same.json")
    code, same = (read_result(folder / file).policies[0].objectives for file in ("code.json", "same.json"))
    assert code == same
    ran = cli("verify", "code.json")
    assert (ran.code, ran.out) == (Exit.REFUSED, "")
    assert "expected a policy file or the name of a policy, which can be played again, got" in ran.err


SCORE = ["score", "mine-0.npz", "--task"]
BAD = {
    "command": (["scores"], "verify, got 'scores' (did you mean score or compare?)"),
    "task": ([*SCORE, "per-agent-visibly"], "got 'per-agent-visibly' (did you mean per-agent-visible, "),
    "no policy": (["score", "--task", TASK], "policies: expected at least one policy, got none"),
    "no file": (["verify"], "files: expected at least one file, got none"),
    "misfit": (["score", "turn-away", "--task", TASK], "turn-away: profile_ranges: expected none, as in the"),
    "suffix": ([*SCORE, TASK, "--output", "mine.md"], "output: expected a file that ends in .json, got"),
    "training": ([*SCORE, TASK, "--training", "training.toml"], "missing required field `cpu_minutes`"),
    "same file twice": (["score", "mine-0.npz", "mine-0.npz", "--task", TASK], "got one of them twice (mine"),
    "model": (
        ["compare", "best_model.zip", "--task", TASK],
        "such as PPO:best_model.zip, got 'best_model.zip'",
    ),
    "draw of all": (["verify", "a.json", "--draw", "1"], "draw: expected --flocks beside it, got 1"),
    "training seeds": ([*SCORE, TASK, "--training", "seeds.toml"], "training.seeds: expected 1 different"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_named_in_a_line_and_nothing_is_written(name: str, folder: Path, cli: Cli) -> None:
    argv, message = BAD[name]
    (folder / "training.toml").write_text("seeds = [0]\nsamples = 10\n")
    (folder / "seeds.toml").write_text("seeds = [0, 1]\nsamples = 10\ncpu_minutes = [1.0, 1.0]\n[versions]\n")
    before = sorted(folder.iterdir())
    output = [] if "--output" in argv or argv[0] != "score" else ["--output", "result.json"]
    ran = cli(*argv, *output)
    assert (ran.code, ran.out) == (Exit.REFUSED, "")
    (line,) = [line for line in ran.err.splitlines() if "playing" not in line]
    assert message in line
    assert sorted(folder.iterdir()) == before
