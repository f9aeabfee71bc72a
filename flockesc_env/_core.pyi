"""Types of the compiled core (Rust, PyO3); docs/architecture.md describes its layers."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "MAX_PARTS",
    "FlockBatch",
    "LineEpisode",
    "RangeMap",
    "__version__",
    "check_flock_scenario",
    "check_line_scenario",
    "check_memory",
    "clipped",
    "component_labels",
    "default_flock_scenario",
    "default_line_scenario",
    "drawn_flock_scenario",
    "episode_seed",
    "infos",
    "kinds",
    "laplacian",
    "line_observation_entries",
    "log1p",
    "named_infos",
    "neighbor_pairs",
    "network_outputs",
    "objectives",
    "observation_entries",
    "perron_matrix",
    "predator_observation_entries",
    "rollout_line",
    "scan_flock",
    "simulate_flock",
    "simulate_line",
    "sweep_flock",
    "sweep_line",
    "tanh_layers",
    "views",
]

_Network = tuple[str, NDArray[np.float32], NDArray[np.float64]]
"""Architecture, parameters (networks, size), and the ranges in m that the networks choose from."""

MAX_PARTS: int
__version__: str

@final
class RangeMap:
    def __new__(
        cls, min_range: float, max_range: float, is_normalized: bool, grid: list[float] | None
    ) -> Self: ...
    def __getnewargs__(self) -> tuple[float, float, bool, list[float] | None]: ...
    def to_ranges(
        self, actions: Any, count: int, label: Callable[[int], str] | None = None
    ) -> NDArray[np.float64]: ...
    def to_range(self, action: Any) -> float: ...
    def stack(self, actions: Mapping[str, Any], agents: list[str], known: list[str]) -> NDArray[Any]: ...

@final
class FlockBatch:
    def __new__(
        cls,
        scenarios: Sequence[str],
        slots: Sequence[int],
        options: str,
        actions: RangeMap,
        num_threads: int | None,
        count_components: bool,
        seed: int,
    ) -> Self: ...
    def reset(
        self, slots: Sequence[int], seeds: Sequence[int | None], starts: Sequence[Mapping[str, Any]]
    ) -> tuple[NDArray[np.float32], dict[str, NDArray[Any]]]: ...
    def step(
        self,
        actions: Any,
        label: Callable[[int], str] | None = None,
        at_end: str = "refuse",
        out: tuple[NDArray[np.float32], NDArray[np.float64]] | None = None,
        predator_actions: NDArray[np.float64] | Callable[[], NDArray[np.float64]] | None = None,
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.float64],
        NDArray[np.bool],
        NDArray[np.float64],
        dict[str, NDArray[Any]],
    ]: ...
    def step_flock(
        self,
        actions: Any,
        label: Callable[[int], str] | None = None,
        predator_actions: NDArray[np.float64] | Callable[[], NDArray[np.float64]] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], bool, NDArray[np.float64], dict[str, Any]]: ...
    def step_one(
        self,
        action: Any,
        predator_actions: NDArray[np.float64] | Callable[[], NDArray[np.float64]] | None = None,
    ) -> tuple[NDArray[np.float32], float, bool, dict[str, Any]]: ...
    def rollout(
        self, network: _Network, seeds: NDArray[np.uint64], report: Callable[[int], None] | None = None
    ) -> dict[str, NDArray[Any]]: ...
    def observe(self, slots: Sequence[int], view: str = "own") -> NDArray[np.float32]: ...
    def metrics(self) -> dict[str, NDArray[Any]]: ...
    def num_components(self) -> NDArray[np.int64]: ...
    def episode_seed(self, slot: int) -> int: ...
    def has_ended(self, slot: int) -> bool: ...
    def state(self, slot: int) -> dict[str, Any]: ...
    def predator_rewards(self) -> NDArray[np.float64]: ...
    def caught(self) -> NDArray[np.bool]: ...
    def get_state(self, slots: Sequence[int]) -> bytes: ...
    def set_state(self, slots: Sequence[int], state: bytes) -> None: ...
    def drop_episodes(self) -> None: ...
    def __setstate__(self, state: bytes) -> None: ...
    def __deepcopy__(self, _memo: dict[int, Any]) -> Self: ...

@final
class LineEpisode:
    def __new__(
        cls, scenario: str, options: str, seed: int, initial_state: NDArray[np.float64] | None = None
    ) -> Self: ...
    def step(
        self, interaction_range: float
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]: ...
    def info(self) -> dict[str, Any]: ...
    def observe(self) -> NDArray[np.float32]: ...
    def get_state(self, seed: int, episode: int) -> bytes: ...
    def set_state(self, state: bytes) -> tuple[int, int]: ...
    def __setstate__(self, state: bytes) -> None: ...
    def __deepcopy__(self, _memo: dict[int, Any]) -> Self: ...
    @property
    def states(self) -> NDArray[np.float64]: ...
    @property
    def steps(self) -> int: ...
    @property
    def escape_distance(self) -> float: ...
    @property
    def num_components(self) -> int: ...
    @property
    def interaction_range(self) -> float: ...
    @property
    def is_steady(self) -> bool: ...
    @property
    def has_ended(self) -> bool: ...

def infos(
    columns: dict[str, NDArray[Any]], ranges: NDArray[np.float64] | None = None
) -> list[dict[str, Any]]: ...
def named_infos(
    names: list[str], info: dict[str, Any], ranges: NDArray[np.float64]
) -> dict[str, dict[str, Any]]: ...
def check_flock_scenario(scenario: str) -> None: ...
def check_line_scenario(scenario: str) -> None: ...
def check_memory(field: str, num_bytes: int) -> None: ...
def default_flock_scenario() -> str: ...
def default_line_scenario() -> str: ...
def drawn_flock_scenario(scenario: str, seed: int) -> str | None: ...
def simulate_flock(
    scenario: str,
    ranges: NDArray[np.float64],
    seed: int,
    positions: NDArray[np.float64] | None,
    velocities: NDArray[np.float64] | None,
    num_threads: int | None,
    predator_actions: NDArray[np.float64] | None = None,
) -> dict[str, Any]: ...
def simulate_line(
    scenario: str, interaction_range: float, seed: int, initial_state: NDArray[np.float64] | None = None
) -> dict[str, Any]: ...
def network_outputs(
    network: _Network,
    names: Sequence[str],
    actions: RangeMap,
    observations: NDArray[np.float32],
    memory: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def log1p(numbers: NDArray[np.float64]) -> NDArray[np.float64]: ...
def clipped(actions: NDArray[np.float64]) -> NDArray[np.float64]: ...
def tanh_layers(
    widths: list[int], parameters: NDArray[np.float64], inputs: NDArray[np.float64]
) -> NDArray[np.float64]: ...
def rollout_line(
    documents: tuple[str, str],
    actions: RangeMap,
    network: _Network,
    seeds: NDArray[np.uint64],
    num_threads: int | None,
    report: Callable[[int], None] | None,
) -> dict[str, NDArray[Any]]: ...
def scan_flock(
    scenarios: list[str],
    interaction_range: float,
    seeds: NDArray[np.uint64],
    num_threads: int | None,
    report: Callable[[int], None] | None,
) -> NDArray[np.float64]: ...
def sweep_flock(
    scenario: str,
    ranges: NDArray[np.float64],
    seeds: NDArray[np.uint64],
    num_threads: int | None,
    report: Callable[[int], None] | None,
) -> dict[str, NDArray[Any]]: ...
def sweep_line(
    scenario: str,
    ranges: NDArray[np.float64],
    seeds: NDArray[np.uint64],
    num_threads: int | None,
    report: Callable[[int], None] | None,
) -> dict[str, NDArray[Any]]: ...
def episode_seed(seed: int, episode: int) -> int: ...
def component_labels(
    scenario: str | None,
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
    ranges: NDArray[np.float64],
) -> NDArray[np.int64]: ...
def neighbor_pairs(
    scenario: str | None,
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
    ranges: NDArray[np.float64],
) -> NDArray[np.int64]: ...
def perron_matrix(states: NDArray[np.float64], interaction_range: float) -> NDArray[np.float64]: ...
def laplacian(states: NDArray[np.float64], interaction_range: float) -> NDArray[np.float64]: ...
def observation_entries(options: str, dimension: int) -> list[tuple[str, float, float]]: ...
def predator_observation_entries(dimension: int) -> list[tuple[str, float, float]]: ...
def line_observation_entries(num_agents: int) -> list[tuple[str, float, float]]: ...
def kinds() -> dict[str, list[str]]: ...
def objectives() -> list[str]: ...
def views() -> list[str]: ...
