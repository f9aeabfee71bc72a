"""``flockesc watch`` gives the same pages and videos as the library."""

from __future__ import annotations

import sys
from pathlib import Path
from urllib.parse import urlencode

import imageio_ffmpeg
import pytest
from cli_runs import SMALL, SMALL_FLAGS, Ran, policy_file

from flockesc_env import LineScenario, load_policy, simulate, simulate_line
from flockesc_env.cli.exits import Exit
from flockesc_env.common.errors import ArgumentError
from flockesc_env.models.records import save_run
from flockesc_env.policies.registry import NAMES, built_in
from flockesc_env.watch import write_page
from flockesc_env.watch.page import render
from flockesc_env.watch.server import Server, run_for


def test_a_page_of_policies_on_one_flock(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    page, expected = tmp_path / "page.html", tmp_path / "expected.html"
    spec = str(policy_file(tmp_path / "mine.npz"))
    policies = {"fixed:10": built_in("fixed:10"), "stubborn-leaders": built_in("stubborn-leaders")}
    policies[spec] = load_policy(spec)
    ran = Ran(capsys, "watch", "--policies", *policies, "--seed", 7, *SMALL_FLAGS, "--output", page)
    assert (ran.code, ran.out) == (Exit.DONE, "")
    write_page([(name, policy.record(7, SMALL)) for name, policy in policies.items()], expected)
    assert page.read_bytes() == expected.read_bytes()


def test_a_page_of_a_users_own_policy(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = "from flockesc_env import FixedRange, NamedPolicy\n"
    code += "def make(): return NamedPolicy('', FixedRange(4.0))\n"
    (tmp_path / "my_policies.py").write_text(code + "def other(): return 7\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    flags = ["--seed", 7, *SMALL_FLAGS, "--output", "page.html"]
    assert Ran(capsys, "watch", "--policies", "my_policies:make", *flags).code == Exit.DONE
    write_page([("my_policies:make", built_in("fixed:4").record(7, SMALL))], tmp_path / "expected.html")
    assert Path("page.html").read_bytes() == Path("expected.html").read_bytes()
    for spec, said in (
        ("my_policies:other", "a NamedPolicy"),
        ("my_policies:none", "has no attribute 'none'"),
    ):
        refused = Ran(capsys, "watch", "--policies", spec, *flags)
        assert refused.code == Exit.REFUSED
        assert said in refused.err


def test_a_served_page_shows_policies_in_files_as_recordings(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The server runs only built-in policies; it reads no file named in an address."""
    spec, pages = str(policy_file(tmp_path / "mine.npz")), []

    def visit(server: Server, _: float) -> None:
        pages.append(server.page.decode())
        with pytest.raises(ArgumentError, match="policy: expected one of fixed:RHO"):
            run_for(urlencode({"seed": 7, "policy": spec}), server.scenario)
        raise KeyboardInterrupt

    monkeypatch.setattr(Server, "serve_forever", visit)
    flags = ["--policies", "fixed:10", spec, "--seed", 7, *SMALL_FLAGS, "--no-browser"]
    assert Ran(capsys, "watch", *flags).code == Exit.DONE
    recorded = [("fixed:10", built_in("fixed:10")), (spec, load_policy(spec))]
    live = {
        "seed": "7",
        "policies": NAMES,
        "maxRange": 100.0,
        "panels": ["fixed:10", None],  # policies that are not built in are offered as recordings
    }
    assert pages == [render([(name, entry.record(7, SMALL)) for name, entry in recorded], live)]


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
