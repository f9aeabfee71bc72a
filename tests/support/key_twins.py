"""A dataclass with the name and the fields of one in tests/jobs/test_keys.py."""

import dataclasses
from typing import Any


@dataclasses.dataclass
class Box:
    content: Any
