"""The tasks of BenchMARL are the settings of the page of results. compat/test_benchmarl.py makes them."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

from studies.learned.questions import QUESTIONS
from training.presets import presets

TASKS = Path(__file__).parents[2] / "flockesc_env" / "benchmarl"


def test_the_tasks_have_the_options_of_the_settings_with_one_range_per_agent() -> None:
    found = {}
    for file in TASKS.glob("*.yaml"):
        task = yaml.safe_load(file.read_text())
        assert task.pop("reward") == "individual_running_minimum"
        found[file.stem] = {"objective": "mean", **task}
    settings = {name: presets()[name].setting for name in QUESTIONS}
    expected = {
        name.replace("-", "_"): {"scenario": setting.scenario, **setting.env_options()}
        for name, setting in settings.items()
        if setting.per_agent and not setting.is_line
    }
    as_lists = {
        name: {key: list(value) if isinstance(value, tuple) else value for key, value in options.items()}
        for name, options in expected.items()
    }
    assert found == as_lists
    members = re.findall(r"^    ([A-Z_]+) = None$", (TASKS / "__init__.py").read_text(), re.MULTILINE)
    assert {member.lower() for member in members} == found.keys()
