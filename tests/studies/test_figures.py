"""Labels of the benchmarks' figures hide nothing."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path
from unittest import mock

from matplotlib.figure import Figure

from speed import plots
from speed.measure import Record

RESULTS = Path(__file__).parents[2] / "speed/results/benchmarks.json"


def test_labels_of_the_benchmarks_hide_nothing(tmp_path: Path) -> None:
    document = json.loads(RESULTS.read_text("utf-8"))
    drawn: list[Figure] = []
    with mock.patch.object(plots, "save_figure", side_effect=lambda figure, *_: drawn.append(figure)):
        plots.draw([Record.from_document(entry) for entry in document["records"]], tmp_path)
    assert len(drawn) == 2
    for figure in drawn:
        figure.draw_without_rendering()
        (axes,) = figure.axes
        boxes = [text.get_window_extent() for text in [*axes.texts, axes._left_title]]
        assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
        for line in axes.lines:
            path = line.get_transform().transform_path(line.get_path())
            assert not any(path.intersects_bbox(box, filled=False) for box in boxes)
