"""HTTP server of the watch page, for this machine only. It simulates the flocks that the page asks for."""

from __future__ import annotations

import json
import webbrowser
from collections.abc import Sequence
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any
from urllib.parse import parse_qsl

from flockesc_env.common.checks import as_count, as_flag, as_instance, as_seed
from flockesc_env.common.errors import ArgumentError, InputError
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.policies.registry import NAMES, built_in
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.watch.document import Run, check_runs, run_document
from flockesc_env.watch.page import render

_LOOPBACK = "127.0.0.1"
_POLL = 0.05  # s between two checks for Ctrl-C


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
    try:
        server = Server(port, page, scenario)
    except OSError as error:
        raise ArgumentError("port", "a free TCP port", f"{port} ({error.strerror})") from error
    with server:
        try:
            print(f"Watching at {server.address} (Ctrl-C stops)", flush=True)
            if open_browser:
                webbrowser.open(server.address)
            server.serve_forever(_POLL)
        except KeyboardInterrupt:
            print("Stopped.", flush=True)


class Server(HTTPServer):
    """Answers one request after another, in the thread where Ctrl-C arrives.

    Attributes:
        address: the URL of the page.
        page: the page, encoded.
        scenario: the scenario of every flock that is simulated.
    """

    def __init__(self, port: int, page: bytes, scenario: FlockScenario) -> None:
        super().__init__((_LOOPBACK, port), _Handler)
        self.address = f"http://{_LOOPBACK}:{self.server_port}/"
        self.page = page
        self.scenario = scenario


def run_for(query: str, scenario: FlockScenario) -> bytes:
    """Simulate the flock of ``seed=K&policy=NAME`` and return its document as JSON.

    Raises:
        InputError: if a field is missing or bad; it names the field.
    """
    values = dict(parse_qsl(query))
    policy = built_in(values.get("policy", ""), "policy")
    seed = values.get("seed", "")
    is_integer = seed.isdecimal() and len(seed) <= 20
    document = run_document(policy.name, policy.record(as_seed(int(seed) if is_integer else seed), scenario))
    return json.dumps(document, allow_nan=False).encode()


def _is_policy(name: str) -> bool:
    try:
        built_in(name)
    except ArgumentError:
        return False
    return True


class _Handler(BaseHTTPRequestHandler):
    """Answers ``/`` with the page, and ``/run?seed=K&policy=NAME`` with a run or, if it is bad, an error."""

    server: Server
    timeout = 0.5  # s; a browser keeps idle connections open, which would hold up the next request

    def do_GET(self) -> None:
        """Answer a request."""
        path, _, query = self.path.partition("?")
        if path == "/":
            self._send(HTTPStatus.OK, "text/html; charset=utf-8", self.server.page)
        elif path == "/run":
            try:
                self._send(HTTPStatus.OK, "application/json", run_for(query, self.server.scenario))
            except InputError as error:
                refusal = json.dumps({"field": error.field, "message": str(error)}).encode()
                self._send(HTTPStatus.BAD_REQUEST, "application/json", refusal)
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

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
