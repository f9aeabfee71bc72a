"""Valid documents and random corruptions of them."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable
from typing import Any

from option_table import embedded

from flockesc_env import PRESETS, FlockScenario, LineScenario

Document = tuple[type[FlockScenario | LineScenario], str, str]
"""The model, the format ("json" or "toml") and the text."""

NUMBERS = (
    *("1e308", "-1e308", "-0", "-0.0", "0", "1e-320", "1e400", "-1", "0.5", "3", "7", "1e9", "100000000"),
    *(
        "9223372036854775807",
        "9223372036854775808",
        "18446744073709551616",
        "1" + 5000 * "0",
        "0x" + 5000 * "f",
    ),
    *(
        "NaN",
        "nan",
        "Infinity",
        "-Infinity",
        "inf",
        "-inf",
        "null",
        "true",
        '"None"',
        '"1"',
        "[]",
        "{}",
        "[1.0]",
    ),
)
TOKENS = (
    *(
        "{",
        "}",
        "[",
        "]",
        ",",
        ":",
        "=",
        '"',
        "'",
        '"""',
        "#",
        "\\",
        "\\u",
        "\n",
        "\t",
        "\0",
        "\ufeff",
        "\ud800",
    ),
    *(
        "null",
        "true",
        "NaN",
        "None",
        "1",
        "e",
        ".",
        "-",
        "[[predators]]",
        "[predators]",
        "1979-05-27T07:32:00Z",
    ),
    *(
        '"mass": 1,',
        "mass = 1\n",
        '"predators": [],',
        "é",
        "\U0001f426",
        "[" * 200,
        '{"a":' * 200,
        "[" * 100_000,
    ),
)
_NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?|true|false|null")
_DIGIT = re.compile(r"\d")
_WORD = re.compile(r"[a-z_]{3,}")


def good_documents() -> list[Document]:
    """Return every preset with all parameters, for D = 2 and 3, as JSON and as TOML."""
    scenarios: list[FlockScenario | LineScenario] = [preset.scenario for preset in PRESETS.values()]
    space = [
        flock.replace(dimension=3, predators=tuple(embedded(predator, 3) for predator in flock.predators))
        for flock in scenarios
        if isinstance(flock, FlockScenario) and _fits_in_space(flock)
    ]
    return [
        (type(scenario), language, text)
        for scenario in scenarios + space
        for language, text in (("json", scenario.to_json()), ("toml", scenario.to_toml()))
    ]


def _fits_in_space(flock: FlockScenario) -> bool:
    return flock.dimension == 2 and flock.neighbor_rule.kind != "voronoi"


def mutated(text: str, rng: random.Random) -> str:
    """Return a text with one to three changes."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        text = rng.choice(CHANGES)(text, rng)
    return text


def _place(text: str, rng: random.Random) -> int:
    return rng.randrange(len(text) + 1)


def flip(text: str, rng: random.Random) -> str:
    """Change a bit of a byte."""
    data = bytearray(text.encode("utf-8", "surrogatepass"))
    if data:
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return data.decode("utf-8", "replace")


def delete(text: str, rng: random.Random) -> str:
    start = _place(text, rng)
    return text[:start] + text[start + rng.choice((1, 2, 5, 40, 400)) :]


def duplicate(text: str, rng: random.Random) -> str:
    start = _place(text, rng)
    stop = start + rng.choice((1, 5, 40, 400))
    return text[:stop] + text[start:stop] * rng.choice((1, 2, 20)) + text[stop:]


def insert(text: str, rng: random.Random) -> str:
    at = _place(text, rng)
    return text[:at] + rng.choice(TOKENS) + text[at:]


def cut(text: str, rng: random.Random) -> str:
    return text[: _place(text, rng)]


def _replace(pattern: re.Pattern[str], text: str, rng: random.Random, new: str) -> str:
    found = list(pattern.finditer(text))
    if not found:
        return text
    match = rng.choice(found)
    return text[: match.start()] + new + text[match.end() :]


def swap_number(text: str, rng: random.Random) -> str:
    return _replace(_NUMBER, text, rng, rng.choice(NUMBERS))


def change_digit(text: str, rng: random.Random) -> str:
    """Change a digit of a number; the result is often valid."""
    return _replace(_DIGIT, text, rng, rng.choice(("0", "1", "2", "5", "9", "-1", "1e", "00", ".")))


def exchange(text: str, rng: random.Random) -> str:
    """Replace one value of the document by another one of its values."""
    return _replace(_NUMBER, text, rng, rng.choice(_NUMBER.findall(text) or ["0"]))


def swap_word(text: str, rng: random.Random) -> str:
    """Replace one word of the document by another one: other names, other kinds, wrong nesting."""
    words = _WORD.findall(text) or ["mass"]
    return _replace(_WORD, text, rng, rng.choice(words))


def repeat_line(text: str, rng: random.Random) -> str:
    """Repeat a field."""
    parts = text.split("\n") if "\n" in text else re.split("(?<=,)", text)
    parts.insert(rng.randrange(len(parts) + 1), rng.choice(parts))
    return ("\n" if "\n" in text else "").join(parts)


def nest(text: str, rng: random.Random) -> str:
    """Nest a value in lists or objects."""
    depth = rng.choice((1, 2, 100, 300, 3000))
    left, right = rng.choice((("[", "]"), ('{"metric":', "}"), ("{a=", "}")))
    found = list(_NUMBER.finditer(text))
    if not found:
        return left * depth + text + right * depth
    match = rng.choice(found)
    return text[: match.start()] + left * depth + match.group() + right * depth + text[match.end() :]


def reshape(text: str, rng: random.Random) -> str:
    """Change a value somewhere in a JSON document."""
    try:
        tree = json.loads(text)
    except (ValueError, RecursionError):
        return swap_word(text, rng)
    places: list[tuple[Any, Any]] = []

    def walk(node: Any) -> None:
        for key in node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ():
            places.append((node, key))
            walk(node[key])

    walk(tree)
    if not places:
        return "[]"
    (into, key), (source, name) = rng.choice(places), rng.choice(places)
    into[key] = json.loads(json.dumps(source[name]))
    return json.dumps(tree)


CHANGES: tuple[Callable[[str, random.Random], str], ...] = (
    *(flip, delete, duplicate, insert, cut, swap_word, repeat_line, nest, reshape, reshape),
    *(swap_number, swap_number, change_digit, change_digit, change_digit, exchange, exchange, exchange),
)
