"""``compare``: an own scenario beside the best fixed range; bad input is refused before a flock is played."""

from typing import Any

import numpy as np
import pytest
from cli_runs import Ran

import flockesc_env as fe
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.policies import FixedRange, Pursue, compare
from flockesc_env.scenario import ConstantVelocity, PurePursuit, Topological

VARIANT = fe.FlockScenario(
    num_agents=12,
    num_steps=24,
    dimension=3,
    initial_side=20.0,
    predators=(ConstantVelocity((-9.0,) * 3, (6.0,) * 3), PurePursuit((-9.0, 0.0, 0.0), (9.0, 2.0, 2.0))),
    capture_radius=3.0,
    neighbor_rule=Topological(),
)
FEW: dict[str, Any] = {"num_flocks": 4, "num_tuning": 3}


@pytest.mark.parametrize("objective", ["min_min_distance", "fraction_surviving"])
def test_an_own_scenario_is_compared_as_by_hand(objective: str) -> None:
    """Two predators in three dimensions catch agents, which listen to their k nearest."""
    given = ("stubborn-leaders", FixedRange(3.0), FixedRange(4.0))
    found = fe.compare(VARIANT, *given, objective=objective, max_range=8.0, **FEW)
    grid = np.arange(9.0)
    best = fe.sweep(VARIANT, grid, TUNING[:3]).best_range(objective)
    np.testing.assert_array_equal(found.search.interaction_ranges, grid)
    expected = [fe.sweep(VARIANT, [best], HELD_OUT[:4]).values(objective)[0]]
    expected.append(fe.sweep(VARIANT, grid, HELD_OUT[:4]).hindsight_oracle(objective))
    episodes = [fe.rollout(VARIANT, policy, HELD_OUT[:4], max_range=8.0) for policy in given]
    expected += [getattr(each, objective) for each in episodes]
    np.testing.assert_equal([*found.values.values()], expected)
    names = [f"best fixed range ({best:g} neighbors)", compare.ORACLE, "stubborn-leaders"]
    assert [*found.rows] == [*names, "FixedRange", "FixedRange (2)"]
    loads = [{name: getattr(each, name) for name in ("mean_range", "mean_heard")} for each in episodes]
    np.testing.assert_equal([*found.loads.values()][2:], loads)
    fixed = fe.rollout(VARIANT, FixedRange(best), HELD_OUT[:4])
    np.testing.assert_array_equal(next(iter(found.loads.values()))["mean_heard"], fixed.mean_heard)
    assert found.rows["FixedRange"].mean_heard == pytest.approx(loads[1]["mean_heard"].mean())
    assert found.table().shape == (5 * 4, 5)
    lines = str(found).splitlines()
    assert lines[-1].startswith("| FixedRange (2) | ")
    assert "a flock of 12 agents" in lines[0]
    assert ("longer ones may be better" in str(found)) == (best == 8)
    assert [len(found.plot(against).axes[0].get_lines()) for against in ("range", "heard")] == [5, 5]


def test_fixed_ranges_flee_from_the_predator_policy_too() -> None:
    hunted = fe.FlockScenario(num_agents=8, num_steps=24, initial_side=20.0).with_learned_predators()
    found = fe.compare(hunted, "fixed:4", ranges=[4.0, 2.0], predator_policy=Pursue(), **FEW)
    np.testing.assert_array_equal(found.values["fixed:4"], found.search.values()[1])


BAD: dict[str, tuple[Any, tuple[Any, ...], dict[str, Any], str]] = {
    "no policies": ("paper-flock", (), {}, "policies: expected at least one policy, got none"),
    "no predator": (VARIANT.replace(predators=()), ("fixed:3",), {"max_range": 8}, "scenario: expected pred"),
    "no capture": ("paper-flock", ("fixed:3",), {"objective": "fraction_surviving"}, "scenario: expected ca"),
    "objective": ("paper-line", ("fixed:0.3",), {"objective": "min_mean_distance"}, "objective: expected"),
    "view": ("paper-flock", ("stubborn-leaders",), {"per_agent": False}, "leaders: per_agent: expected True"),
    "model": ("paper-line", ("per-agent-visible/search",), {}, "policy: expected a policy for a line"),
    "range": ("paper-flock", ("fixed:3",), {"max_range": 8, "ranges": [9]}, "ranges: expected at most max_r"),
    "trained": (
        "paper-flock",
        ("one-range/ppo",),
        {"max_range": 8},
        "max_range: expected .* from the policy",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused_before_anything_is_played(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario, policies, options, message = BAD[name]
    for played in ("sweep", "play"):
        monkeypatch.delattr(compare, played)
    with pytest.raises(fe.InputError, match=message):
        fe.compare(scenario, *policies, **options)


def test_the_command_prints_the_comparison(capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys, "compare", "fixed:0.3", "--scenario", "paper-line", "--flocks", 2)
    assert ran.out == f"{fe.compare('paper-line', 'fixed:0.3', num_flocks=2, num_tuning=2)}\n"
    ran = Ran(capsys, "compare", "fixed:0.3", "--task", "line", "--objective", "escape_distance")
    assert "objective: expected none beside --task, which has escape_distance" in ran.err
