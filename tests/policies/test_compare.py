"""``compare`` in an own scenario, and models that play through wrappers; bad input plays no flock."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from cli_runs import Ran
from option_table import doomed, small_flock
from sb3_contrib import RecurrentPPO
from stable_baselines3 import A2C, PPO
from stable_baselines3.common.vec_env import VecFrameStack, VecMonitor, VecNormalize
from torch.nn import Tanh

import flockesc_env as fe
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.policies import Architecture, FixedRange, PredatorNetwork, Pursue, compare
from flockesc_env.policies.registry import PREDATORS
from flockesc_env.sb3 import FlockEvalCallback, vec_env
from flockesc_env.scenario import ConstantVelocity, PurePursuit, Topological

FEW: dict[str, Any] = {"num_flocks": 4, "num_tuning": 3}
SETTINGS: dict[str, Any] = {"device": "cpu", "seed": 0, "n_steps": 5}
VARIANT = small_flock(
    dimension=3,
    predators=(ConstantVelocity((-9.0,) * 3, (6.0,) * 3), PurePursuit((-9.0, 0.0, 0.0), (9.0, 2.0, 2.0))),
    capture_radius=3.0,
    neighbor_rule=Topological(),
)


@pytest.mark.parametrize("objective", ["min_min_distance", "fraction_surviving"])
def test_an_own_scenario_is_compared_as_by_hand(objective: str) -> None:
    """Two predators in three dimensions catch agents, which listen to their k nearest."""
    given = ("stubborn-leaders", FixedRange(2.0), FixedRange(3.0))
    found, grid = fe.compare(VARIANT, *given, objective=objective, max_range=4.0, **FEW), np.arange(5.0)
    best = fe.sweep(VARIANT, grid, TUNING[:3]).best_range(objective)
    search = fe.sweep(VARIANT, grid, HELD_OUT[:4])
    np.testing.assert_equal(vars(found.search), vars(search))
    every = [fe.rollout(VARIANT, each, HELD_OUT[:4], max_range=4.0) for each in (FixedRange(best), *given)]
    values = [getattr(each, objective) for each in every]
    values.insert(1, search.hindsight_oracle(objective))
    np.testing.assert_equal([*found.values.values()], values)
    fixed, _, _, two, three = found.played
    assert (fixed, two, three) == (f"best fixed range ({best:g} neighbors)", "FixedRange", "FixedRange (2)")
    assert [found.rows[name].mean_heard for name in (fixed, two)] == [
        every[at].mean_heard.mean() for at in (0, 2)
    ]
    assert found.table().shape == (5 * 4, 5)
    assert str(found).splitlines()[-1].startswith("| FixedRange (2) | ")
    assert len(found.plot().axes[0].get_lines()) == 5


def test_fixed_ranges_flee_from_the_predator_policy_and_a_short_grid_is_said() -> None:
    hunted = small_flock().with_learned_predators()
    found = fe.compare(hunted, "fixed:4", ranges=[4.0, 9.0], predator_policy=Pursue(), **FEW)
    np.testing.assert_array_equal(found.values["fixed:4"], found.search.values()[0])
    assert ("longer ones may be better" in str(found)) == (found.best_range == 9.0)


def test_the_command_prints_the_comparison(capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys, "compare", "fixed:0.3", "--scenario", "paper-line", "--flocks", 2)
    assert ran.out == f"{fe.compare('paper-line', 'fixed:0.3', num_flocks=2, num_tuning=2)}\n"


def test_a_learned_predator_is_judged_saved_watched_and_compared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It hunts the flock of its training, with its options; the smaller the distance, the better."""
    file, best = tmp_path / "hunter.npz", tmp_path / "best"
    env = vec_env(small_flock(), 2, side="predator", flock_policy="stubborn-leaders", max_range=30.0)
    judge = FlockEvalCallback(5, 3, best_model_save_path=best)
    model = PPO("MlpPolicy", env, **SETTINGS, batch_size=10, policy_kwargs={"activation_fn": Tanh})
    fe.save_policy(model.learn(20, callback=judge), file)
    assert judge.best_objective == min(objective for _, objective in judge.history)
    assert (fe.load_policy(file).opponent, env.flock_policy.name) == ("stubborn-leaders",) * 2
    found = fe.compare(None, file, Pursue("centroid"), side="predator", **FEW)
    hunted, every = fe.load_policy(file).scenario, {}
    for name, each in {"PPO": file, **{name: name for name in PREDATORS}}.items():
        hunt: Any = {"predator_policy": each, "max_range": 30.0}
        every[name] = [
            fe.rollout(hunted, "stubborn-leaders", seeds, **hunt).min_mean_distance
            for seeds in (TUNING[:3], HELD_OUT[:4])
        ]
    best_one = min(PREDATORS, key=lambda name: every[name][0].mean())
    names = (f"best built-in predator ({best_one})", "PPO", "pursue-centroid")
    expected = {name: every[played][1] for name, played in zip(names, (best_one, *names[1:]), strict=True)}
    np.testing.assert_equal(found.values, expected)
    smaller = (expected["PPO"] < expected[names[0]]) + (expected["PPO"] == expected[names[0]]) / 2
    assert found.rows["PPO"].improvement.mean == smaller.mean()
    with pytest.raises(fe.InputError, match="plot: expected a comparison of ranges"):
        found.plot()
    found.write(str(best))
    assert (best / "table.md").read_text() == f"{found}\n"
    run = fe.simulate(
        hunted, policy="stubborn-leaders", seed=4, predator_policy=PPO.load(best / "best_model")
    )
    ran = Ran(capsys, "simulate", "stubborn-leaders", "--predator", f"PPO:{best}", "--seed", 4, "--json")
    assert ran.json()["min_mean_distance"] == run.mean_distance.min()


def test_a_trained_flock_plays_against_the_opponent_of_its_training(tmp_path: Path) -> None:
    """Another one can be given, and must be if the file cannot name it."""
    hunted = small_flock().with_learned_predators()
    for number, hunter in enumerate((Pursue(), SimpleNamespace(act=Pursue().act))):
        env, file = vec_env(hunted, predator_policy=hunter), tmp_path / f"{number}.npz"
        fe.save_policy(A2C("MlpPolicy", env, **SETTINGS, policy_kwargs={"activation_fn": Tanh}), file)
    named, unnamed = tmp_path / "0.npz", tmp_path / "1.npz"
    played = [fe.rollout(named, 2, **each).min_mean_distance for each in ({}, {"predator_policy": "pursue"})]
    np.testing.assert_array_equal(*played)
    straight = fe.rollout(named, 2, predator_policy="fly-straight").min_mean_distance
    assert not np.array_equal(straight, played[0])
    given = fe.rollout(unnamed, HELD_OUT[:4], predator_policy=Pursue()).min_mean_distance
    found = fe.compare(None, unnamed, predator_policy="pursue", **FEW)
    np.testing.assert_array_equal(found.values["A2C"], given)
    for play in (fe.rollout, lambda file, _: fe.compare(None, file, **FEW)):
        with pytest.raises(fe.InputError, match="A2C, trained against 'SimpleNamespace': predator_policy: e"):
            play(unnamed, 1)


@pytest.mark.parametrize("reward", ["team", "individual"])
@pytest.mark.parametrize(("algorithm", "policy"), [(A2C, "MlpPolicy"), (RecurrentPPO, "MlpLstmPolicy")])
def test_without_wrappers_outcomes_are_those_of_a_rollout(algorithm: Any, policy: str, reward: str) -> None:
    """Flocks that end early and a chunk that is not full change nothing."""
    env, other = (vec_env(doomed(num_agents=5), 2, per_agent=True, reward=reward) for _ in range(2))
    model = algorithm(policy, other, **SETTINGS)
    expected = vars(fe.rollout(model, [7, 3, 3, 3], batch_size=2))  # torch rounds 5 and 10 rows differently
    for wrapped in (env, VecMonitor(env)):
        played = vars(fe.rollout(model, [7, 3, 3], env=wrapped))
        np.testing.assert_equal(played, {name: column[:3] for name, column in expected.items()})
        with pytest.raises(fe.ResetNeededError):
            wrapped.step(np.zeros((10, 1), np.float32))


def wrapped() -> Any:
    """Return an environment with own observations; docs/your-own-parts.md has a wrapper of a user."""
    return VecFrameStack(VecNormalize(vec_env(small_flock(), 2, per_agent=True)), 2)


def test_an_own_observation_is_trained_judged_and_compared() -> None:
    """Statistics of a VecNormalize follow the training's, and do not learn from evaluations."""
    callback = FlockEvalCallback(5, 3, eval_env=wrapped())

    def trained(judge: Any) -> Any:
        return PPO("MlpPolicy", wrapped(), **SETTINGS, batch_size=50).learn(100, callback=judge)

    models = [trained(judge) for judge in (callback, None)]
    parts = [[part.detach().numpy() for part in model.policy.parameters()] for model in models]
    np.testing.assert_equal(*parts)  # the callback does not change the training
    statistics, env = models[0].get_vec_normalize_env().obs_rms, callback.eval_env
    judged = fe.rollout(models[0], TUNING[:3], env=env)
    assert judged.min_mean_distance.mean() == callback.history[-1][1]
    assert (env.venv.training, env.venv.obs_rms.count) == (True, statistics.count)
    found = fe.compare(None, models[0], "stubborn-leaders", env=env, **FEW)
    played = fe.rollout(models[0], HELD_OUT[:4], env=env)
    np.testing.assert_array_equal(found.values["PPO"], played.min_mean_distance)
    with pytest.raises(fe.InputError, match="eval_env: expected another environment"):
        models[0].learn(10, callback=FlockEvalCallback(5, eval_env=models[0].env))


PLAIN = vec_env(small_flock(), 2, per_agent=True)
MODEL = A2C("MlpPolicy", vec_env(small_flock(), per_agent=True), **SETTINGS)
HUNTER = PredatorNetwork(Architecture(("speed",), ()), np.zeros(4))
HUNTS: dict[str, Any] = {"side": "predator"}
BAD: dict[str, tuple[tuple[Any, ...], dict[str, Any], str]] = {
    "no policies": (("paper-flock",), {}, "policies: expected at least one policy, got none"),
    "no predator": (
        (VARIANT.replace(predators=()), "random"),
        {"max_range": 8},
        "scenario: expected predators",
    ),
    "objective": (("paper-line", "random"), {"objective": "min_mean_distance"}, "objective: expected one of"),
    "rule's view": (("paper-flock", "stubborn-leaders"), {"per_agent": False}, "per_agent: expected True"),
    "model": (("paper-line", "per-agent-visible/search"), {}, "policy: expected a policy for a line"),
    "range": (("pursuit", "random"), {"max_range": 8, "ranges": [9]}, "ranges: expected at most max_range"),
    "trained": (("paper-flock", "one-range/ppo"), {"max_range": 8}, "max_range: expected .* from the policy"),
    "no flocks": ((None, MODEL), {"env": vec_env("paper-line")}, "env: expected flocks of sb3.vec_env"),
    "scenarios": ((None, MODEL), {"env": vec_env(["pursuit", "capture"], 2)}, "env.scenarios: expected"),
    "spaces": ((None, MODEL), {"env": VecFrameStack(PLAIN, 2)}, "env.observation_space: expected Box"),
    "statistics": ((None, MODEL), {"env": VecNormalize(PLAIN)}, "env: expected a VecNormalize if and only"),
    "scenario": (("pursuit", MODEL), {"env": PLAIN}, "scenario: expected that of env"),
    "options": ((None, MODEL), {"env": PLAIN, "max_range": 9}, "max_range: expected 40.0 from env, got 9"),
    "view": ((None, MODEL), {"env": PLAIN, "per_agent": False}, "per_agent: expected that of env, True"),
    "flock": (("pursuit", "random"), {"flock_policy": "random"}, "flock_policy: expected None beside side="),
    "flock's": (("pursuit", "pursue"), {}, "policy: expected a policy that sets ranges"),
    "predator's": (("pursuit", "random"), HUNTS, "predator_policy: expected fly-straight, pursue, "),
    "none": (("pursuit", None), HUNTS, "predator_policy: expected fly-straight, pursue, "),
    "line": (("paper-line", "pursue"), HUNTS, "scenario: expected a flock, which predators can hunt"),
    "ranges": (("pursuit", "pursue"), {**HUNTS, "ranges": [9]}, "ranges: expected None beside side="),
    "dimension": ((VARIANT, HUNTER), HUNTS, "PredatorNetwork: dimension: expected 2"),
    "hunted": (("pursuit", "pursue"), {**HUNTS, "flock_policy": HUNTER}, "flock_policy: expected a policy"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused_before_anything_is_played(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    arguments, options, message = BAD[name]
    for played in ("sweep", "play"):
        monkeypatch.delattr(compare, played)
    with pytest.raises(fe.InputError, match=message):
        fe.compare(*arguments, **options)
