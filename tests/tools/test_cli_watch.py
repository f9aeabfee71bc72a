"""``flockesc watch`` gives the same pages and videos as the library."""

from __future__ import annotations

from pathlib import Path

import imageio_ffmpeg
import pytest
from cli_runs import SMALL, SMALL_FLAGS, Ran, policy_file

from flockesc_env import LineScenario, load_policy, simulate, simulate_line
from flockesc_env.cli.exits import Exit
from flockesc_env.models.records import save_run
from flockesc_env.policies.registry import built_in
from flockesc_env.watch import write_page


def test_a_page_of_policies_on_one_flock(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    page, expected = tmp_path / "page.html", tmp_path / "expected.html"
    spec = str(policy_file(tmp_path / "mine.npz"))
    policies = {"fixed:10": built_in("fixed:10"), "stubborn-leaders": built_in("stubborn-leaders")}
    policies[spec] = load_policy(spec)
    ran = Ran(capsys, "watch", "--policies", *policies, "--seed", 7, *SMALL_FLAGS, "--output", page)
    assert (ran.code, ran.out) == (Exit.DONE, "")
    write_page([(name, policy.record(7, SMALL)) for name, policy in policies.items()], expected)
    assert page.read_bytes() == expected.read_bytes()


def test_a_page_of_recorded_runs(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    runs = [("ten", simulate(SMALL, 10.0, seed=3)), ("", simulate(SMALL, 20.0, seed=3))]
    files = [tmp_path / "a.npz", tmp_path / "b.npz"]
    for file, (name, run) in zip(files, runs, strict=True):
        save_run(run, file, name=name)
    page, expected = tmp_path / "page.html", tmp_path / "expected.html"
    assert Ran(capsys, "watch", *files, "--output", page).code == Exit.DONE
    write_page([("ten", runs[0][1]), ("b", runs[1][1])], expected)
    assert page.read_bytes() == expected.read_bytes()


@pytest.mark.parametrize("suffix", ["mp4", "gif"])
def test_a_video(suffix: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / f"flock.{suffix}"
    ran = Ran(capsys, "watch", "--policies", "fixed:10", *SMALL_FLAGS, "--output", path)
    assert (ran.code, ran.out) == (Exit.DONE, "")
    count, seconds = imageio_ffmpeg.count_frames_and_secs(path)
    assert count == SMALL.num_steps + 1
    assert seconds == pytest.approx(count * SMALL.time_step, abs=0.06)  # GIFs store times in units of 0.01 s


@pytest.mark.parametrize(
    ("flags", "field"),
    [
        (["--policies", "fixed:far"], "policies"),
        (["--policies"], "policies"),
        (["--output", "page.pdf"], "output"),
        (["--scenario", "paper-line"], "scenario"),
        (["--port", "70000", "--no-browser"], "port"),
        (["line.npz"], "files"),
        (["--policies", "line.npz"], "line.npz"),
    ],
)
def test_bad_input_of_watch_is_named(
    flags: list[str],
    field: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    save_run(simulate_line(LineScenario(num_agents=3), 0.1, seed=0), "line.npz")
    ran = Ran(capsys, "watch", *flags)
    assert ran.code == Exit.REFUSED
    assert ran.err.startswith(f"flockesc: error: {field}")
    assert [path.name for path in tmp_path.iterdir()] == ["line.npz"]
