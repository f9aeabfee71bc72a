"""The command line ``python -m studies``."""

import sys
from collections.abc import Callable

from flockesc_env.cli.application import Application
from flockesc_env.cli.output import Exit
from studies import commands
from studies.findings import command as findings
from studies.scoreboard import command as scoreboard

COMMANDS: dict[str, Callable[..., Exit]] = {
    "paper": commands.paper,
    "robustness": commands.robustness,
    "validation": commands.validation,
    "arms-race": commands.arms_race,
    "findings": findings.run,
    "findings-page": findings.page,
    "scoreboard-freeze": scoreboard.freeze,
    "scoreboard-train": scoreboard.train,
    "scoreboard-rewards": scoreboard.rewards,
    "scoreboard-page": scoreboard.page,
}

STUDIES = Application("python -m studies", "Studies made with flockesc_env.", COMMANDS)

if __name__ == "__main__":
    sys.exit(STUDIES.main())
