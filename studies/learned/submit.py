"""Add one's own policy to the results of a setting: the same world, the same held-out flocks."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import polars as pl
from training.contenders import contender

from flockesc_env import FlockScenario
from flockesc_env.common.errors import ArgumentError
from flockesc_env.common.files import atomic_write
from flockesc_env.episodes.options import EnvOptions, LineOptions
from flockesc_env.policies.registry import NamedPolicy
from studies.learned.page import write_page
from studies.learned.results import EPISODES_FILE, load_studies
from training.config import Setting, presets
from training.evaluation import play
from training.seeds import HELD_OUT, first_seeds


def submit(setting: str, policy: str, name: str, results: Path, page: Path) -> None:
    """Run a policy on the held-out flocks of a setting, add it to the results and write the page anew.

    What the policy sees may not exceed what the setting shows; its ranges and how long an action holds are
    its own choice.

    Args:
        setting: name of the preset.
        policy: what ``training.contenders.contender`` knows: a built-in policy, a policy's file, the folder
            of a run, or ``module:function``.
        name: how tables and figures are to call it.
        results: folder of the results.
        page: the page's file.

    Raises:
        ArgumentError: naming what does not fit the setting, or a name that is taken.
        RecordError: if the results are not whole.
    """
    known = presets()
    studies = {study.setting: study for study in load_studies(results) if study.setting in known}
    if setting not in studies:
        raise ArgumentError("setting", f"one of {', '.join(studies)}", repr(setting))
    study = studies[setting]
    if name in study.contenders:
        raise ArgumentError("name", f"another name than {', '.join(study.contenders)}", repr(name))
    if not re.fullmatch(r"\w[\w .,:=+()-]*", name):  # it gets into Markdown
        raise ArgumentError("name", "letters, digits, spaces and . , : = + ( ) -", repr(name))
    flocks = first_seeds(HELD_OUT, study.held_out_flocks)
    if study.flocks != list(flocks):
        raise ArgumentError("results", f"flocks {flocks.start} to {flocks.stop - 1}", "others")
    entry = dataclasses.replace(contender(policy), name=name)
    check_fits(entry, known[setting].setting)

    rows = pl.DataFrame(
        {
            "contender": name,
            "training_seed": pl.Series([None] * len(flocks), dtype=pl.Int64),
            "flock": flocks,
            "objective": play(entry, known[setting].setting, flocks),
        },
        schema_overrides=dict(study.episodes.schema),
    )
    with atomic_write(results / setting / EPISODES_FILE) as file:
        pl.concat([study.episodes, rows.select(study.episodes.columns)]).write_parquet(file)
    write_page(results, page)


def check_fits(entry: NamedPolicy, setting: Setting) -> None:
    """Refuse a policy that another problem was made for, or that sees more than the setting shows.

    Raises:
        ArgumentError: naming the field that does not fit.
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
