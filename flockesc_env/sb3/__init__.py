"""Stable-baselines3: environments, an evaluation callback and policy classes; needs the extra ``sb3``."""

from flockesc_env.common.extras import require

require("sb3", ["stable_baselines3"])

from flockesc_env.sb3.environments import FlockEvalCallback, vec_env  # noqa: E402, after the check
from flockesc_env.sb3.policies import RangePolicy, ScorerPolicy  # noqa: E402

__all__ = ["FlockEvalCallback", "RangePolicy", "ScorerPolicy", "vec_env"]
