"""The watch server: it serves the page and new runs, to this machine only, until Ctrl-C."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from threading import Thread
from urllib.error import HTTPError
from urllib.parse import urlencode
from urllib.request import urlopen

import pytest
from watch_documents import FLOCK, assert_shows

from flockesc_env.policies.registry import built_in
from flockesc_env.watch.server import Server

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
