"""The command line ``python -m studies``."""

import sys
from collections.abc import Callable

from flockesc_env.cli.application import Application
from flockesc_env.cli.exits import Exit
from studies.arms_race import command as arms_race
from studies.benchmark import command as benchmark
from studies.learned import command as learned
from studies.paper import command as paper
from studies.robustness import command as robustness
from studies.validation import command as validation

COMMANDS: dict[str, Callable[..., Exit]] = {
    "paper": paper.run,
    "robustness": robustness.run,
    "learned": learned.run,
    "learned-references": learned.references,
    "learned-replay": learned.replay,
    "learned-explain": learned.explain,
    "learned-losses": learned.losses,
    "learned-information": learned.information,
    "learned-mechanism": learned.mechanism,
    "learned-coverage": learned.coverage,
    "learned-page": learned.page,
    "validation": validation.run,
    "arms-race": arms_race.run,
    "benchmark-freeze": benchmark.freeze,
    "benchmark-train": benchmark.train,
    "benchmark-submit": benchmark.submit,
    "benchmark-page": benchmark.page,
}

STUDIES = Application("python -m studies", "Studies made with flockesc_env.", COMMANDS)

if __name__ == "__main__":
    sys.exit(STUDIES.main())
