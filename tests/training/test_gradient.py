"""Training with gradients: the flock in JAX plays as the core does, and an update is Adam's."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_runs import SMALL, small_run

from flockesc_env import InputError
from flockesc_env.scenario import PurePursuit, RandomApproach

jax = pytest.importorskip("jax", reason="the extra jax is not installed")
pytest.importorskip("optax", reason="the extra jax is not installed")
import jax.numpy as jnp  # noqa: E402

from flockesc_env.jax import start  # noqa: E402
from training.gradient import GradientRounds  # noqa: E402

HARD = {"softness": 0.0, "memory": 2, "flocks": 2}
VARIED = SMALL.replace(predators=(PurePursuit(),), randomization=(RandomApproach(),))


@pytest.fixture(autouse=True)
def double() -> Iterator[None]:
    with jax.enable_x64(True):
        yield


@pytest.mark.parametrize(("task", "scenario"), [("per-agent-local", VARIED), ("one-range", SMALL)])
def test_the_core_plays_the_network_as_the_flock_in_jax_does(
    task: str, scenario: Any, tmp_path: Path
) -> None:
    run = small_run(tmp_path / "run", "gradient", task=task, scenario=scenario, **HARD)
    rounds, seeds = GradientRounds(run), range(20)
    starts = jax.tree.map(lambda *each: jnp.stack(each), *[start(scenario, seed) for seed in seeds])
    found = jax.jit(lambda states: jax.lax.map(lambda one: rounds.objective(rounds.layers, one), states))
    expected = run.objectives(rounds.policy(), seeds)
    np.testing.assert_allclose(found(starts), expected, rtol=0, atol=1e-9)
    assert len({*expected.round(3)}) > 10


def test_an_update_is_the_first_step_of_adam_along_the_mean_of_clipped_gradients(tmp_path: Path) -> None:
    rounds = GradientRounds(small_run(tmp_path / "run", "gradient", clip=0.1))
    before, layers, drawn = rounds.vector, rounds.layers, []
    draw = rounds._start
    rounds._start = lambda seed: drawn.append(draw(seed)) or drawn[-1]  # type: ignore[method-assign, func-returns-value]
    mean = rounds.round()
    play = jax.jit(jax.value_and_grad(rounds.objective))
    values, gradients = zip(*[play(layers, one) for one in drawn], strict=True)
    flat = np.array([np.concatenate([*map(np.ravel, jax.tree.leaves(each))]) for each in gradients])
    norms = np.linalg.norm(flat, axis=1, keepdims=True)
    assert (norms > 0.1).all()
    clipped = (flat * 0.1 / norms).mean(axis=0)  # Adam divides it by its absolute value plus 1e-8
    expected = rounds.args.learning_rate * clipped / (abs(clipped) + 1e-8)
    np.testing.assert_allclose(rounds.vector - before, expected, rtol=1e-3, atol=1e-6)
    assert mean == pytest.approx(np.mean(values))


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        ("gradient.hyperparameters", {"layers": 2}),
        ("first_range", {"first_range": 20.0}),
        ("memory", {"hidden": (4, 2), "memory": 3}),
        ("extra_entries", {"options": {"extra_entries": ("closest_approach",)}}),
        ("capture_radius", {"scenario": SMALL.replace(capture_radius=1.0)}),
    ],
)
def test_what_gradients_cannot_train_is_refused_before_training(
    field: str, changes: Any, tmp_path: Path
) -> None:
    run = small_run(tmp_path / "run", "gradient", **changes)
    with pytest.raises(InputError, match=f"^{field}: "):
        GradientRounds(run)
    assert not run.folder.exists()
