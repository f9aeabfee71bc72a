"""Python and the core have the same fields in all documents and parts (kinds: ``test_kinds``).

The core refuses an unknown name with a list of all names that it knows. The test compares that list with the
fields that Python writes.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Any

import pytest
from argument_table import PARTS, SLOTS
from option_table import small_flock

import flockesc_env as fe
from flockesc_env.common.errors import FlockescError
from flockesc_env.episodes.options import View

UNKNOWN = "no_such_name"


def known_to(check: Callable[[str], Any], document: Any) -> set[str]:
    """Return the names that the error about an unknown name lists."""
    with pytest.raises(FlockescError, match=UNKNOWN) as caught:
        check(json.dumps(document))
    return set(re.findall(r"`(\w+)`", caught.value.expected))


def check_options(document: str) -> None:
    actions = fe.FlockEscapeEnv(small_flock()).policy_spec.actions.core
    fe._core.FlockBatch([small_flock().to_json()], [0], document, actions, 1, False, 0)


def check_line_options(document: str) -> None:
    fe._core.LineEpisode(fe.LineScenario().to_json(), document, 0)


DOCUMENTS: dict[str, tuple[Callable[[str], Any], str]] = {
    "flock": (fe._core.check_flock_scenario, fe.FlockScenario().to_json()),
    "line": (fe._core.check_line_scenario, fe.LineScenario().to_json()),
    "options": (check_options, fe.EnvOptions().to_core(View.FLOCK)),
    "options of lines": (check_line_options, fe.LineOptions().to_core()),
}
documents = pytest.mark.parametrize(("check", "text"), DOCUMENTS.values(), ids=DOCUMENTS)


@documents
def test_fields(check: Callable[[str], Any], text: str) -> None:
    document = json.loads(text)
    check(text)
    assert known_to(check, document | {UNKNOWN: 1}) == set(document)


@pytest.mark.parametrize(("slot", "part"), PARTS)
def test_fields_of_parts(slot: str, part: Any) -> None:
    place, _ = SLOTS[slot]
    document = json.loads(small_flock(**{slot: place(part)}).to_json())
    written = document[slot]
    ((kind, fields),) = (written[-1] if isinstance(written, list) else written).items()
    assert kind == part.kind
    known = set(fields)
    fields[UNKNOWN] = 1
    assert known_to(fe._core.check_flock_scenario, document) == known
