"""The watch page and its server: pages hold the runs, load nothing and execute no foreign text."""

from __future__ import annotations

import base64
import json
import re
import signal
import socket
import subprocess
import sys
import textwrap
import zlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from html.parser import HTMLParser
from http.client import HTTPConnection
from importlib.resources import files
from pathlib import Path
from threading import Event, Thread
from time import sleep
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import urlencode
from urllib.request import urlopen

import numpy as np
import pytest

from flockesc_env import (
    ArgumentError,
    ConstantVelocity,
    FlockScenario,
    LineScenario,
    PurePursuit,
    Trajectory,
    record,
    simulate,
    simulate_line,
)
from flockesc_env.models.graph import component_labels
from flockesc_env.models.records import versions
from flockesc_env.policies import FixedRange, StubbornLeaders, StubbornWitnesses
from flockesc_env.policies.registry import NAMES, built_in
from flockesc_env.render.palette import DARK, LIGHT
from flockesc_env.watch import serve, server, write_page
from flockesc_env.watch.document import run_document

FLOCK = FlockScenario(num_agents=12, num_steps=9)
TWO = (ConstantVelocity(), PurePursuit((90.0, 90.0, 0.0), (-12.0, 0.0, 0.0)))
TIMEOUT = 60  # seconds; reached only by a server that does not answer or stop

RUNS = {
    "one range": lambda: simulate(FLOCK, 10.0, seed=3),
    "schedule": lambda: simulate(FLOCK, schedule=np.linspace(0, 30, 9)[:, None], seed=2**64 - 1),
    "range per agent": lambda: record(FLOCK, StubbornLeaders(), 5, per_agent=True),
    "in space, two predators": lambda: simulate(FLOCK.replace(dimension=3, predators=TWO), 20.0, seed=1),
    "no predator": lambda: simulate(FLOCK.replace(predators=()), 20.0, seed=1),
    "given start": lambda: simulate(
        FLOCK, 10.0, initial_positions=np.eye(12)[:, :2], initial_velocities=np.zeros((12, 2))
    ),
    "more agents than 16 bits": lambda: simulate(FLOCK.replace(num_agents=70_000, num_steps=1), 0.0, seed=1),
}


def document_in(page: str) -> Any:
    (text,) = re.findall(r'<script type="application/json" id="document">(.*?)</script>', page)
    assert not set(text) & set("<>&")  # nothing that an HTML parser interprets
    return json.loads(text)


def numbers(column: dict[str, Any]) -> np.ndarray:
    raw = zlib.decompress(base64.b64decode(column["data"], validate=True))
    return np.frombuffer(raw, np.dtype(column["dtype"]).newbyteorder("<")).reshape(column["shape"])


def assert_shows(shown: Any, run: Trajectory) -> None:
    columns = {name: numbers(column) for name, column in shown["columns"].items()}
    in_force = np.concatenate([run.interaction_ranges, run.interaction_ranges[-1:]])
    expected = {
        "times": run.times,
        "positions": run.positions,
        "predators": run.predator_positions,
        "meanDistance": run.mean_distance,
        "minDistance": run.min_distance,
        "lowestMean": [run.mean_distance[: t + 1].min() for t in range(len(run.times))],
        "ranges": in_force,
    }
    for name, values in expected.items():
        np.testing.assert_array_equal(columns[name], np.asarray(values, np.float32), err_msg=name)
    np.testing.assert_array_equal(columns["numComponents"], run.num_components)
    per_agent = np.broadcast_to(in_force, run.positions.shape[:2])
    for t, positions in enumerate(run.positions):
        np.testing.assert_array_equal(columns["labels"][t], component_labels(None, positions, per_agent[t]))
        assert len(np.unique(columns["labels"][t])) == run.num_components[t]
    speed = np.linalg.norm(run.velocities, axis=-1, keepdims=True)
    units = np.where(speed > 0, run.velocities / np.where(speed > 0, speed, 1), 0)
    np.testing.assert_allclose(columns["headings"] / 127, units, rtol=0, atol=0.5 / 127 + 1e-12)
    assert (columns["lowRange"] <= columns["meanRange"]).all()
    assert (columns["meanRange"] <= columns["highRange"]).all()
    assert shown["seed"] == (None if run.is_start_given else str(run.seed))
    assert FlockScenario.from_json(json.dumps(shown["scenario"])) == run.scenario


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


def test_the_band_of_ranges_is_a_standard_deviation() -> None:
    run = record(FLOCK, StubbornLeaders(), 5, per_agent=True, predator_sensing_range=None)
    columns = run_document("", run)["columns"]
    row = run.interaction_ranges[4]
    assert 0 < row.std() < 10
    low, high = row.mean() - row.std(), row.mean() + row.std()
    assert numbers(columns["lowRange"])[4] == pytest.approx(max(low, row.min()), abs=1e-5)
    assert numbers(columns["highRange"])[4] == pytest.approx(min(high, row.max()), abs=1e-5)


def test_runs_stand_side_by_side_in_order(tmp_path: Path) -> None:
    runs = [
        ("b", simulate(FLOCK, 5.0, seed=3)),
        ("a", simulate(FLOCK, 9.0, seed=3)),
        ("c", RUNS["schedule"]()),
    ]
    write_page(runs, tmp_path / "page.html")
    shown = document_in((tmp_path / "page.html").read_text("utf-8"))["runs"]
    assert [run["name"] for run in shown] == ["b", "a", "c"]
    for entry, (_, run) in zip(shown, runs, strict=True):
        assert_shows(entry, run)


def test_the_papers_flock_is_a_small_page(tmp_path: Path) -> None:
    run = built_in("random").record(7)  # a new range for every agent and step compresses least
    write_page([("random", run)], tmp_path / "page.html")
    stubborn = built_in("stubborn-leaders").record(7)
    write_page([("stubborn-leaders", stubborn)], tmp_path / "stubborn.html")
    assert (tmp_path / "stubborn.html").stat().st_size < 1_000_000
    assert (tmp_path / "page.html").stat().st_size < 1_500_000


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


def test_the_page_has_the_palette_of_all_pictures(tmp_path: Path) -> None:
    write_page(simulate(FLOCK, 10.0, seed=3), tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text("utf-8")
    light, dark = re.findall(r":root \{ (--[^}]*) \}", page)
    for css, palette in ((light, LIGHT), (dark, DARK)):
        assert f"--predator: {palette.predator};" in css
        assert f"--components: {', '.join(palette.components)};" in css
        assert f"--ranges: {', '.join(palette.ranges)};" in css
    own = files("flockesc_env.watch")
    styles = [own / "page.css", own / "page.html", *(own / "js").iterdir()]
    assert not [style.name for style in styles if re.search(r"#[0-9a-fA-F]{6}\b", style.read_text("utf-8"))]


@pytest.mark.parametrize(
    ("name", "ranges", "kind"),
    [
        ("fixed:10", 10.0, "fixed"),
        ("any name", 10.0, "fixed"),
        ("random", None, "rule"),
        ("mine", None, "learned"),
    ],
)
def test_a_run_has_the_kind_of_its_policy(name: str, ranges: float | None, kind: str) -> None:
    run = built_in("random").record(3, FLOCK) if ranges is None else simulate(FLOCK, ranges, seed=3)
    assert run_document(name, run)["kind"] == kind


HOSTILE = "</script><script>alert(1)</script><!-- <b>&amp;\u2028'\"$title ${data}"


def test_names_cannot_end_their_element(tmp_path: Path) -> None:
    run = simulate(FLOCK, 10.0, seed=3)
    write_page([("plain", run)], tmp_path / "plain.html")
    write_page([(HOSTILE, run)], tmp_path / "hostile.html")
    plain, hostile = ((tmp_path / f"{name}.html").read_text("utf-8") for name in ("plain", "hostile"))
    assert document_in(hostile)["runs"][0]["name"] == HOSTILE
    assert Loads(hostile).tags == Loads(plain).tags
    assert "alert(1)</script>" not in hostile


@pytest.mark.parametrize(
    ("runs", "field"),
    [
        ([], "runs"),
        ([("a", RUNS["one range"]()), ("b", RUNS["in space, two predators"]())], "runs"),
        ([("line", simulate_line(LineScenario(), 0.1, seed=3))], "runs[0]"),
        ([("a", RUNS["one range"]()), (1, RUNS["one range"]())], "runs[1]"),
        ([RUNS["one range"]()], "runs[0]"),
    ],
)
def test_bad_runs_are_named(runs: Any, field: str, tmp_path: Path) -> None:
    with pytest.raises(ArgumentError) as caught:
        write_page(runs, tmp_path / "page.html")
    assert caught.value.field == field
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"runs": []}, "runs"),
        ({"seed": -1}, "seed"),
        ({"port": 2**16}, "port"),
        ({"port": -1}, "port"),
        ({"port": "8000"}, "port"),
        ({"scenario": FLOCK.replace(dimension=3, predators=())}, "scenario"),
    ],
)
def test_a_bad_server_is_refused_before_it_listens(changes: dict[str, Any], field: str) -> None:
    arguments = {"runs": [("run", RUNS["one range"]())], "scenario": FLOCK, "seed": 3, **changes}
    with pytest.raises(ArgumentError) as caught:
        serve(**arguments, open_browser=False)
    assert caught.value.field == field


@pytest.mark.parametrize("spec", ["fixed:2.5", *NAMES[1:]])
def test_named_policies_record_the_runs_of_their_policies(spec: str) -> None:
    first, again = (built_in(spec).record(5, FLOCK) for _ in range(2))
    np.testing.assert_array_equal(first.interaction_ranges, again.interaction_ranges)
    if spec == "stubborn-witnesses":
        mine = record(FLOCK, StubbornWitnesses(), 5, per_agent=True)
        np.testing.assert_array_equal(first.positions, mine.positions)
    elif spec.startswith("stubborn"):
        sensing = None if spec == "stubborn-leaders" else "predator_range"
        mine = record(FLOCK, StubbornLeaders(), 5, per_agent=True, predator_sensing_range=sensing)
        np.testing.assert_array_equal(first.positions, mine.positions)
    assert first.interaction_ranges.shape[1] == (1 if spec.startswith("fixed") else 12)


def test_a_fixed_range_may_exceed_the_default_maximum() -> None:
    run = built_in("fixed:400").record(5, FLOCK)
    np.testing.assert_array_equal(run.interaction_ranges, 400.0)


@pytest.mark.parametrize(
    "spec", ["", "fixed", "fixed:", "fixed:x", "fixed:-1", "fixed:inf", "fixed:nan", "Random"]
)
def test_unknown_policies_are_named(spec: str) -> None:
    with pytest.raises(ArgumentError, match=r"^policies: expected one of fixed:RHO, random"):
        built_in(spec)


def start_server(
    scenario: str = "FlockScenario(num_agents=12, num_steps=9)",
) -> tuple[subprocess.Popen[str], str]:
    """Serve two runs of seed 3 in a new process; return the process and its address."""
    script = f"""
        import signal
        from flockesc_env import FlockScenario, simulate
        from flockesc_env.policies.registry import built_in
        from flockesc_env.watch import serve

        signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job inherits none
        shown = FlockScenario(num_agents=12, num_steps=9)
        runs = [("fixed:5", built_in("fixed:5").record(3, shown))]
        runs.append(("recorded.npz", simulate(shown, 7.0, seed=3)))
        serve(runs, scenario={scenario}, seed=3, open_browser=False)
    """
    command = [sys.executable, "-c", textwrap.dedent(script)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # noqa: S603
    assert process.stdout is not None
    line = process.stdout.readline()
    found = re.fullmatch(r"Watching at (http://127\.0\.0\.1:\d+/) \(Ctrl-C stops\)\n", line)
    if found is None:
        process.kill()
        raise AssertionError(f"{line!r}, {process.communicate()}")
    return process, found[1]


def stop(process: subprocess.Popen[str]) -> str:
    """Send Ctrl-C and return the output since the start."""
    process.send_signal(signal.SIGINT)
    try:
        output, errors = process.communicate(timeout=TIMEOUT)
    finally:
        process.kill()
    assert (process.returncode, errors) == (0, "")
    return output


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    process, address = start_server()
    yield address
    assert stop(process) == "Stopped.\n"


def get(address: str) -> bytes:
    with urlopen(address, timeout=TIMEOUT) as response:  # noqa: S310, the server of this test
        answer: bytes = response.read()
    return answer


def test_the_server_serves_the_page(address: str) -> None:
    document = document_in(get(address).decode())
    assert [run["name"] for run in document["runs"]] == ["fixed:5", "recorded.npz"]
    assert_shows(document["runs"][0], built_in("fixed:5").record(3, FLOCK))
    live = document["live"]
    assert (live["seed"], tuple(live["policies"]), live["maxRange"]) == ("3", NAMES, 100.0)
    assert live["panels"] == ["fixed:5", None]


@pytest.mark.parametrize("policy", ["fixed:13.5", *NAMES[1:]])
@pytest.mark.parametrize("seed", [4, 2**64 - 1])
def test_the_server_returns_the_runs_that_are_recorded_here(address: str, policy: str, seed: int) -> None:
    answer = json.loads(get(f"{address}run?{urlencode({'seed': seed, 'policy': policy})}"))
    assert answer["name"] == policy
    assert_shows(answer, built_in(policy).record(seed, FLOCK))


def test_a_fixed_range_from_the_server_is_a_simulation(address: str) -> None:
    answer = json.loads(get(f"{address}run?seed=4&policy=fixed:100"))
    assert_shows(answer, simulate(FLOCK, 100.0, seed=4))
    assert_shows(answer, record(FLOCK, FixedRange(100.0), 4))


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ("policy=random", "seed"),
        ("seed=1&seed=2&policy=random", "seed"),
        ("seed=&policy=random", "seed"),
        ("seed=-1&policy=random", "seed"),
        ("seed=1.5&policy=random", "seed"),
        (f"seed={2**64}&policy=random", "seed"),
        (f"seed={'9' * 6000}&policy=random", "seed"),
        ("seed=1", "policy"),
        ("seed=1&policy=", "policy"),
        ("seed=1&policy=nobody", "policy"),
        ("seed=1&policy=fixed:-2", "policy"),
        ("seed=1&policy=../../etc", "policy"),
        ("seed=1&policy=random&steps=5", "steps"),
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


def test_other_paths_and_methods_are_refused(address: str) -> None:
    for path in ("index.html", "run/", "../page.html", "favicon.ico"):
        with pytest.raises(HTTPError) as caught:
            get(address + path)
        with caught.value as error:
            assert error.code == 404
    with pytest.raises(HTTPError) as caught, urlopen(address, data=b"seed=1", timeout=TIMEOUT):  # noqa: S310
        pass
    with caught.value as error:
        assert error.code == 501  # only GET is allowed


def test_the_server_listens_only_to_this_machine(address: str) -> None:
    port = int(address.rstrip("/").rpartition(":")[2])
    socket.create_connection(("127.0.0.1", port), timeout=TIMEOUT).close()
    # A server on all addresses would answer on every address of the loopback network.
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", port), timeout=TIMEOUT)


def test_a_silent_or_closed_connection_blocks_no_other(address: str) -> None:
    port = int(address.rstrip("/").rpartition(":")[2])
    with (
        socket.create_connection(("127.0.0.1", port), timeout=TIMEOUT),
        socket.create_connection(("127.0.0.1", port), timeout=TIMEOUT) as leaving,
    ):
        leaving.sendall(f"GET /run?seed=1&policy=random HTTP/1.0\r\nHost: localhost:{port}\r\n\r\n".encode())
        leaving.close()
        assert json.loads(get(f"{address}run?seed=1&policy=random"))["name"] == "random"


def test_ctrl_c_stops_a_server_whose_run_would_take_hours() -> None:
    process, address = start_server("FlockScenario(num_agents=2000, num_steps=10**8)")

    def ask() -> None:
        with pytest.raises((URLError, ConnectionError)):
            get(f"{address}run?seed=1&policy=fixed:5")

    asking = Thread(target=ask)
    asking.start()
    get(address)  # answered while the run is under way
    assert stop(process) == "Stopped.\n"
    asking.join(TIMEOUT)
    assert not asking.is_alive()


def test_a_port_that_is_taken_is_named() -> None:
    runs = [("run", RUNS["one range"]())]
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ArgumentError, match=f"^port: expected a free TCP port, got {port} ") as caught:
            serve(runs, scenario=FLOCK, seed=3, port=port, open_browser=False)
    assert caught.value.field == "port"


def test_one_run_is_a_page_under_the_name_of_its_file(tmp_path: Path) -> None:
    run = simulate(FLOCK, 10.0, seed=3)
    write_page(run, tmp_path / "flock.html")
    alone = (tmp_path / "flock.html").read_text("utf-8")
    write_page([("flock", run)], tmp_path / "flock.html")
    assert (tmp_path / "flock.html").read_text("utf-8") == alone


def status(port: int, path: str, hosts: list[str]) -> int:
    """Return the status of a request with these ``Host`` headers."""
    connection = HTTPConnection("127.0.0.1", port, timeout=TIMEOUT)
    connection.putrequest("GET", path, skip_host=True)
    for host in hosts:
        connection.putheader("Host", host)
    connection.endheaders()
    code = connection.getresponse().status
    connection.close()
    return code


@pytest.mark.parametrize("path", ["/", "/run?seed=1&policy=random", "/nothing"])
def test_only_its_own_address_is_answered(address: str, path: str) -> None:
    """DNS rebinding: a site whose name points at this machine gets neither the page nor runs."""
    port = int(address.rstrip("/").rpartition(":")[2])
    own = status(port, path, [f"127.0.0.1:{port}"])
    assert own == status(port, path, [f"localhost:{port}"]) == (404 if path == "/nothing" else 200)
    for hosts in (
        [],
        [""],
        ["localhost"],
        ["127.0.0.1:1"],
        ["evil.example"],
        [f"evil.example:{port}"],
        [f"localhost.evil.example:{port}"],
        [f"127.0.0.1:{port}.evil.example"],
        [f"127.0.0.2:{port}"],
        [f"127.0.0.1:{port}", "evil.example"],
    ):
        assert status(port, path, hosts) == 403, hosts


def test_more_runs_than_may_wait_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    started, may_end = Event(), Event()

    def run_for(query: str, scenario: FlockScenario) -> bytes:
        if query == "stop":
            raise KeyboardInterrupt
        started.set()
        may_end.wait(TIMEOUT)
        return query.encode()

    monkeypatch.setattr(server, "run_for", run_for)
    with server._Server(0, b"page", FLOCK) as listening, ThreadPoolExecutor(server.MAX_WAITING + 2) as pool:

        def work() -> None:
            with suppress(KeyboardInterrupt):
                listening.work()

        working = pool.submit(work)
        first = pool.submit(get, f"{listening.address}run?0")
        assert started.wait(TIMEOUT)
        waiting = [pool.submit(listening.run, f"{number + 1}") for number in range(server.MAX_WAITING)]
        while not listening.waiting.full():
            sleep(0.001)
        with pytest.raises(HTTPError) as caught:
            get(f"{listening.address}run?one+too+many")
        with caught.value as error:
            assert error.code == 503
            assert json.load(error) == {"message": "16 runs are waiting already; try again in a moment."}
        assert get(listening.address) == b"page"  # pages do not wait for runs
        may_end.set()
        assert first.result(TIMEOUT) == b"0"
        assert [run.result(TIMEOUT) for run in waiting] == [
            b"%d" % (n + 1) for n in range(server.MAX_WAITING)
        ]
        assert get(f"{listening.address}run?again") == b"again"
        Thread(target=listening.run, args=["stop"], daemon=True).start()
        working.result(TIMEOUT)
