"""Generates one page per environment, with its spaces from the code, and copies notebooks and reports."""

import inspect
import math
import os
import re
import shutil
from functools import partial
from pathlib import Path
from typing import Any, get_args

import gymnasium
import jinja2
from gymnasium.envs.registration import load_env_creator
from matplotlib.image import imsave
from sphinx.application import Sphinx

import flockesc_env as fe
from flockesc_env.envs.pettingzoo import FlockParallelEnv
from flockesc_env.scenario.options import ActionMode, ExtraEntries, TeamReward

ROOT = Path(__file__).parents[1]
MODEL = (ROOT / "docs" / "model.md").read_text("utf-8")
REPORTS = {path.parent: path.parent.name for path in ROOT.glob("results/*/README.md")}
REPORTS[ROOT / "speed" / "results"] = "speed"
"""Names of the generated pages by the folders of the reports."""

VIEWS = ("Flock view", "Agent view", "Predator view", "Line view")
"""Headings in model.md whose tables say what the entries of observations mean."""

REWARD_HEADS = ["reward", "for", "reward of step t", "sum over an episode"]

PICTURE = {"render_mode": "rgb_array", "render_size": 640}
PICTURE_STEPS = 50


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the pages before Sphinx looks for sources."""
    app.connect("builder-inited", lambda app: write(Path(app.srcdir)))
    return {"parallel_read_safe": True}


def write(docs: Path) -> None:
    """Write the generated pages and pictures to the folder ``generated``."""
    shutil.rmtree(docs / "generated", ignore_errors=True)
    notebooks, folder = docs / "generated" / "notebooks", docs / "generated" / "environments"
    notebooks.mkdir(parents=True)
    folder.mkdir()
    for notebook in (ROOT / "examples").glob("*.ipynb"):
        shutil.copy(notebook, notebooks)
    reports = docs / "generated" / "reports"
    reports.mkdir()
    for source, name in REPORTS.items():
        text = (source / "README.md").read_text("utf-8")
        (reports / f"{name}.md").write_text(
            f"---\norphan: true\n---\n\n{_moved(text, source, reports)}", "utf-8"
        )
    loader = jinja2.FileSystemLoader(docs / "_templates")
    template = jinja2.Environment(loader=loader, trim_blocks=True)  # noqa: S701, writes Markdown
    specs = [gymnasium.spec(name) for name in sorted(gymnasium.registry) if name.startswith("flockesc/")]
    pages = [_registered(spec.id) for spec in specs if "task" not in spec.kwargs]
    pages.append(_page("parallel_env", "parallel_env()", fe.parallel_env, FlockParallelEnv))
    for page in pages:
        text = template.get_template("environment.md").render(page)
        (folder / f"{page['stem']}.md").write_text(text, "utf-8")
        imsave(folder / f"{page['stem']}.png", _picture(page["view"]))


def _moved(text: str, source: Path, target: Path) -> str:
    """Return a report with links for another folder; links between reports are links between pages."""

    def link(match: re.Match[str]) -> str:
        file = (source / match[1]).resolve()
        is_report = file.name == "README.md" and file.parent in REPORTS
        return f"]({REPORTS[file.parent]}.md" if is_report else f"]({os.path.relpath(file, target.resolve())}"

    return re.sub(r"\]\((?!https?:|#)([^)#\s]+)", link, text)


def _registered(name: str) -> dict[str, Any]:
    """Return what the page of a registered environment shows."""
    spec = gymnasium.spec(name)
    is_single = name != "flockesc/FlockAgents-v1"
    if not is_single:
        count = fe.FlockScenario().num_agents
        call = f'gymnasium.make_vec("flockesc_env:{name}", num_envs={count})'
        entry_point, make = spec.vector_entry_point, partial(gymnasium.make_vec, name, count)
    else:
        call = f'gymnasium.make("flockesc_env:{name}")'
        entry_point, make = spec.entry_point, lambda **options: gymnasium.make(name, **options).unwrapped
    page = _page(name, call, make, load_env_creator(entry_point))
    return {**page, "is_vectorized": is_single and spec.vector_entry_point is not None}


def _page(name: str, call: str, make: Any, kind: type) -> dict[str, Any]:
    """Return what the page of an environment shows, by the names in the template.

    Args:
        name: the id, or the name of the function that makes it.
        call: Python expression that makes the environment.
        make: function that makes it, with options as keyword arguments.
        kind: class of the environment.
    """
    env = make()
    entries = _entries(env)
    view = next(view for view in VIEWS if entries.keys() <= _meanings(view).keys())
    is_line = view == "Line view"
    return {
        "name": name,
        "stem": name.removeprefix("flockesc/"),
        "version": name.rpartition("-")[2] if "-" in name else env.metadata["name"],
        "call": call,
        "kind": f"{'flockesc_env' if hasattr(fe, kind.__name__) else kind.__module__}.{kind.__name__}",
        "description": _description(kind),
        "view": view,
        "anchor": view.lower().replace(" ", "-"),
        "observation": len(env.policy_spec.layout.names),
        "entries": _rows(entries, view),
        "optional": _rows(_optional_entries(make, entries, view), view),
        "actions": _actions(make, env, view),
        "num_steps": env.scenario.max_steps if is_line else env.scenario.num_steps,
        "rewards": [
            row
            for row in _tables("Rewards")[1 if is_line else 0]
            if view != "Flock view" or row[0].split("`")[1] in get_args(TeamReward)
        ],
        "reward_heads": REWARD_HEADS[:: 2 if is_line else 1],
        "is_vectorized": False,
    }


def _description(kind: type) -> str:
    """Return the docstring of a class up to its arguments, with a link to the model."""
    text = (inspect.getdoc(kind) or "").split("\nArgs:")[0].strip()
    return text.replace("docs/model.md", "[The model](../../model.md)")


def _entries(env: Any) -> dict[str, str]:
    """Return the bounds of every entry of an observation; entries with a running index are one."""
    layout = env.policy_spec.layout
    bounds: dict[str, str] = {}
    for name, low, high in zip(layout.names, layout.low.tolist(), layout.high.tolist(), strict=True):
        bounds.setdefault(re.sub(r"^offset_\d+$", "offset_0", name), f"[{low:g}, {high:g}]")
    return bounds


def _optional_entries(make: Any, entries: dict[str, str], view: str) -> dict[str, str]:
    """Return the entries that the options add."""
    options: dict[str, Any] = {} if view == "Line view" else {"extra_entries": get_args(ExtraEntries)}
    if view == "Agent view":
        options["profile_ranges"] = (0.0,)
    return {name: bounds for name, bounds in _entries(make(**options)).items() if name not in entries}


def _rows(entries: dict[str, str], view: str) -> list[tuple[str, str, str]]:
    return [(name, bounds, _meanings(view)[name]) for name, bounds in entries.items()]


def _actions(make: Any, env: Any, view: str) -> list[tuple[str, str]]:
    """Return each ``action_mode`` with its action space."""
    if view == "Predator view":
        return [("", str(env.action_space))]
    return [(mode, str(make(action_mode=mode).policy_spec.actions.space())) for mode in get_args(ActionMode)]


def _meanings(view: str) -> dict[str, str]:
    """Return what each entry of a view means, from model.md."""
    word = view.split()[0].lower()
    tables = _tables(view)
    if word in {"agent", "flock"}:
        tables.append(_tables("Extra entries")[word == "flock"])
    if word == "agent":
        tables += _tables("Profile")
    return {row[0].strip("`"): row[2] for table in tables for row in table}


def _tables(heading: str) -> list[list[list[str]]]:
    """Return the tables below a heading of model.md, as rows of cells without their head."""
    section = re.split(rf"^#+ {heading}$", MODEL, flags=re.MULTILINE)[1]
    section = re.split(r"^#+ ", section, maxsplit=1, flags=re.MULTILINE)[0]
    return [
        [
            [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1]]
            for line in table.strip().splitlines()[2:]
        ]
        for table in re.findall(r"(?:^\|.*\n)+", section, flags=re.MULTILINE)
    ]


def _picture(view: str) -> Any:
    """Return an image of the environment with this view, in the middle of an episode."""
    env: Any
    if view == "Line view":
        env, policy = fe.LineEscapeEnv(**PICTURE), fe.FixedRange(0.05)
    elif view == "Predator view":
        env, policy = fe.PredatorEnv(**PICTURE), fe.policies.Pursue("centroid")
    elif view == "Agent view":
        env, policy = fe.parallel_env(predator_sensing_range=math.inf, **PICTURE), fe.StubbornLeaders()
    else:
        env, policy = fe.FlockEscapeEnv(**PICTURE), fe.FixedRange(12.0)
    act = fe.policies.bind(policy, env)
    observation, _ = env.reset(seed=7)
    for _ in range(PICTURE_STEPS):
        observation, _, terminated, truncated, _ = env.step(act(observation))
        if view == "Line view" and (terminated or truncated):
            break
    return env.render()
