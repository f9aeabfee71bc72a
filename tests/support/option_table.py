"""Every combination of options that a user can choose, as keyword arguments of the environments."""

from itertools import product
from typing import Any, get_args

from flockesc_env import FlockScenario
from flockesc_env.episodes.options import ActionMode, IndividualReward, LineReward, Objective, TeamReward

# Taken from the schema, so that a new variant is tested without a change here.
ACTION_MODES = get_args(ActionMode)
OBJECTIVES = get_args(Objective)
FLOCK_REWARDS = get_args(TeamReward)
INDIVIDUAL_REWARDS = get_args(IndividualReward)
AGENT_REWARDS = FLOCK_REWARDS + INDIVIDUAL_REWARDS
SENSING_RANGES = ("predator_range", None, 5.0)
STEPS_PER_ACTION = (1, 4, 7)
DIMENSIONS = (2, 3)

NAMES = ("action_mode", "objective", "reward", "predator_sensing_range", "steps_per_action")


# Five agents of their own kind, whose motion is random and late.
UNLIKE: dict[str, Any] = {
    "mass": (0.1, 0.2, 0.3, 0.4, 0.5),
    "speed": (10.0, 8.0, 6.0, 4.0, 2.0),
    "repulsion_strength": (10.0, 0.0, 10.0, 5.0, 20.0),
    "alignment_strength": (0.0, 1.0, 1.0, 0.5, 2.0),
    "angular_noise": 1.0,
    "sensing_noise": 0.5,
    "sensing_delay": 2,
}


def _table(rewards: tuple[str, ...]) -> list[dict[str, Any]]:
    combinations = product(ACTION_MODES, OBJECTIVES, rewards, SENSING_RANGES, STEPS_PER_ACTION)
    return [dict(zip(NAMES, combination, strict=True)) for combination in combinations]


FLOCK_OPTIONS = _table(FLOCK_REWARDS)
AGENT_OPTIONS = _table(AGENT_REWARDS)
LINE_OPTIONS = [
    dict(zip(("action_mode", "reward", "steps_per_action"), combination, strict=True))
    for combination in product(ACTION_MODES, get_args(LineReward), STEPS_PER_ACTION)
]


def label(options: dict[str, Any]) -> str:
    """Return the test id of a combination."""
    return "-".join(str(value) for value in options.values())


def small_flock(dimension: int = 2, **changes: Any) -> FlockScenario:
    """Return a flock small enough to be stepped thousands of times, with the predator within reach."""
    fields = {"num_agents": 5, "num_steps": 10, "initial_side": 30.0, "dimension": dimension}
    return FlockScenario(**{**fields, **changes})
