"""Gradients of whole episodes: backpropagation through the flock in JAX trains a network."""

from __future__ import annotations

import os
from functools import partial
from typing import Any

os.environ.setdefault("NPROC", "1")  # more threads of XLA take more processor time; read by ``import jax``

import jax
import jax.numpy as jnp
import numpy as np
import optax

from flockesc_env import InputError, NetworkPolicy
from flockesc_env import jax as twin
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.splits import training_seeds
from flockesc_env.policies import Architecture
from training.families import Networks
from training.rounds import Arguments, Rounds, hyperparameters_of
from training.run import Run

Layers = list[tuple[Any, Any]]
"""Weights and biases of all layers, in the order of ``Architecture.size``."""

_LATCH, _INTO_MEMORY = 1.5, 0.3
"""First weight from the hidden unit of a memory value back to it; factor of all others into the memory."""


class GradientArguments(Arguments, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Hyperparameters of training with gradients; a round is an update of Adam.

    Attributes:
        hidden: widths of the hidden layers.
        memory: number of recurrent values of the network, at most the smallest width.
        softness: width in m of the boundaries of ranges; see ``flockesc_env.jax.step``.
        learning_rate: first learning rate; it falls to 0 as a cosine.
        clip: largest norm of the gradient of a flock. Larger gradients are scaled before the mean is taken.
        flocks: number of flocks per update.
        updates: number of updates.
    """

    hidden: tuple[int, ...] = (24,)
    memory: int = 4
    softness: float = 1.0
    learning_rate: float = 0.02
    clip: float = 1.0
    flocks: int = 8
    updates: int = 400


class GradientRounds(Rounds[GradientArguments]):
    """A training run with gradients.

    Raises:
        InputError: if a hyperparameter is unknown or out of bounds; if ``flockesc_env.jax`` refuses the task.
    """

    kept = ("layers", "_moments")
    ends_with_best = True

    def __init__(self, run: Run) -> None:
        args = hyperparameters_of(run, GradientArguments)
        super().__init__(run, args, args.updates)
        first, longest = run.learner.first_range, run.options["max_range"]
        first = run.task.best_fixed_range if first is None else first
        if not 0 < first < longest:
            raise InputError("first_range", f"above 0 and below {longest} m", first)
        if args.memory > min(args.hidden, default=0):
            raise InputError("memory", "at most the smallest width of hidden layers", args.memory)
        inputs = run.policy_spec.layout.names
        scenario: Any = run.task.scenario
        self._scenario = scenario
        twin.observe(scenario, self._start(0), run.task.per_agent, **run.options)  # refuses other tasks
        network = Architecture(inputs, args.hidden, args.memory, squash="tanh")
        self.family = Networks(run, network)
        self._optimizer = optax.adam(optax.cosine_decay_schedule(args.learning_rate, args.updates))
        self.layers = first_layers(network, 2 * first / longest - 1, run.seed)
        self._moments = self._optimizer.init(self.layers)
        self._update = jax.jit(self._updated)

    @property
    def vector(self) -> FloatArray:
        """The parameters of the network."""
        return np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(self.layers)])

    def policy(self) -> NetworkPolicy:
        """Return the network."""
        return self.family.policy(self.vector)

    def round(self) -> float:
        """Update the network with the gradients of new flocks; return their mean objective."""
        flocks = self.args.flocks
        seeds = training_seeds(self.run.seed, self.measured.episodes, flocks)
        starts = jax.tree.map(lambda *each: jnp.stack(each), *map(self._start, seeds))
        self.layers, self._moments, values = self._update(self.layers, self._moments, starts)
        self.measured.episodes += flocks
        self.measured.samples += flocks * self.run.policy_spec.rows * self.run.task.num_actions
        return float(np.mean(values))

    def objective(self, layers: Layers, start: twin.FlockState) -> jax.Array:
        """Return the objective of a flock in m under the network with these layers."""
        run, network = self.run, self.family.architecture

        def policy(observed: jax.Array, memory: jax.Array) -> tuple[jax.Array, jax.Array]:
            outputs = jnp.concatenate([observed, memory], axis=-1)
            for weights, biases in layers:
                outputs = jnp.tanh(outputs @ weights + biases)
            return (outputs[..., 0] + 1) / 2 * run.options["max_range"], outputs[..., 1:]

        per_agent = run.task.per_agent
        rows = (run.policy_spec.rows,) if per_agent else ()
        memory = jnp.zeros((*rows, network.memory), start.positions.dtype)
        options = {"per_agent": per_agent, "memory": memory, **run.options}
        states = twin.rollout(self._scenario, start, policy, self.args.softness, **options)
        objectives: jax.Array = getattr(states, run.task.spec.name)
        return objectives[-1]

    def _updated(self, layers: Layers, moments: Any, starts: Any) -> tuple[Layers, Any, jax.Array]:
        values, gradients = jax.lax.map(partial(jax.value_and_grad(self.objective), layers), starts)
        total, _ = optax.per_example_global_norm_clip(gradients, self.args.clip)
        upward = jax.tree.map(lambda each: -each / len(values), total)
        steps, moments = self._optimizer.update(upward, moments)
        return optax.apply_updates(layers, steps), moments, values

    def _start(self, seed: int) -> twin.FlockState:
        return twin.start(self._scenario, seed)


def first_layers(network: Architecture, first: float, seed: int) -> Layers:
    """Return random layers, whose action is near ``first`` in (-1, 1).

    Every memory value is a latch at first: it passes through one unit of each hidden layer back to itself.
    """
    rng = np.random.default_rng(seed)
    layers = [(rng.normal(0, shape[0] ** -0.5, shape), np.zeros(shape[1])) for shape in network.shapes]
    (last, biases), units = layers[-1], np.arange(network.memory)
    biases[0] = np.arctanh(first)
    last[:, 1:] *= _INTO_MEMORY
    for depth, (weights, _) in enumerate(layers[:-1]):
        weights[units + (len(network.inputs) if depth == 0 else 0), units] = 1.0
    last[units, 1 + units] = _LATCH
    single: Layers = jax.tree.map(partial(jnp.asarray, dtype=np.float32), layers)
    return single
