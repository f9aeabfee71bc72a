"""The watch server: it serves the page and new runs, to its own address only, until Ctrl-C."""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from http.client import HTTPConnection
from threading import Event, Thread
from time import sleep
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import urlencode
from urllib.request import urlopen

import numpy as np
import pytest
from watch_documents import FLOCK, RUNS, assert_shows, document_in, numbers

from flockesc_env import (
    ArgumentError,
    FlockScenario,
    record,
    simulate,
)
from flockesc_env.policies import FixedRange
from flockesc_env.policies.registry import NAMES, built_in
from flockesc_env.watch import serve, server

TIMEOUT = 60  # seconds; reached only by a server that does not answer or stop


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


def test_a_range_beyond_float32_is_served_without_a_warning(address: str) -> None:
    columns = json.loads(get(f"{address}run?seed=4&policy=fixed:1e308"))["columns"]
    expected = simulate(FLOCK, 1e308, seed=4).positions.astype(np.float32)
    np.testing.assert_array_equal(numbers(columns["positions"]), expected)
    assert set(numbers(columns["ranges"]).ravel()) == {np.finfo(np.float32).max}


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
    host = address.removeprefix("http://").rstrip("/")
    assert status(int(host.partition(":")[2]), "http://[", [host]) == 400
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
        if query == "warn":
            raise RuntimeWarning
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
        with pytest.raises(RuntimeWarning):  # as with -W error
            listening.run("warn")
        assert get(f"{listening.address}run?again") == b"again"
        Thread(target=listening.run, args=["stop"], daemon=True).start()
        working.result(TIMEOUT)
