"""Add a user's policy to the results of a setting, on the same held-out flocks."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import polars as pl

from flockesc_env import ArgumentError, EnvOptions, FlockScenario, LineOptions, NamedPolicy
from flockesc_env.common.array_files import write_table
from flockesc_env.policies import NAMES
from studies.learned.page import write_page
from studies.learned.results import BEST_FIXED, EPISODES_FILE, ORACLE, load_studies
from studies.learned.summary import summarize
from training.config import Setting
from training.evaluation import play
from training.policies import named_policy
from training.presets import presets
from training.seeds import HELD_OUT, first_seeds


def submit(
    setting: str,
    policy: str,
    name: str,
    results: Path,
    page: Path,
    *,
    replace: bool = False,
    dry_run: bool = False,
) -> str:
    """Run a policy on the held-out flocks of a setting, add it to the results and write the page.

    The policy may not see more than the setting shows; its ranges and the length of an action are free.

    Args:
        setting: name of the preset.
        policy: a built-in policy, a policy's file, the folder
            of a run, or ``module:function``.
        name: name in tables and figures.
        results: folder of the results.
        page: the page's file.
        replace: whether to replace an earlier submission of this name.
        dry_run: whether to write nothing.

    Returns:
        A sentence with the policy's objective and its difference to the best fixed range.

    Raises:
        ArgumentError: if the policy does not fit the setting, or the name is taken; it names the field.
        RecordError: if the results are incomplete.
    """
    known = presets()
    studies = {study.setting: study for study in load_studies(results) if study.setting in known}
    if setting not in studies:
        raise ArgumentError("setting", f"one of {', '.join(studies)}", repr(setting))
    study = studies[setting]
    given = {BEST_FIXED, ORACLE, *study.learners, *NAMES}
    if name in given or (name in study.policies and not replace):
        raise ArgumentError("name", f"another name than {', '.join(study.policies)}", repr(name))
    if not re.fullmatch(r"\w[\w .,:=+()-]*", name):  # it gets into Markdown
        raise ArgumentError("name", "letters, digits, spaces and . , : = + ( ) -", repr(name))
    flocks = first_seeds(HELD_OUT, study.held_out_flocks)
    if study.flocks != list(flocks):
        raise ArgumentError("results", f"flocks {flocks.start} to {flocks.stop - 1}", "others")
    entry = dataclasses.replace(named_policy(policy), name=name)
    check_fits(entry, known[setting].setting)

    rows = pl.DataFrame(
        {
            "policy": name,
            "training_seed": pl.Series([None] * len(flocks), dtype=pl.Int64),
            "seed": flocks,
            "objective": play(entry, known[setting].setting, flocks),
        },
        schema_overrides=dict(study.episodes.schema),
    )
    others = study.episodes.filter(pl.col("policy") != name)
    episodes = pl.concat([others, rows.select(others.columns)])
    if not dry_run:
        write_table(episodes, results / setting / EPISODES_FILE)
        write_page(results, page)
    (row,) = summarize([dataclasses.replace(study, episodes=episodes)])
    reached = row.show(row.policies[name].objective) + study.unit
    return f"{setting}: {name} {reached}, {row.difference(name)}{study.unit} to the best fixed range"


def check_fits(entry: NamedPolicy, setting: Setting) -> None:
    """Refuse a policy for another problem, or one that sees more than the setting shows.

    Raises:
        ArgumentError: if the policy does not fit; it names the field.
    """
    model, options = setting.model, LineOptions if setting.is_line else EnvOptions
    if entry.scenario is not None and type(entry.scenario) is not type(model):
        raise ArgumentError("scenario", f"a {type(model).__name__}", type(entry.scenario).__name__)
    per_agent = setting.per_agent and not setting.is_line
    if entry.per_agent is not per_agent:
        raise ArgumentError("per_agent", f"{per_agent}, as in the setting", entry.per_agent)
    names = [field.name for field in dataclasses.fields(options)]
    unknown = sorted(set(entry.options) - set(names))
    if unknown:
        raise ArgumentError("options", f"some of {', '.join(names)}", ", ".join(unknown))
    chosen = options(**entry.options)
    if isinstance(model, FlockScenario) and isinstance(chosen, EnvOptions) and not setting.predator_visible:
        sensing, most = chosen.predator_sensing_range, model.predator_range
        if sensing is None or (sensing != "predator_range" and float(sensing) > most):
            expected = f"at most the setting's, 'predator_range' or {most:g} m"
            raise ArgumentError("predator_sensing_range", expected, sensing)
