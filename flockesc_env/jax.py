"""The default flock in JAX: pure functions of arrays, with gradients; needs the extra ``jax``.

The flock lives in the plane, with metric neighbors, inertial motion at constant speed, and predators that fly
straight on or pursue the nearest agent. Of random fields, ``start`` takes a ``RandomApproach``. A scenario
is a ``FlockScenario`` or a preset's name. ``partial(step, scenario)`` works under ``jit``, ``vmap``,
``lax.map`` and ``grad``. Results have the dtype of the positions. All functions raise ``InputError`` for
arguments and scenarios that are not supported. Under ``jit`` they check the shapes of arrays, but not the
numbers.
"""

from collections.abc import Callable
from dataclasses import fields
from functools import partial
from typing import Any, NamedTuple, Unpack

from flockesc_env.common.checks import as_choice, as_flag, as_floats
from flockesc_env.common.errors import InputError, shown
from flockesc_env.common.extras import require
from flockesc_env.models.flock import Flock
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.options import EnvOptionsDict
from flockesc_env.scenario.parts import RandomApproach
from flockesc_env.scenario.predators import ConstantVelocity, Predator, PurePursuit
from flockesc_env.scenario.presets import as_scenario

require("jax", ["jax"])
import jax  # noqa: E402, after the check
import jax.numpy as jnp  # noqa: E402

_Scenario = FlockScenario | str
_NUMBERS = ("mass", "speed", "alignment_strength", "repulsion_strength", "predator_range")
_OF_FLOCKS = ("num_agents", "num_steps", "time_step", "initial_side", "initial_positions", "initial_headings")
_OF_PREDATORS = ("predators", "position", "velocity", "max_turn_rate", "acceleration", "max_speed")
_SUPPORTED = {*_OF_FLOCKS, *_OF_PREDATORS, *_NUMBERS, "randomization"}
"""Fields that may differ from the default."""


class FlockState(NamedTuple):
    """A flock of n agents and P predators at one time, a pytree of arrays."""

    positions: jax.Array  #: r_i in m, shape (n, 2)
    velocities: jax.Array  #: v_i in m/s, shape (n, 2)
    predator_positions: jax.Array  #: r_p in m, shape (P, 2)
    predator_velocities: jax.Array  #: v_p in m/s, shape (P, 2)
    ranges: jax.Array  #: rho_i of the last step in m, shape (n,); 0 before the first step
    heard: jax.Array  #: mean velocity of the neighbors in the last step in m/s, shape (n, 2)
    num_heard: jax.Array  #: number of other neighbors in the last step, shape (n,)
    min_mean_distance: jax.Array  #: J_mean so far (Eq. 12) in m
    min_min_distance: jax.Array  #: J_min so far (Eq. 13) in m
    num_steps: jax.Array  #: number of steps so far


def init(scenario: _Scenario, positions: Any, velocities: Any) -> FlockState:
    """Return the state at t = 0 of positions in m and velocities in m/s, shape (n, 2); nothing is drawn."""
    model = _supported(scenario)
    r = _floats(positions, "positions", (model.num_agents, 2))
    v = _floats(velocities, "velocities", (model.num_agents, 2)).astype(r.dtype)
    starts = [(predator.position, predator.velocity) for predator in model.predators]  # type: ignore[union-attr]
    r_p, v_p = jnp.asarray(starts, r.dtype).swapaxes(0, 1)
    zero, d = jnp.zeros_like(r[:, 0]), _norm(_offsets(r, r_p)).min(axis=1)
    return FlockState(r, v, r_p, v_p, zero, v, zero, d.mean(), d.min(), jnp.int32(0))


def start(scenario: _Scenario, seed: int) -> FlockState:
    """Return the state at t = 0 of a seed, which ``simulate`` starts from; call it outside of ``jit``."""
    flock = Flock(_supported(scenario), seed=seed)
    return init(flock.scenario, flock.positions, flock.velocities)


def step(scenario: _Scenario, state: FlockState, ranges: Any, softness: float = 0.0) -> FlockState:
    """Return the state after one step (docs/model.md, "Flock", steps 1 to 5).

    Args:
        scenario: a scenario, see above.
        state: the state at t.
        ranges: rho_i in m, one or shape (n,). Under ``jit`` a negative range counts as 0.
        softness: width in m of the boundaries of rho_i and rho_p, which gives ranges a gradient. The weight
            at distance d is sigmoid((rho - d) / softness). 0: the model itself.
    """
    model, (r, v, r_p, v_p, *_) = _supported(scenario), state
    within = partial(_within, float(as_floats(softness, "softness", (), least=0.0)))
    m, v0, a, s, rho_p = (jnp.asarray(getattr(model, name), r.dtype).reshape(-1, 1) for name in _NUMBERS)
    rho, dt = _ranges(ranges, "ranges", state), model.time_step
    # 1. Neighbors. An agent hears itself with the weight 1.
    near = jnp.where(jnp.eye(len(r), dtype=bool), 1, within(rho[:, None], _squares(r)))
    sums = jnp.matmul(near, jnp.column_stack([v, jnp.ones_like(rho)]), precision="highest")
    heard, count = sums[:, :2] / sums[:, 2:], sums[:, 2]
    # 2. Forces: consensus (Eq. 11) and escape.
    away = _offsets(r, r_p)
    escape = (within(rho_p, (away**2).sum(axis=-1))[..., None] * _unit(away)).sum(axis=1)
    pushed = v + dt / m * (a * v0 * _unit(heard) + s * escape)
    # 3. Motion with the old velocity. 4. Constant speed. 5. Predators.
    r, r_p = r + dt * v, r_p + dt * v_p
    v = jnp.where(pushed.any(axis=1, keepdims=True), v0 * _unit(pushed), v)
    v_p = jnp.stack([_steered(*each, r, dt) for each in zip(model.predators, r_p, v_p, strict=True)])
    d = _norm(_offsets(r, r_p)).min(axis=1)
    minima = jnp.minimum(state.min_mean_distance, d.mean()), jnp.minimum(state.min_min_distance, d.min())
    return FlockState(r, v, r_p, v_p, rho, heard, count - 1, *minima, state.num_steps + 1)


def observe(
    scenario: _Scenario, state: FlockState, per_agent: bool = True, **options: Unpack[EnvOptionsDict]
) -> jax.Array:
    """Return the agent view, shape (n, 13), or the flock view, shape (18,) (docs/model.md, "Observations").

    The options are those of ``EnvOptions``, without ``profile_ranges`` and ``extra_entries``.
    """
    model, (r, v, r_p, v_p, rho, heard, num_heard, *_) = _supported(scenario), state
    known = model.env_options(options)
    for name, value in (("profile_ranges", known.profile_ranges), ("extra_entries", known.extra_entries)):
        if value:
            raise InputError(name, "none in flockesc_env.jax", shown(value))
    minima = {"min_mean_distance": state.min_mean_distance, "min_min_distance": state.min_min_distance}
    minimum = minima[as_choice(known.objective, "objective", minima)]
    length, v0 = model.initial_side, jnp.max(jnp.asarray(model.speed, r.dtype))
    distances, share, speed = _norm(_offsets(r, r_p)), rho / known.max_range, _norm(v)
    d, nearest, heading = distances.min(axis=1), distances.argmin(axis=1), _unit(v)
    toward, count = _unit(r_p[nearest] - r), _squash(num_heard, 8)
    if as_flag(per_agent, "per_agent"):
        ahead = jnp.where(speed[:, None] > 0, heading, jnp.eye(1, 2, dtype=r.dtype))
        own, relative, axes = d, v_p[nearest] - v, (ahead, _left(ahead))
        vectors = heard / (_norm(heard) + v0)[:, None], toward, relative / (_norm(relative) + v0)[:, None]
        seen = [(axis * vector).sum(axis=1) for vector in vectors for axis in axes]  # ahead, left
        always, if_sensed = [share, _squash(speed, v0), count, *seen[:2]], [_squash(d, length), *seen[2:]]
    else:
        own, center, mean = d.min(), r.mean(axis=0), v.mean(axis=0)
        near = (d <= model.predator_range).astype(r.dtype)
        cosine, p = -(heading * toward).sum(axis=1), _norm(center[None] - r_p).argmin()
        spread, away = _norm((r - center[None]).ravel()) / len(r) ** 0.5, center - r_p[p]
        always = [share.mean(), _squash(speed.mean(), v0), _norm(heading.mean(axis=0))]
        always += [_squash(spread, length), count.mean(), _squash(_norm(heard), v0).mean()]
        if_sensed = [_squash(x, length) for x in (d.mean(), own, _norm(away))]
        if_sensed += [near.mean(), cosine.mean(), (cosine * near).sum() / jnp.maximum(near.sum(), 1)]
        if_sensed += [mean @ _unit(away) / (_norm(mean) + v0)]
        if_sensed += [_squash(_norm(v_p[p]), v0), _unit(v_p[p]) @ _unit(away)]
    sensed = own <= known.predator_sensing_range
    entries = [state.num_steps / model.num_steps, _squash(minimum, length), *always, sensed]
    entries += [jnp.where(sensed, entry, 0) for entry in if_sensed]
    return jnp.stack([jnp.broadcast_to(entry, own.shape).astype(r.dtype) for entry in entries], axis=-1)


def rollout(
    scenario: _Scenario,
    state: FlockState,
    policy: Callable[..., Any],
    softness: float = 0.0,
    per_agent: bool = True,
    memory: Any = None,
    **options: Unpack[EnvOptionsDict],
) -> FlockState:
    """Return the states after each of ``scenario.num_steps`` steps, stacked along a new first axis.

    ``policy`` returns ranges in m, one or shape (n,), for an observation. They hold for ``steps_per_action``
    steps. With a ``memory``, a pytree of arrays, it returns the pair of ranges and next memory for an
    observation and the memory. J_mean (Eq. 12) is ``min_mean_distance[-1]``. Gradients compute each step
    twice to save memory.
    """
    model = _supported(scenario)
    every = model.env_options(options).steps_per_action

    @partial(jax.checkpoint, prevent_cse=False)
    def advance(carry: tuple[FlockState, Any], index: jax.Array) -> tuple[tuple[FlockState, Any], FlockState]:
        state, memory = carry

        def act() -> tuple[jax.Array, Any]:
            seen = observe(model, state, per_agent, **options)
            ranges, kept = (policy(seen), None) if memory is None else policy(seen, memory)
            return _ranges(ranges, "policy", state), kept

        ranges, memory = jax.lax.cond(index % every == 0, act, lambda: (state.ranges, memory))
        moved = step(model, state, ranges, softness)
        return (moved, memory), moved

    return FlockState(*jax.lax.scan(advance, (state, memory), jnp.arange(model.num_steps))[1])


def _supported(scenario: _Scenario) -> FlockScenario:
    model = as_scenario(scenario, FlockScenario)
    parts: dict[str, Any] = {f"predators[{index}]": one for index, one in enumerate(model.predators)}
    if not parts:
        raise InputError("predators", "at least one predator in flockesc_env.jax", "none")
    for index, drawn in enumerate(model.randomization):
        if not isinstance(drawn, RandomApproach):
            raise InputError(f"randomization[{index}]", "RandomApproach in flockesc_env.jax", shown(drawn))
    for path, part in {"": model, **parts}.items():
        if path and not isinstance(part, ConstantVelocity | PurePursuit):
            raise InputError(path, "ConstantVelocity or PurePursuit in flockesc_env.jax", shown(part))
        usual = type(part)()
        for name, default in {each.name: getattr(usual, each.name) for each in fields(usual)}.items():
            if name not in _SUPPORTED and getattr(part, name) != default:
                field = f"{path}.{part.kind}.{name}" if path else name
                raise InputError(field, f"{default!r} in flockesc_env.jax", shown(getattr(part, name)))
    return model


def _floats(value: Any, field: str, shape: tuple[int, ...], least: float = -jnp.inf) -> jax.Array:
    if not isinstance(value, jax.core.Tracer):
        as_floats(value, field, shape, least=least)
    elif value.shape != shape:
        raise InputError(field, f"shape {shape}", f"shape {value.shape}")
    array = jnp.asarray(value)
    return array if jnp.issubdtype(array.dtype, jnp.floating) else array.astype(float)


def _ranges(value: Any, field: str, state: FlockState) -> jax.Array:
    given = _floats(value, field, state.ranges.shape if jnp.ndim(value) else (), 0.0)
    return jnp.maximum(given.astype(state.ranges.dtype), jnp.zeros_like(state.ranges))


def _norm(vectors: jax.Array) -> jax.Array:
    square = (vectors**2).sum(axis=-1)  # the gradient at 0 is 0, not NaN
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1)), 0)


def _unit(vectors: jax.Array) -> jax.Array:
    norm = _norm(vectors)[..., None]
    return jnp.where(norm > 0, vectors / jnp.where(norm > 0, norm, 1), 0)


def _left(vectors: jax.Array) -> jax.Array:
    """Return the vectors turned by 90 degrees to the left."""
    return jnp.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def _offsets(r: jax.Array, r_p: jax.Array) -> jax.Array:
    """Return the offsets from predators to agents, shape (n, P, 2)."""
    return r[:, None] - r_p[None]


def _squash(value: jax.Array, scale: jax.Array | float) -> jax.Array:
    return value / (value + scale)


def _squares(r: jax.Array) -> jax.Array:
    """Return the squared distances of all pairs. As a product, a difference has a fast gradient on a CPU."""
    ones = jnp.ones_like(r[:, 0])
    pairs = [(jnp.stack([x, ones], axis=1), jnp.stack([ones, -x])) for x in r.T]
    return sum(jnp.matmul(*pair, precision="highest") ** 2 for pair in pairs)  # type: ignore[return-value]


def _within(softness: float, limit: jax.Array, squares: jax.Array) -> jax.Array:
    if softness:
        return jax.nn.sigmoid((limit - jnp.sqrt(squares + 1e-30)) / softness)
    return (squares <= limit**2).astype(squares.dtype)


def _steered(predator: Predator, r_p: jax.Array, v_p: jax.Array, r: jax.Array, dt: float) -> jax.Array:
    """Return a predator's next velocity in m/s, shape (2,); r_p has shape (2,), r (n, 2), in m."""
    if not isinstance(predator, PurePursuit):
        return v_p
    direction, speed = _unit(r[_norm(r - r_p[None]).argmin()] - r_p), _norm(v_p)
    # At rest it turns at once; on its prey it keeps its heading; without ``max_speed`` it keeps its speed.
    heading = jnp.where(v_p.any(), _unit(v_p), direction)
    left = _left(heading)
    angle = jnp.arctan2(left @ direction, jnp.where(direction.any(), heading @ direction, 1))
    angle = jnp.clip(angle, -predator.max_turn_rate * dt, predator.max_turn_rate * dt)
    fastest = jnp.minimum(speed + predator.acceleration * dt, predator.max_speed or 0)
    return jnp.maximum(speed, fastest) * (jnp.cos(angle) * heading + jnp.sin(angle) * left)
