"""Results show themselves in notebooks, and the committed notebooks have their outputs."""

import html
import json
import re
from base64 import b64decode
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest

import flockesc_env as fe
from flockesc_env.notebook import Replay
from flockesc_env.watch.page import render, replay

FLOCK = fe.FlockScenario(num_agents=20, num_steps=12)
RUN = fe.simulate(FLOCK, 10.0, seed=1)
SWEPT = fe.sweep(FLOCK, [0.0, 10.0, 50.0], range(4))
LINE = fe.simulate_line(fe.LineScenario(num_agents=10), 0.1, seed=1)


@pytest.mark.parametrize("shown", [LINE, SWEPT], ids=["path", "curve"])
def test_curves_and_paths_are_pictures(shown: Any) -> None:
    (data,) = re.findall(
        r'^<img alt="figure" src="data:image/svg\+xml;base64,([^"]+)">$', shown._repr_html_()
    )
    assert ET.fromstring(b64decode(data)).tag.endswith("svg")  # noqa: S314, our own text


def test_without_matplotlib_a_sweep_is_a_table_and_a_line_its_repr(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("flockesc_env.common.extras.find_spec", lambda _: None)
    shown = SWEPT._repr_html_() or ""
    assert [f"<td>{value:.3f}</td>" in shown for value in SWEPT.values().mean(axis=1)] == [True] * 3
    assert LINE._repr_html_() is None


NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples").glob("*.ipynb"))
MAX_BYTES = 300_000


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_committed_outputs_are_complete_and_small(path: Path) -> None:
    assert path.stat().st_size < MAX_BYTES
    cells = [cell for cell in json.loads(path.read_text("utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert {output["output_type"] for output in outputs} == {"stream", "execute_result"}
    assert not any(output.get("name") == "stderr" for output in outputs)
    shown = ["".join(output.get("data", {}).get("text/html", "")) for output in outputs]
    assert any(text.startswith("<iframe") for text in shown)


def test_runs_replay_side_by_side() -> None:
    other = fe.simulate(FLOCK, policy="stubborn-leaders", seed=1)
    shown = Replay([("10 m", RUN), ("rule", other)], height=500)
    assert repr(shown) == "Replay(10 m, rule)"
    assert "height: 500px" in shown._repr_html_()
    for text, runs in ((shown._repr_html_(), shown.runs), (RUN._repr_html_(), [("fixed:10", RUN)])):
        page, inside = re.findall(r'^<iframe srcdoc="([^"]*)"[^>]*>(.*)</iframe>$', text)[0]
        assert html.unescape(page) == render(runs, replay(runs), with_engine=False)
        # Viewers that strip frames show what is inside.
        (image,) = re.findall(r'^<img alt="flocks" src="data:image/png;base64,([^"]+)">$', inside)
        assert b64decode(image).startswith(b"\x89PNG")
