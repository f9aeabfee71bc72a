"""``NetworkPolicy``: small neural networks as policies.

``NetworkPolicy.act`` computes in NumPy. ``rollout`` plays whole episodes in the core.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import (
    FloatArray,
    as_choice,
    as_count,
    as_flag,
    as_floats,
    as_instance,
    as_text,
)
from flockesc_env.common.errors import ArgumentError
from flockesc_env.episodes.spaces import ObservationLayout, PolicySpec
from flockesc_env.policies.base import Observations, RowMemory

Parameters = NDArray[np.float32]
Squash = Literal["clip", "tanh"]


@dataclass(frozen=True)
class Architecture:
    """Inputs and layers of a ``NetworkPolicy``: tanh layers, then a linear layer squashed to [-1, 1].

    Attributes:
        inputs: names of the observation entries that are inputs (docs/model.md, "Observations").
        hidden: width of every hidden layer.
        memory: number of recurrent values. The network outputs them with every action and receives them as
            inputs for the next; they are 0 at the start of an episode.
        mirror: whether observations are reflected such that the predator is on the left; see ``mirrored``.
        squash: function that maps the action to [-1, 1]: ``"clip"`` or ``"tanh"``.
        candidate_inputs: names of the entries of a candidate range that are inputs, without ``profile_k_``;
            or ``"range"``, the candidate divided by the largest one. The network then scores every candidate
            of ``profile_ranges`` and sets the one with the highest score, the shortest among equals.

    Raises:
        ArgumentError: if an attribute has the wrong type or is out of bounds.
    """

    inputs: tuple[str, ...]
    hidden: tuple[int, ...] = (8,)
    memory: int = 0
    mirror: bool = False
    squash: Squash = "clip"
    candidate_inputs: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for field in ("inputs", "candidate_inputs"):
            for i, name in enumerate(as_instance(getattr(self, field), field, tuple)):
                as_text(name, f"{field}[{i}]")
        if not self.inputs and not self.candidate_inputs:
            raise ArgumentError("inputs", "at least one name", "none")
        widths = enumerate(as_instance(self.hidden, "hidden", tuple))
        hidden = tuple(as_count(width, f"hidden[{i}]") for i, width in widths)
        object.__setattr__(self, "hidden", hidden)
        object.__setattr__(self, "memory", as_count(self.memory, "memory", least=0))
        if self.memory and self.candidate_inputs:
            raise ArgumentError("memory", "0 for a network that scores candidate ranges", self.memory)
        object.__setattr__(self, "mirror", as_flag(self.mirror, "mirror"))
        object.__setattr__(self, "squash", as_choice(self.squash, "squash", get_args(Squash)))

    @property
    def shapes(self) -> list[tuple[int, int]]:
        """Shape of the weight matrix of every layer, (inputs, outputs)."""
        inputs = len(self.inputs) + len(self.candidate_inputs) + self.memory
        return list(pairwise([inputs, *self.hidden, 1 + self.memory]))

    @property
    def size(self) -> int:
        """Number of parameters: for every layer the weights in row-major order, then the biases."""
        return sum((rows + 1) * columns for rows, columns in self.shapes)

    def to_core(self) -> str:
        """Return the JSON document for the core."""
        return json.dumps(asdict(self))


class NetworkPolicy(RowMemory):
    """A neural network that sets ranges.

    It requires ``action_mode="normalized"``, unless it scores candidate ranges.

    It computes in float64. Parameters and actions are float32.

    Args:
        architecture: inputs and layers of the network.
        parameters: weights and biases, shape (architecture.size,).

    Raises:
        ArgumentError: if an argument has the wrong type or shape, or a parameter is not a finite float32.
    """

    def __init__(self, architecture: Architecture, parameters: ArrayLike) -> None:
        as_instance(architecture, "architecture", Architecture)
        with np.errstate(over="ignore"):  # overflow gives infinity, which is rejected below
            narrow = as_floats(parameters, "parameters", (architecture.size,)).astype(np.float32)
        self.architecture = architecture
        self.parameters: Parameters = as_floats(narrow, "parameters").astype(np.float32)
        self._layers = list(_layers(architecture, self.parameters))

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return one action per observation row; see ``Policy.act``.

        Raises:
            ArgumentError: if an input is not in the observation; if the network does not score candidates and
                the action mode is not ``"normalized"``; if the network has a memory and the number of rows
                changes during an episode.
        """
        values = self._read(self.architecture.inputs, observations, spec)
        if self.architecture.candidate_inputs:
            return self._choose(values, observations, spec)
        if spec.actions.mode != "normalized":
            raise ArgumentError("action_mode", "'normalized'", repr(spec.actions.mode))
        if self.architecture.memory:
            (memory,) = self._recall(self._begin(len(values)), np.zeros(self.architecture.memory))
            values = np.concatenate([values, memory], axis=1)
        values = self._forward(values)
        action = values[:, :1]
        bounded = np.tanh(action) if self.architecture.squash == "tanh" else action.clip(-1, 1)
        if self.architecture.memory:
            self._remember(len(values), np.tanh(values[:, 1:]))
        return bounded.astype(np.float32)

    def _read(self, names: Sequence[str], observations: Observations, spec: PolicySpec) -> FloatArray:
        """Return the values of some entries, shape (k, names)."""
        columns = [spec.layout.index(name) for name in names]
        values: FloatArray = observations[:, columns].astype(np.float64)
        if self.architecture.mirror:
            _reflect(values, names, _sides(observations, spec.layout))
        return values

    def _choose(self, own: FloatArray, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the actions of the candidate ranges with the highest scores."""
        candidates = spec.candidate_ranges
        if not candidates.size:
            raise ArgumentError("profile_ranges", "candidate ranges for a network that scores them", "none")
        scores = []
        for k, candidate in enumerate(candidates):
            values = np.full((len(own), len(self.architecture.candidate_inputs)), candidate / candidates[-1])
            names = [
                (i, name) for i, name in enumerate(self.architecture.candidate_inputs) if name != "range"
            ]
            entries = [f"profile_{k}_{name}" for _, name in names]
            values[:, [i for i, _ in names]] = self._read(entries, observations, spec)
            scores.append(self._forward(np.concatenate([own, values], axis=1))[:, 0])
        chosen: NDArray[np.int64] = np.argmax(scores, axis=0)
        return spec.actions.from_ranges(np.array(spec.profile_ranges)[chosen])

    def _forward(self, values: FloatArray) -> FloatArray:
        """Return the outputs of the last layer, shape (k, outputs)."""
        for weights, biases in self._layers[:-1]:
            values = np.tanh(values @ weights + biases)
        weights, biases = self._layers[-1]
        outputs: FloatArray = values @ weights + biases
        return outputs


def mirrored(observations: Observations, layout: ObservationLayout) -> Observations:
    """Return observations of agents, reflected such that the predator is on the left.

    If no predator is observed, the neighbors' mean velocity points to the left instead. The model is
    invariant under reflection, so the reflected observation contains all that a policy needs.

    Args:
        observations: observation rows of agents, shape (k, entries).
        layout: names of the entries.
    """
    reflected = observations.copy()
    _reflect(reflected, layout.names, _sides(observations, layout))
    return reflected


def _sides(observations: Observations, layout: ObservationLayout) -> Parameters:
    """Return -1 for rows to reflect and 1 for others, shape (k,)."""
    predator = observations[:, layout.index("predator_direction_left")]
    heard = observations[:, layout.index("heard_velocity_left")]
    return np.where(np.where(predator != 0, predator, heard) < 0, np.float32(-1), np.float32(1))


def _reflect(values: NDArray[Any], names: Sequence[str], sides: Parameters) -> None:
    """Multiply the entries that point to the left by ``sides``, in place."""
    for column, name in enumerate(names):
        if name.endswith("_left"):
            values[:, column] *= sides


def _layers(architecture: Architecture, parameters: Parameters) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield the weights, shape (inputs, outputs), and biases, shape (outputs,), of every layer."""
    numbers, at = parameters.astype(np.float64), 0
    for rows, columns in architecture.shapes:
        weights = numbers[at : at + rows * columns].reshape(rows, columns)
        at += rows * columns
        yield weights, numbers[at : at + columns]
        at += columns
