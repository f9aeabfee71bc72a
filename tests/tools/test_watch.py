"""The watch page holds the runs and runs no foreign text; the command and the server give the same page."""

from __future__ import annotations

import json
import re
import socket
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from threading import Thread
from urllib.error import HTTPError
from urllib.parse import urlencode
from urllib.request import urlopen

import imageio_ffmpeg
import pytest
from cli_runs import SMALL, SMALL_FLAGS, Ran, policy_file
from watch_documents import FLOCK, RUNS, assert_shows, document_in

from flockesc_env import (
    load_policy,
    simulate,
)
from flockesc_env.cli.exits import Exit
from flockesc_env.models.records import save_run, versions
from flockesc_env.policies.registry import built_in
from flockesc_env.watch import write_page
from flockesc_env.watch.server import Server


@pytest.mark.parametrize("name", RUNS)
def test_the_page_holds_the_run(name: str, tmp_path: Path) -> None:
    run = RUNS[name]()
    write_page([(name, run)], tmp_path / "page.html")
    document = document_in((tmp_path / "page.html").read_text("utf-8"))
    (shown,) = document["runs"]
    assert shown["name"] == name
    assert_shows(shown, run)
    assert document["versions"] == versions()
    assert document["live"] is None


class Loads(HTMLParser):
    """Collects the addresses that elements load, and counts the elements."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.asked: list[str | None] = []
        self.tags: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.asked += [value for name, value in attrs if name in {"src", "href", "srcset", "action", "data"}]


def test_nothing_is_loaded_from_anywhere(tmp_path: Path) -> None:
    write_page([("run", simulate(FLOCK, 10.0, seed=3))], tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text("utf-8")
    assert Loads(page).asked == ["data:,"]
    assert not re.search(r"url\(|@import|\bimport\b *[({'\"]|\beval\(|new Function", page)
    # The only address is in the comment that names uPlot's project.
    assert re.findall(r"https?://\S+", page) == ["https://github.com/leeoniya/uPlot"]
    assert "default-src 'none'" in page


HOSTILE = "</script><script>alert(1)</script><!-- <b>&amp;\u2028'\"$title ${data}"


def test_names_cannot_end_their_element(tmp_path: Path) -> None:
    run = simulate(FLOCK, 10.0, seed=3)
    write_page([("plain", run)], tmp_path / "plain.html")
    write_page([(HOSTILE, run)], tmp_path / "hostile.html")
    plain, hostile = ((tmp_path / f"{name}.html").read_text("utf-8") for name in ("plain", "hostile"))
    assert document_in(hostile)["runs"][0]["name"] == HOSTILE
    assert Loads(hostile).tags == Loads(plain).tags
    assert "alert(1)</script>" not in hostile


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


TIMEOUT = 60  # seconds; reached only by a server that does not answer or stop


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with Server(0, b"page", FLOCK) as server:
        thread = Thread(target=server.serve_forever, args=(0.05,))
        thread.start()
        yield server.address
        server.shutdown()
        thread.join()


def get(address: str) -> bytes:
    with urlopen(address, timeout=TIMEOUT) as response:  # noqa: S310, the server of this test
        answer: bytes = response.read()
    return answer


def test_the_server_serves_the_page(address: str) -> None:
    assert get(address) == b"page"


@pytest.mark.parametrize(("policy", "seed"), [("fixed:13.5", 2**64 - 1), ("stubborn-leaders", 4)])
def test_the_server_returns_the_runs_that_are_recorded_here(address: str, policy: str, seed: int) -> None:
    answer = json.loads(get(f"{address}run?{urlencode({'seed': seed, 'policy': policy})}"))
    assert answer["name"] == policy
    assert_shows(answer, built_in(policy).record(seed, FLOCK))


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ("policy=random", "seed"),
        ("seed=&policy=random", "seed"),
        (f"seed={'9' * 6000}&policy=random", "seed"),
        ("seed=1", "policy"),
        ("seed=1&policy=", "policy"),
        ("seed=1&policy=nobody", "policy"),
        ("seed=1&policy=fixed:-2", "policy"),
        ("seed=1&policy=../../etc", "policy"),
        ("", "policy"),
    ],
)
def test_a_bad_query_is_named(address: str, query: str, field: str) -> None:
    with pytest.raises(HTTPError) as caught:
        get(f"{address}run?{query}")
    with caught.value as error:
        assert error.code == 400
        refusal = json.load(error)
    assert refusal["field"] == field
    assert refusal["message"].startswith(f"{field}: expected ")


def test_the_server_listens_only_to_this_machine(address: str) -> None:
    port = int(address.rstrip("/").rpartition(":")[2])
    socket.create_connection(("127.0.0.1", port), timeout=TIMEOUT).close()
    # A server on all addresses would answer on every address of the loopback network.
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", port), timeout=TIMEOUT)
