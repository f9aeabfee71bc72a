"""The command ``flockesc presets``: list the preset scenarios or print one as TOML."""

from __future__ import annotations

import json as json_
from typing import Annotated, Any

from tyro.conf import Positional

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Json, model_of, optional
from flockesc_env.cli.output import show, show_json
from flockesc_env.scenario.presets import PRESETS, preset


def run(
    name: Annotated[
        Positional[str | None], *optional("preset to print as TOML", "list all", "[NAME]")
    ] = None,
    *,
    json: Json = False,
) -> Exit:
    """List the preset scenarios, or print one as a scenario file.

    The flag --scenario of other commands takes the name of a preset or such a file.

    Example: flockesc presets pursuit > mine.toml
    """
    if name is not None:
        preset(name)  # raises for an unknown name
    chosen = PRESETS if name is None else {name: PRESETS[name]}
    if json:
        show_json({"command": "presets", "presets": [_entry(known) for known in chosen]})
    elif name is None:
        width = max(map(len, PRESETS))
        show(*(f"{known:<{width}}  {PRESETS[known].description}" for known in PRESETS))
    else:
        entry = _entry(name)
        show(f"# {entry['description']}", *preset(name).to_toml().rstrip().split("\n"))
    return Exit.DONE


def _entry(name: str) -> dict[str, Any]:
    description, scenario = PRESETS[name]
    return {
        "name": name,
        "model": model_of(scenario),
        "description": description,
        "scenario": json_.loads(scenario.to_json()),
    }
