"""Add a user's policy to the results of a setting, on the same held-out flocks."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import polars as pl

from flockesc_env import ArgumentError
from flockesc_env.common.array_files import write_table
from flockesc_env.policies import NAMES
from studies.learned.fitting import check_fits, is_checkable
from studies.learned.page import LEARNED
from studies.learned.results import BEST_FIXED, EPISODES_FILE, ORACLE, load_studies
from studies.learned.summary import summarize
from studies.tables import rows
from training.evaluation import play
from training.policies import named_policy
from training.presets import presets
from training.seeds import HELD_OUT, first_seeds

UNCHECKED = " (unchecked)"
"""End of the name of a policy whose code decides what it sees; see ``is_checkable``."""


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

    The policy may not see more than the setting shows: ``check_fits`` says what that is. It plays in the
    setting's scenario and with the setting's objective. A policy of another class than those of the package
    gets a name that ends with ``UNCHECKED``, because its code can see more than its options say. Return a
    sentence with the policy's objective and its difference to the best fixed range.
    """
    known = presets()
    studies = {study.setting: study for study in load_studies(results) if study.setting in known}
    if setting not in studies:
        raise ArgumentError("setting", f"one of {', '.join(studies)}", repr(setting))
    study = studies[setting]
    task, entry = known[setting].setting, named_policy(policy)
    check_fits(entry, task)
    if not is_checkable(entry.policy):
        name = name.removesuffix(UNCHECKED) + UNCHECKED
    given = {BEST_FIXED, ORACLE, *study.learners, *NAMES}
    if name in given or (name in study.policies and not replace):
        raise ArgumentError("name", f"another name than {', '.join(study.policies)}", repr(name))
    if not re.fullmatch(r"\w[\w .,:=+()-]*", name):  # it gets into Markdown
        raise ArgumentError("name", "letters, digits, spaces and . , : = + ( ) -", repr(name))
    flocks = first_seeds(HELD_OUT, study.held_out_flocks)
    if study.flocks != list(flocks):
        raise ArgumentError("results", f"flocks {flocks.start} to {flocks.stop - 1}", "others")
    options = entry.options if task.is_line else {"objective": task.objective, **entry.options}
    entry = dataclasses.replace(entry, name=name, options=options)

    added = rows(flocks, play(entry, task, flocks), policy=name, training_seed=None)
    others = study.episodes.filter(pl.col("policy") != name)
    episodes = pl.concat([others, added.select(others.columns)])
    if not dry_run:
        write_table(episodes, study.folder / EPISODES_FILE)
        LEARNED.write(results, page)
    (row,) = summarize([dataclasses.replace(study, episodes=episodes)])
    reached = row.show(row.policies[name].objective) + study.unit
    return f"{setting}: {name} {reached}, {row.difference(name)}{study.unit} to the best fixed range"
