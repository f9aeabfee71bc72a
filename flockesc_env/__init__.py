"""Environments whose action is the interaction range of a flock under attack.

``simulate``, ``simulate_line`` and ``sweep`` run the paper's models; ``parallel_env`` (PettingZoo),
``flockesc/FlockEscape-v0`` and ``flockesc/LineEscape-v0`` (Gymnasium) and ``flockesc_env.sb3``
(stable-baselines3) make the range an action; ``flockesc_env.policies`` and ``flockesc_env.network`` hold
policies, ``rollout`` and ``rollout_line`` compare them.
"""

import gymnasium as _gymnasium

from flockesc_env import policies
from flockesc_env._core import __version__
from flockesc_env.common.errors import (
    ActionError,
    ArgumentError,
    EpisodeError,
    FlockescError,
    InputError,
    OptionError,
    RecordError,
    ResetNeededError,
    ScenarioError,
)
from flockesc_env.envs.gymnasium import FlockEscapeEnv
from flockesc_env.envs.line import LineEscapeEnv
from flockesc_env.envs.pettingzoo import FlockParallelEnv, env, parallel_env, raw_env
from flockesc_env.envs.pursuit import FlockPursuitEnv
from flockesc_env.envs.vector import FlockVectorEnv
from flockesc_env.episodes.options import EnvOptions, LineOptions
from flockesc_env.episodes.seeds import episode_seed
from flockesc_env.models import graph, records
from flockesc_env.models.simulate import LineTrajectory, Trajectory, simulate, simulate_line
from flockesc_env.models.sweep import FlockSweepResult, LineSweepResult, SweepResult, sweep
from flockesc_env.policies import network
from flockesc_env.policies import predators as predator_policies
from flockesc_env.policies import registry as contenders
from flockesc_env.policies.files import load_policy, save_policy
from flockesc_env.policies.rollout import Episodes, record, rollout
from flockesc_env.policies.rollout_line import LineEpisodes, rollout_line
from flockesc_env.render import RenderOptions
from flockesc_env.scenario.approach import approach
from flockesc_env.scenario.flock import FlockScenario, LineScenario
from flockesc_env.scenario.initial import (
    AlignedHeadings,
    Clusters,
    Disc,
    Gaussian,
    GivenHeadings,
    GivenPositions,
    RandomHeadings,
    Ring,
    Segment,
    Square,
)
from flockesc_env.scenario.initial_files import read_initial_state
from flockesc_env.scenario.motion import Inertial, Reynolds, Vicsek
from flockesc_env.scenario.neighbors import Metric, NeighborRule, Topological, Voronoi
from flockesc_env.scenario.predators import (
    ConstantVelocity,
    Encircle,
    Herd,
    Intercept,
    Learned,
    PurePursuit,
    Wandering,
)
from flockesc_env.scenario.presets import PRESETS, preset
from flockesc_env.scenario.randomization import Choice, LogUniform, Uniform

__all__ = [
    "PRESETS",
    "ActionError",
    "AlignedHeadings",
    "ArgumentError",
    "Choice",
    "Clusters",
    "ConstantVelocity",
    "Disc",
    "Encircle",
    "EnvOptions",
    "EpisodeError",
    "Episodes",
    "FlockEscapeEnv",
    "FlockParallelEnv",
    "FlockPursuitEnv",
    "FlockScenario",
    "FlockSweepResult",
    "FlockVectorEnv",
    "FlockescError",
    "Gaussian",
    "GivenHeadings",
    "GivenPositions",
    "Herd",
    "Inertial",
    "InputError",
    "Intercept",
    "Learned",
    "LineEpisodes",
    "LineEscapeEnv",
    "LineOptions",
    "LineScenario",
    "LineSweepResult",
    "LineTrajectory",
    "LogUniform",
    "Metric",
    "NeighborRule",
    "OptionError",
    "PurePursuit",
    "RandomHeadings",
    "RecordError",
    "RenderOptions",
    "ResetNeededError",
    "Reynolds",
    "Ring",
    "ScenarioError",
    "Segment",
    "Square",
    "SweepResult",
    "Topological",
    "Trajectory",
    "Uniform",
    "Vicsek",
    "Voronoi",
    "Wandering",
    "__version__",
    "approach",
    "contenders",
    "env",
    "episode_seed",
    "graph",
    "load_policy",
    "network",
    "parallel_env",
    "policies",
    "predator_policies",
    "preset",
    "raw_env",
    "read_initial_state",
    "record",
    "records",
    "rollout",
    "rollout_line",
    "save_policy",
    "simulate",
    "simulate_line",
    "sweep",
]

_gymnasium.register(
    "flockesc/FlockEscape-v0",
    "flockesc_env.envs.gymnasium:FlockEscapeEnv",
    vector_entry_point="flockesc_env.envs.vector:FlockVectorEnv",
)
_gymnasium.register("flockesc/FlockPursuit-v0", "flockesc_env.envs.pursuit:FlockPursuitEnv")
_gymnasium.register("flockesc/LineEscape-v0", "flockesc_env.envs.line:LineEscapeEnv")
