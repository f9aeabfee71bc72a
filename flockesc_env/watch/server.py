"""HTTP server of the watch page, for this machine only. It simulates the flocks that the page asks for."""

from __future__ import annotations

import json
import webbrowser
from collections.abc import Sequence
from concurrent.futures import Future
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from queue import Empty, Full, Queue
from threading import Thread
from typing import Any
from urllib.parse import parse_qs

from flockesc_env.common.checks import as_count, as_flag, as_instance, as_seed
from flockesc_env.common.errors import ArgumentError, InputError
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.policies.registry import NAMES, built_in
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.watch.document import Run, check_runs, run_document
from flockesc_env.watch.page import render

MAX_WAITING = 16
"""Runs that may wait for the run under way. A page asks for one at a time in each of its panels."""

_LOOPBACK = "127.0.0.1"
_POLL = 0.05  # s between two checks for Ctrl-C, or for a request to stop


def serve(
    runs: Sequence[Run], *, scenario: FlockScenario, seed: int, port: int = 0, open_browser: bool = True
) -> None:
    """Serve the page to this machine until Ctrl-C; its controls simulate further flocks of the scenario.

    Args:
        runs: names and trajectories to show first. If the name is that of a built-in policy, the page
            offers this policy; otherwise it offers the recording.
        scenario: the scenario of every flock that the server simulates.
        seed: the seed that the controls start with.
        port: TCP port; 0 takes a free one. The address is printed.
        open_browser: whether to open the page in a browser.

    Raises:
        ArgumentError: if the runs cannot be shown side by side, the seed is bad, or the port is bad or taken.
    """
    port = as_count(port, "port", least=0, most=2**16 - 1)
    as_instance(scenario, "scenario", FlockScenario)
    as_flag(open_browser, "open_browser")
    check_runs(runs)
    live = {
        "seed": str(as_seed(seed)),
        "policies": NAMES,
        "maxRange": EnvOptions.max_range,
        "panels": [name if _is_policy(name) else None for name, _ in runs],
    }
    page = render(runs, live).encode()
    dimension = runs[0][1].scenario.dimension
    if scenario.dimension != dimension:
        raise ArgumentError("scenario", f"dimension {dimension}, as in the runs", scenario.dimension)
    with _listen(port, page, scenario) as server:
        try:
            print(f"Watching at {server.address} (Ctrl-C stops)", flush=True)
            if open_browser:
                webbrowser.open(server.address)
            server.work()
        except KeyboardInterrupt:
            print("Stopped.", flush=True)


def _listen(port: int, page: bytes, scenario: FlockScenario) -> _Server:
    try:
        return _Server(port, page, scenario)
    except OSError as error:
        raise ArgumentError("port", "a free TCP port", f"{port} ({error.strerror})") from error


class _Server(ThreadingHTTPServer):
    """Answers requests in threads; simulates in the thread that called ``work``, where Ctrl-C arrives.

    Attributes:
        address: the URL of the page.
        hosts: the values of the ``Host`` header that are answered.
        page: the page, encoded.
        scenario: the scenario of every flock that is simulated.
        waiting: queries that wait for the run under way, each with the future of its answer.
    """

    daemon_threads = True

    def __init__(self, port: int, page: bytes, scenario: FlockScenario) -> None:
        super().__init__((_LOOPBACK, port), _Handler)
        self.address = f"http://{_LOOPBACK}:{self.server_port}/"
        self.hosts = {f"{host}:{self.server_port}" for host in (_LOOPBACK, "localhost")}
        if self.server_port == 80:  # a browser leaves out the default port
            self.hosts |= {_LOOPBACK, "localhost"}
        self.page = page
        self.scenario = scenario
        self.waiting: Queue[tuple[str, Future[bytes]]] = Queue(MAX_WAITING)

    def work(self) -> None:
        """Listen, and simulate what requests ask for, until Ctrl-C."""
        Thread(target=self.serve_forever, args=(_POLL,), daemon=True).start()
        try:
            while True:
                try:
                    # A wait without a limit would miss a Ctrl-C that arrives right before it.
                    query, future = self.waiting.get(timeout=_POLL)
                except Empty:
                    continue
                try:
                    future.set_result(run_for(query, self.scenario))
                except Exception as error:  # of one answer; the server goes on
                    future.set_exception(error)
        finally:
            self.shutdown()

    def run(self, query: str) -> bytes:
        """Return the run that a query asks for, as JSON.

        Raises:
            InputError: if the query is bad; it names the field.
            queue.Full: if ``MAX_WAITING`` runs already wait.
        """
        future: Future[bytes] = Future()
        self.waiting.put_nowait((query, future))
        return future.result()


def run_for(query: str, scenario: FlockScenario) -> bytes:
    """Simulate the flock of ``seed=K&policy=NAME`` and return its document as JSON.

    Raises:
        InputError: if a field is missing, unknown or bad; it names the field.
    """
    values = parse_qs(query, keep_blank_values=True)
    for name in values:
        if name not in {"seed", "policy"}:
            raise ArgumentError(name, "seed and policy only", "an unknown field")
    policy = built_in(_single(values, "policy"), "policy")
    seed = _single(values, "seed")
    is_integer = seed.isdecimal() and len(seed) <= 20
    document = run_document(policy.name, policy.record(as_seed(int(seed) if is_integer else seed), scenario))
    return json.dumps(document, allow_nan=False).encode()


def _single(values: dict[str, list[str]], field: str) -> str:
    given = values.get(field, [])
    if len(given) != 1:
        raise ArgumentError(field, "one value", f"{len(given)}")
    return given[0]


def _is_policy(name: str) -> bool:
    try:
        built_in(name)
    except ArgumentError:
        return False
    return True


class _Handler(BaseHTTPRequestHandler):
    """Answers ``/`` with the page and ``/run?seed=K&policy=NAME`` with a run.

    A bad query gets status 400 with the field and a message; a run for which there is no room, 503. A request
    whose ``Host`` is not an address of the server gets 403: a browser sends such a request for a page of
    another site that has pointed its own name at this machine (DNS rebinding).
    """

    server: _Server

    def do_GET(self) -> None:
        """Answer a request."""
        (path, _, query), hosts = self.path.partition("?"), self.headers.get_all("Host", [])
        if len(hosts) != 1 or hosts[0] not in self.server.hosts:
            only = f"This server answers requests for {self.server.address} only."
            self.send_error(HTTPStatus.FORBIDDEN, explain=only)
        elif path == "/":
            self._send(HTTPStatus.OK, "text/html; charset=utf-8", self.server.page)
        elif path == "/run":
            self._send_run(query)
        else:
            self.send_error(HTTPStatus.NOT_FOUND if path.startswith("/") else HTTPStatus.BAD_REQUEST)

    def _send_run(self, query: str) -> None:
        try:
            status, body = HTTPStatus.OK, self.server.run(query)
        except InputError as error:
            refusal = {"field": error.field, "message": str(error)}
            status, body = HTTPStatus.BAD_REQUEST, json.dumps(refusal).encode()
        except Full:
            refusal = {"message": f"{MAX_WAITING} runs are waiting already; try again in a moment."}
            status, body = HTTPStatus.SERVICE_UNAVAILABLE, json.dumps(refusal).encode()
        self._send(status, "application/json", body)

    def _send(self, status: HTTPStatus, content_type: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", content_type)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002, the name in http.server
        """Log nothing: one drag of the slider makes a hundred requests."""

    def handle(self) -> None:
        """Answer, and ignore that a visitor has closed the connection."""
        with suppress(ConnectionError):
            super().handle()
