"""The command line ``python -m studies``."""

import sys
from collections.abc import Callable

from flockesc_env.cli.application import Application
from flockesc_env.cli.exits import Exit
from studies.arms_race import command as arms_race
from studies.findings import command as findings
from studies.paper import command as paper
from studies.robustness import command as robustness
from studies.scoreboard import command as scoreboard
from studies.validation import command as validation

COMMANDS: dict[str, Callable[..., Exit]] = {
    "paper": paper.run,
    "robustness": robustness.run,
    "findings": findings.run,
    "findings-page": findings.page,
    "validation": validation.run,
    "arms-race": arms_race.run,
    "scoreboard-freeze": scoreboard.freeze,
    "scoreboard-train": scoreboard.train,
    "scoreboard-page": scoreboard.page,
}

STUDIES = Application("python -m studies", "Studies made with flockesc_env.", COMMANDS)

if __name__ == "__main__":
    sys.exit(STUDIES.main())
