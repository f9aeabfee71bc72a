"""Figures: numbers of the headline, series that can be told apart, labels that hide nothing."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path
from unittest import mock

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from study_folders import write_study

from flockesc_env.tasks.statistics import profile
from speed import plots
from speed.measure import Record
from studies.findings import figures
from studies.findings.results import BEST_FIXED, load_studies
from studies.findings.story import story
from studies.findings.summary import summarize

RESULTS = Path(__file__).parents[2] / "results"


def test_the_story_shows_the_gain_of_each_setting(tmp_path: Path) -> None:
    fixed = 70.0 + np.arange(8.0)
    for end, gain in {"": 22.3, "-derived": 25.0, "-profile": 28.4}.items():
        write_study(tmp_path, f"per-agent-visible{end}", {BEST_FIXED: fixed}, {"search": fixed[None] + gain})
    figure = story(summarize(load_studies(tmp_path)))
    assert figure is not None
    (axes,), (legend,) = figure.axes, figure.legends
    assert axes.get_yticklabels()[0].get_text().startswith("per-agent-visible:\n")
    labels = [text.get_text() for text in legend.get_texts()]
    shown = {text.get_text(): to_hex(text.get_color()) for text in axes.texts}
    for gain, label in {
        "network +22.3": "plain observation",
        "network +25.0": "with the escape direction",
        "network +28.4": "with a profile",
    }.items():
        assert shown[gain] == to_hex(legend.get_patches()[labels.index(label)].get_facecolor())


def test_no_two_performance_profiles_have_the_same_color() -> None:
    studies = figures.shown_studies(load_studies(RESULTS / "findings"))
    profiles = {
        study.setting: {
            name: profile(study.values(name)[:, :50], figures.thresholds(study))
            for name in figures.profiled(study)
        }
        for study in studies
    }
    for axes in figures.performance_profiles(studies, profiles).axes:
        colors = [to_hex(line.get_color()) for line in axes.lines]
        assert len(set(colors)) == len(colors) > 3


def test_labels_of_the_benchmarks_hide_nothing(tmp_path: Path) -> None:
    document = json.loads((RESULTS.parent / "speed/results/benchmarks.json").read_text("utf-8"))
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
