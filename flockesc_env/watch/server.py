"""The page from a server on this machine, which runs flocks anew as its visitor asks."""

from __future__ import annotations

import json
import webbrowser
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any
from urllib.parse import parse_qs, urlsplit

from flockesc_env.common.checks import as_count, as_flag, as_instance, as_seed
from flockesc_env.common.errors import ArgumentError, FlockescError, InputError
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.policies.registry import NAMES, built_in
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.watch.document import Run, check_runs, run_document
from flockesc_env.watch.page import render

_HOST = "127.0.0.1"
_POLL = 0.05  # s between looks for a request to stop, or for Ctrl-C
_Job = tuple[Callable[[], bytes], "Future[bytes]"]


def serve(
    runs: Sequence[Run], *, scenario: FlockScenario, seed: int, port: int = 0, open_browser: bool = True
) -> None:
    """Serve a page to this machine alone until Ctrl-C; its controls run flocks of the scenario anew.

    Args:
        runs: names and trajectories that are shown first. A name of a built-in policy is offered as that
            policy, any other as a recording.
        scenario: of every flock that is run anew.
        seed: the flock that the controls start with.
        port: TCP port; 0: any that is free. The address is printed.
        open_browser: whether to open the page.

    Raises:
        ArgumentError: for runs that cannot be shown side by side, or a bad seed or port.
        OSError: if the port is taken.
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
    with _Server((_HOST, port), page, scenario) as server:
        address = f"http://{_HOST}:{server.server_port}/"
        try:
            print(f"Watching at {address} (Ctrl-C stops)", flush=True)
            if open_browser:
                webbrowser.open(address)
            server.work()
        except KeyboardInterrupt:
            print("Stopped.", flush=True)


class _Server(ThreadingHTTPServer):
    """Answers in threads; flocks run in the thread that called ``work``, where Ctrl-C stops them at once."""

    daemon_threads = True

    def __init__(self, address: tuple[str, int], page: bytes, scenario: FlockScenario) -> None:
        super().__init__(address, _Handler)
        self.page = page
        self.scenario = scenario
        self._jobs: SimpleQueue[_Job] = SimpleQueue()

    def work(self) -> None:
        """Listen, and run flocks as they are asked for, until interrupted."""
        Thread(target=self.serve_forever, args=(_POLL,), daemon=True).start()
        try:
            while True:
                try:
                    # A wait without end never sees a Ctrl-C that came right before it.
                    call, future = self._jobs.get(timeout=_POLL)
                except Empty:
                    continue
                try:
                    future.set_result(call())
                except FlockescError as error:
                    future.set_exception(error)
        finally:
            self.shutdown()

    def run(self, query: str) -> bytes:
        """Return the run that a query asks for, as JSON.

        Raises:
            InputError: naming the field of a bad query.
        """
        future: Future[bytes] = Future()
        self._jobs.put((lambda: run_for(query, self.scenario), future))
        return future.result()


def run_for(query: str, scenario: FlockScenario) -> bytes:
    """Run the flock of ``seed=K&policy=NAME`` and return its document as JSON.

    Raises:
        InputError: naming the field that is missing, unknown or bad.
    """
    values = parse_qs(query, keep_blank_values=True)
    for name in values:
        if name not in {"seed", "policy"}:
            raise ArgumentError(name, "seed and policy only", "an unknown field")
    contender = built_in(_single(values, "policy"), "policy")
    seed = _integer(_single(values, "seed"))
    document = run_document(contender.name, contender.record(as_seed(seed), scenario))
    return json.dumps(document, allow_nan=False).encode()


def _single(values: dict[str, list[str]], field: str) -> str:
    given = values.get(field, [])
    if len(given) != 1:
        raise ArgumentError(field, "one value", f"{len(given)}")
    return given[0]


def _integer(text: str) -> int | str:
    """Return the number, or the text where it is none."""
    try:
        return int(text)
    except ValueError:
        return text


def _is_policy(name: str) -> bool:
    try:
        built_in(name)
    except ArgumentError:
        return False
    return True


class _Handler(BaseHTTPRequestHandler):
    """``/``: the page. ``/run?seed=K&policy=NAME``: a run, or status 400 with the field and what is wrong."""

    server: _Server

    def do_GET(self) -> None:
        """Answer a request."""
        url = urlsplit(self.path)
        if url.path == "/":
            self._send(HTTPStatus.OK, "text/html; charset=utf-8", self.server.page)
        elif url.path == "/run":
            try:
                self._send(HTTPStatus.OK, "application/json", self.server.run(url.query))
            except InputError as error:
                refusal = {"field": error.field, "message": str(error)}
                self._send(HTTPStatus.BAD_REQUEST, "application/json", json.dumps(refusal).encode())
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _send(self, status: HTTPStatus, content_type: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", content_type)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-PolicySpec", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002, the name in http.server
        """Log nothing: a drag of the slider is a hundred requests."""

    def handle(self) -> None:
        """Answer; a visitor who leaves early is no error."""
        with suppress(ConnectionError):
            super().handle()
