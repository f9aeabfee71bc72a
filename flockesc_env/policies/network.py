"""``NetworkPolicy``: small neural networks as policies, which the core computes; networks of torch."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env import _core
from flockesc_env.common.checks import (
    FloatArray,
    as_choice,
    as_count,
    as_flag,
    as_floats,
    as_instance,
    as_text,
)
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.predators import PredatorPolicySpec
from flockesc_env.episodes.spaces import PolicySpec, RangeActions
from flockesc_env.policies.base import BasePolicy, Observations, RowMemory

Parameters = NDArray[np.float32]
Activation = Literal["tanh", "relu"]
Squash = Literal["clip", "tanh"]


@dataclass(frozen=True)
class Architecture:
    """Inputs, layers and head of a ``NetworkPolicy``: hidden layers, then a linear layer for the head.

    The head is a value by default, one normalized action. With ``ranges`` the network has one score for each
    of them. With ``candidate_inputs`` it computes a score for every candidate of ``profile_ranges``. In both
    cases it sets the range with the highest score, the first among equals.

    Attributes:
        inputs: names of the observation entries that are inputs (docs/model.md, "Observations").
        hidden: width of every hidden layer.
        activation: function of the hidden layers: ``"tanh"`` or ``"relu"``.
        memory: number of recurrent values. The network outputs them with every action and receives them as
            inputs for the next; they are 0 at the start of an episode.
        mirror: whether observations of agents are reflected such that the predator is on the left. If no
            predator is observed, the neighbors' mean velocity points to the left instead. The model is
            invariant under reflection.
        squash: function that maps the action to [-1, 1]: ``"clip"`` or ``"tanh"``.
        candidate_inputs: names of the entries of a candidate range that are inputs, without ``profile_k_``;
            or ``"range"``, the candidate divided by the largest one.
        ranges: ranges in m to choose from.
    """

    inputs: tuple[str, ...]
    hidden: tuple[int, ...] = (8,)
    memory: int = 0
    mirror: bool = False
    squash: Squash = "clip"
    candidate_inputs: tuple[str, ...] = ()
    ranges: tuple[float, ...] = ()
    activation: Activation = "tanh"

    def __post_init__(self) -> None:
        for field in ("inputs", "candidate_inputs"):
            for i, name in enumerate(as_instance(getattr(self, field), field, tuple)):
                as_text(name, f"{field}[{i}]")
        if not self.inputs and not self.candidate_inputs:
            raise InputError("inputs", "at least one name", "none")
        widths = enumerate(as_instance(self.hidden, "hidden", tuple))
        ranges = as_floats(as_instance(self.ranges, "ranges", tuple), "ranges", least=0.0)
        plain = {
            "hidden": tuple(as_count(width, f"hidden[{i}]") for i, width in widths),
            "memory": as_count(self.memory, "memory", least=0),
            "mirror": as_flag(self.mirror, "mirror"),
            "squash": as_choice(self.squash, "squash", get_args(Squash)),
            "ranges": tuple(ranges.tolist()),
            "activation": as_choice(self.activation, "activation", get_args(Activation)),
        }
        vars(self).update(plain)
        if self.ranges and self.candidate_inputs:
            raise InputError("ranges", "none for a network that scores candidates", self.ranges)
        if self.memory and (self.ranges or self.candidate_inputs):
            raise InputError("memory", "0 for a network that scores ranges", self.memory)

    @property
    def shapes(self) -> list[tuple[int, int]]:
        """Shape of the weight matrix of every layer, (inputs, outputs)."""
        inputs = len(self.inputs) + len(self.candidate_inputs) + self.memory
        return list(pairwise([inputs, *self.hidden, len(self.ranges) or 1 + self.memory]))

    @property
    def size(self) -> int:
        """Number of parameters: for every layer the weights in row-major order, then the biases."""
        return sum((rows + 1) * columns for rows, columns in self.shapes)

    def to_core(self) -> str:
        """Return the JSON document for the core."""
        return json.dumps(asdict(self))


class NetworkPolicy(BasePolicy, RowMemory):
    """A neural network that sets ranges.

    It requires ``action_mode="normalized"``, unless it chooses from ranges or candidates. Actions do not
    depend on the machine.

    Args:
        architecture: inputs, layers and head of the network.
        parameters: weights and biases, finite in float32, shape (architecture.size,).
    """

    dimension = 1
    """Number of outputs that are the action."""

    def __init__(self, architecture: Architecture, parameters: ArrayLike) -> None:
        as_instance(architecture, "architecture", Architecture)
        size = architecture.size + (self.dimension - 1) * (architecture.shapes[-1][0] + 1)
        with np.errstate(over="ignore"):  # overflow gives infinity, which is rejected below
            narrow = as_floats(parameters, "parameters", (size,)).astype(np.float32)
        self.architecture = architecture
        self.parameters: Parameters = as_floats(narrow, "parameters").astype(np.float32)
        self._document = architecture.to_core()

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return one action per observation row; see ``Policy.act``.

        An environment of another view or with other options (``check``), without an input, without candidates
        that the network scores, or with another action mode, raises ``InputError``.
        """
        self.check(spec.options, per_agent=spec.per_agent)
        actions, ranges = choices(self.architecture, spec.actions, spec.profile_ranges)
        memory = np.empty((len(observations), 0))
        if self.architecture.memory:
            (memory,) = self._recall(self._begin(len(observations)), np.zeros(self.architecture.memory))
        outputs, memory = _core.network_outputs(
            (self._document, self.parameters[np.newaxis], ranges),
            spec.layout.names,
            spec.actions.core,
            np.ascontiguousarray(observations, np.float32),
            memory,
        )
        if self.architecture.memory:
            self._remember(len(outputs), memory)
        return actions[outputs.astype(np.int64)] if len(ranges) else outputs[:, np.newaxis].astype(np.float32)


class PredatorNetwork(NetworkPolicy):
    """A neural network that controls ``Learned`` predators: its outputs are their acceleration.

    Args:
        architecture: layers and ``squash`` alone; inputs are entries of the predator view (docs/model.md).
        parameters: weights and biases, with D outputs, where D = 2 or 3.
    """

    side = "predator"
    per_agent = False

    def __init__(self, architecture: Architecture, parameters: ArrayLike) -> None:
        as_instance(architecture, "architecture", Architecture)
        if architecture != Architecture(architecture.inputs, architecture.hidden, squash=architecture.squash):
            raise InputError("architecture", "inputs, hidden layers and squash alone", architecture)
        one_more, given = architecture.shapes[-1][0] + 1, as_floats(parameters, "parameters")
        self.dimension = 3 if given.size == architecture.size + 2 * one_more else 2
        super().__init__(architecture, parameters)

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> NDArray[Any]:  # type: ignore[override]
        """Return one action per observation row, after ``check_spec``; see ``Policy.act``."""
        inputs = self.check_spec(spec)
        widths = [len(inputs), *self.architecture.hidden, self.dimension]
        parameters = self.parameters.astype(np.float64)
        if self.architecture.squash == "tanh":  # before a layer that changes nothing
            widths.append(self.dimension)
            parameters = np.append(parameters, np.eye(self.dimension + 1, self.dimension))
        rows = np.ascontiguousarray(observations[:, inputs], np.float64)
        outputs = _core.tanh_layers(widths, parameters, rows)
        return outputs.clip(-1.0, 1.0).astype(np.float32)

    def check_spec(self, spec: PredatorPolicySpec) -> list[int]:
        """Return the columns of the inputs; a network for other predators raises ``InputError``."""
        if spec.dimension != self.dimension:
            raise InputError("dimension", f"{self.dimension}, of the predator's network", spec.dimension)
        return [spec.layout.index(name) for name in self.architecture.inputs]


def choices(
    architecture: Architecture, actions: RangeActions, profile_ranges: tuple[float, ...]
) -> tuple[NDArray[Any], FloatArray]:
    """Return the actions from which a network chooses, and their ranges in m; both are empty for a value."""
    ranges = architecture.ranges or (profile_ranges if architecture.candidate_inputs else ())
    chosen = actions.from_ranges(np.array(ranges))
    return chosen, actions.to_ranges(chosen, len(ranges))


def torch_network(
    layers: Iterable[Any],
    inputs: tuple[str, ...],
    *,
    squash: Squash = "clip",
    ranges: tuple[float, ...] = (),
    is_predator: bool = False,
) -> NetworkPolicy:
    """Return a network of torch as a ``NetworkPolicy``, which ``save_policy`` can store.

    Args:
        layers: ``Linear`` and ``Tanh``, or ``Linear`` and ``ReLU``, in turn, with ``Linear`` first and last,
            such as a ``torch.nn.Sequential``. A predator's network has ``Tanh``.
        inputs: names of the observation entries that the network receives, such as ``spec.layout.names``.
        squash: function that maps the first output to the action: ``"clip"`` for the mean of a Gaussian,
            ``"tanh"`` for that of a Gaussian squashed by tanh. Further outputs, such as a scale, are ignored.
        ranges: range in m of every output, for a network with one score per range, such as Q values. The
            policy sets the range with the highest score.
        is_predator: True: the network controls predators, and the result is a ``PredatorNetwork``.
    """
    found = list(layers)
    kinds = [type(layer).__name__ for layer in found]
    is_predator = as_flag(is_predator, "is_predator")
    activation: Activation = "relu" if "ReLU" in kinds and not is_predator else "tanh"
    between = {"relu": "ReLU", "tanh": "Tanh"}[activation]
    if kinds != ["Linear", between] * (len(kinds) // 2) + ["Linear"]:
        pairs = "Linear and Tanh" if is_predator else "Linear and Tanh, or Linear and ReLU,"
        advice = " (in stable-baselines3: policy_kwargs={'activation_fn': torch.nn.Tanh})"
        expected = f"{pairs} in turn, Linear first and last{advice}"
        raise InputError("layers", expected, ", ".join(kinds) or "none")
    hidden, parameters = layer_parameters(found[::2], None if ranges or is_predator else 1)
    kind = PredatorNetwork if is_predator else NetworkPolicy
    return kind(Architecture(inputs, hidden, squash=squash, ranges=ranges, activation=activation), parameters)


def layer_parameters(
    linear: Sequence[Any], outputs: int | None = None
) -> tuple[tuple[int, ...], NDArray[np.float32]]:
    """Return the hidden widths and the parameters, for ``NetworkPolicy``, of linear layers of torch.

    With ``outputs``, only the first outputs of the last layer are kept.
    """
    last = linear[-1]
    parts = [part for at in linear[:-1] for part in (at.weight.T, at.bias)]
    parts += [last.weight[:outputs].T, last.bias[:outputs]]
    numbers = [part.detach().cpu().numpy().ravel() for part in parts]
    return tuple(at.out_features for at in linear[:-1]), np.concatenate(numbers)
