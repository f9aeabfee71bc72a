"""Pages hold runs, scenarios and policies, and run no foreign text; the command writes pages and videos."""

import re
from pathlib import Path

import imageio_ffmpeg
import pytest
from cli_runs import SMALL, SMALL_FLAGS, Cli, policy_file
from watch_documents import FLOCK, RUNS, assert_shows, document_in, is_live, needs_engine

from flockesc_env import load_policy, simulate
from flockesc_env.cli.output import Exit
from flockesc_env.models.records import save_run, versions
from flockesc_env.watch import write_page

BOARD = Path(__file__).parents[2] / "scoreboard" / "search"


@pytest.mark.parametrize("name", RUNS)
def test_the_page_holds_the_run(name: str, tmp_path: Path) -> None:
    run = RUNS[name]()
    write_page([(name, run)], tmp_path / "page.html")
    document = document_in((tmp_path / "page.html").read_text("utf-8"))
    (shown,) = document["recordings"]
    assert shown["name"] == name
    assert_shows(shown, run)
    assert document["versions"] == versions()
    assert document["start"]["policies"] == ["recording:0"]


def test_nothing_is_loaded_from_anywhere(tmp_path: Path) -> None:
    write_page([("run", simulate(FLOCK, 10.0, seed=3))], tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text("utf-8")
    markup = re.sub("(<script[^>]*>).*?</script>", r"\1", page, flags=re.DOTALL)
    assert re.findall(r"""\b(?:src|href|srcset|action|data)=["']?([^"'\s>]*)""", markup) == ["data:,"]
    assert not re.search(r"url\(|@import|\bimport\b *[({'\"]|\beval\(|new Function", page)
    assert re.findall(r"https?://[\w./]+", page) == ["http://www.w3.org/2000/svg"]  # a namespace is a name
    assert "default-src 'none'" in page


@needs_engine
@pytest.mark.parametrize("flags", [[], ["--output", "page.html"]])
def test_a_page_of_policies_records_those_that_it_cannot_run(
    flags: list[str], cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    mine = str(policy_file(tmp_path / "mine.npz"))
    code = "from flockesc_env import load_policy\ndef mine():\n    return load_policy('mine.npz')\n"
    (tmp_path / "user_code.py").write_text(code)
    specs = ["fixed:1e1", "stubborn-witnesses", mine, "stubborn-leaders", "user_code:mine"]
    ran = cli("watch", *specs, "--seed", 2**64 - 1, *SMALL_FLAGS, "--no-browser", *flags)
    assert ran.code == Exit.DONE
    assert ran.out.startswith("" if flags else "The page is ")
    path = Path("page.html") if flags else Path(ran.out.strip().removeprefix("The page is "))
    document = document_in(path.read_text("utf-8"))
    assert document["start"] == {
        "scenario": "given",
        "seed": str(2**64 - 1),
        "policies": ["fixed:10", "recording:0", mine, "stubborn-leaders", "recording:1"],
        "headline": mine,
    }
    rule, own = document["recordings"]
    assert_shows(rule, simulate(SMALL, policy=load_policy("stubborn-witnesses"), seed=2**64 - 1))
    assert_shows(own, simulate(SMALL, policy=load_policy(mine), seed=2**64 - 1))
    assert [entry["spec"] for entry in document["policies"]] == [mine]


@pytest.mark.parametrize("suffix", ["html", "gif"])
def test_policies_that_cannot_play_are_refused(suffix: str, cli: Cli, tmp_path: Path) -> None:
    for task, flags, message in (
        ("line", [], "expected a policy for a flock"),
        ("per-agent-visible-profile", ["--set", "frozen_graph=true"], "profile_ranges: expected none"),
    ):
        path = BOARD / "policies" / f"{task}-0.npz"
        ran = cli("watch", path, *SMALL_FLAGS, *flags, "--output", tmp_path / f"flock.{suffix}")
        assert (ran.code, ran.out, [*tmp_path.iterdir()]) == (Exit.REFUSED, "", [])
        assert message in ran.err


def test_without_the_engine_a_page_of_policies_is_recorded(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("cli.runs", "watch.page"):
        monkeypatch.setattr(f"flockesc_env.{module}.has_engine", lambda: False)
    page, specs = tmp_path / "page.html", ["fixed:10", str(policy_file(tmp_path / "mine.npz"))]
    ran = cli("watch", *specs, *SMALL_FLAGS, "--output", page)
    assert ran.code == Exit.DONE
    assert "make engine" in ran.err
    text = page.read_text("utf-8")
    assert not is_live(text)
    document = document_in(text)
    assert [shown["name"] for shown in document["recordings"]] == specs
    assert (document["scenarios"], document["policies"]) == ([], [])


def test_a_page_of_recorded_runs(cli: Cli, tmp_path: Path) -> None:
    runs = [("ten", simulate(SMALL, 10.0, seed=3)), ("", simulate(SMALL, 20.0, seed=3))]
    files = [tmp_path / "a.npz", tmp_path / "b.npz"]
    for file, (name, run) in zip(files, runs, strict=True):
        save_run(run, file, name=name)
    page, expected = tmp_path / "page.html", tmp_path / "expected.html"
    assert cli("watch", *files, "--output", page).code == Exit.DONE
    write_page([("ten", runs[0][1]), ("b", runs[1][1])], expected)
    assert page.read_bytes() == expected.read_bytes()


@pytest.mark.parametrize(
    ("suffix", "frames", "duration"),
    [("mp4", 10, 0.5), ("gif", 5, 2.4)],  # a GIF has a frame per 0.1 s and rests 2 s on the last one
)
def test_a_video(suffix: str, frames: int, duration: float, cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / f"flock.{suffix}"
    ran = cli("watch", "fixed:10", *SMALL_FLAGS, "--output", path)
    assert (ran.code, ran.out) == (Exit.DONE, "")
    count, seconds = imageio_ffmpeg.count_frames_and_secs(path)
    assert count == frames
    assert seconds == pytest.approx(duration, abs=0.06)  # GIFs store times in units of 0.01 s
