"""Every consumer takes every part, objective and view of the core's tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
from argument_table import FLOCK as PLAIN
from argument_table import PARTS, SLOTS
from captured_flocks import hunted
from cli_runs import Ran
from objective_values import VALUES
from same import same
from study_folders import write_study
from training.arguments import CompareArgs
from training.config import Setting, make_args
from training.evaluation import objective
from training.outputs import begin

import flockesc_env as fe
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, OBJECTIVES, ObjectiveSpec
from flockesc_env.episodes.options import EnvOptions, View
from flockesc_env.policies import Planner
from flockesc_env.render import draw
from flockesc_env.render.canvas import Canvas
from studies.findings import figures
from studies.findings.results import load_study
from studies.findings.summary import summarize
from training import plots
from training.compare import compare

SEED = 3
FLOCK, LINE = hunted(), fe.LineScenario(num_agents=20)
MAX_RANGE = {"flock": 20.0, "line": 1.0}

every = pytest.mark.parametrize("spec", OBJECTIVES, ids=lambda spec: spec.name)
of_flocks = pytest.mark.parametrize("spec", FLOCK_OBJECTIVES.values(), ids=lambda spec: spec.name)


@pytest.mark.parametrize(("slot", "part"), PARTS)
def test_a_part_is_simulated_played_stored_and_drawn(
    slot: str, part: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    scenario = PLAIN.replace(**{slot: SLOTS[slot][0](part)})
    run = fe.simulate(scenario, 2.0, seed=SEED)
    episodes = fe.rollout(scenario, fe.FixedRange(2.0), [SEED], max_range=4.0)
    assert episodes.min_mean_distance.tolist() == [run.mean_distance.min()]
    swept = fe.sweep(scenario, [2.0], [SEED])
    assert swept.values().tolist() == [[run.mean_distance.min()]]

    fe.save_run(run, tmp_path / "run.npz")
    same(fe.replay_run(fe.load_run(tmp_path / "run.npz").trajectory), run)
    draw(run, run.scenario.num_steps)
    file = tmp_path / "scenario.toml"
    file.write_text(scenario.to_toml())
    ran = Ran(capsys, "simulate", "--scenario", file, "--interaction-range", 2.0, "--seed", SEED, "--json")
    assert ran.json()["min_mean_distance"] == run.mean_distance.min()
    begin(make_args("search", {"scenario": str(file), "run": tmp_path / "run", "max_range": 4.0}))


@pytest.mark.parametrize("view", View)
def test_a_view_is_played_in_both_languages_stored_and_trained(view: View, tmp_path: Path) -> None:
    options = EnvOptions(max_range=20.0)
    batch = FlockBatch(FLOCK, options, num_flocks=2, view=view)
    observations, _ = batch.reset(range(2), [SEED, SEED + 1])
    spec = batch.policy_spec
    assert observations.shape == (2 * spec.rows, len(spec.layout.names))
    assert (spec.layout.low <= observations).all()
    assert (observations <= spec.layout.high).all()
    architecture = fe.Architecture(spec.layout.names, hidden=())
    parameters = np.random.default_rng(0).normal(size=architecture.size)
    network = fe.NetworkPolicy(architecture, parameters)

    class InPython(fe.NetworkPolicy):
        """Has the same actions, but is played by the loop in Python."""

    arguments: Any = {"seeds": [SEED, SEED + 1], "per_agent": view.is_per_agent, "max_range": 20.0}
    played = fe.rollout(FLOCK, network, **arguments)
    same(fe.rollout(FLOCK, InPython(architecture, parameters), **arguments), played)
    named = fe.NamedPolicy(
        "mine", network, per_agent=view.is_per_agent, options={"max_range": 20.0}, scenario=FLOCK
    )
    fe.save_policy(named, tmp_path / "policy.npz")
    same(fe.rollout(None, fe.load_policy(tmp_path / "policy.npz"), [SEED, SEED + 1]), played)
    for kind in ("search", "ppo"):
        args = make_args(
            kind, {"scenario": "capture", "per_agent": view.is_per_agent, "run": tmp_path / kind}
        )
        begin(args)


def expected(name: str, rho: float) -> float:
    """Return the objective from the positions of a run with a fixed range."""
    if name == "escape_distance":
        return float(np.abs(fe.simulate(LINE, rho, seed=SEED).states[-1] - LINE.predator_position).min())
    run = fe.simulate(FLOCK, rho, seed=SEED)
    offsets = run.positions[:, :, np.newaxis] - run.predator_positions[:, np.newaxis]
    distances = np.linalg.norm(offsets, axis=-1).min(axis=-1)
    is_free = (run.caught_at < 0) | (run.caught_at > np.arange(len(distances))[:, np.newaxis])
    return min(VALUES[name](row[free], len(row)) for row, free in zip(distances, is_free, strict=True))


def three(max_range: float = MAX_RANGE["flock"]) -> fe.NamedPolicy:
    return fe.NamedPolicy("three", fe.FixedRange(3.0), options={"max_range": max_range}, scenario=FLOCK)


@every
def test_results_training_and_commands_have_the_objective(
    spec: ObjectiveSpec, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    scenario: Any = FLOCK if spec.model == "flock" else LINE
    rho = MAX_RANGE[spec.model] / 2  # the action 0, which is exact
    result: fe.FlockSweepResult | fe.LineSweepResult = fe.sweep(scenario, [rho], [SEED])
    value = float(result.values(spec.name)[0, 0])
    assert value == pytest.approx(expected(spec.name, rho), rel=1e-12)
    assert result.plot(spec.name).axes[0].get_ylabel() == spec.with_unit(spec.symbol)
    episodes = fe.rollout(scenario, fe.FixedRange(rho), [SEED], max_range=MAX_RANGE[spec.model])
    assert spec.values(episodes).tolist() == [value]

    file = tmp_path / "scenario.toml"
    file.write_text(scenario.to_toml())
    flags: list[object] = ["--scenario", file if spec.model == "flock" else "paper-line"]
    flags += [] if spec.model == "flock" else ["--set", "num_agents=20"]
    searched = ["--interaction-ranges", rho, "--seeds", f"{SEED}:{SEED + 1}", "--objective", spec.name]
    document = Ran(capsys, "sweep", *flags, *searched, "--json").json()
    assert (document["objective"], document["hindsight_oracle"]) == (spec.name, value)
    assert spec.with_unit(spec.symbol) in Ran(capsys, "sweep", *flags, *searched).out
    fixed = ["--interaction-range", rho, "--seed", SEED]
    assert Ran(capsys, "simulate", *flags, *fixed, "--json").json()[spec.column] == value
    assert spec.with_unit(spec.symbol) in Ran(capsys, "simulate", *flags, *fixed).out

    if spec.model == "flock":
        fields = {"scenario": str(file), "per_agent": False, "objective": spec.name}
        for kind in ("search", "ppo", "tqc"):
            args = make_args(kind, {**fields, "run": tmp_path / kind})
            begin(args)
            assert objective(args, fe.FixedRange(rho), [SEED]).tolist() == [value]


@of_flocks
def test_pictures_and_the_planner_have_the_objective(spec: ObjectiveSpec) -> None:
    options: Any = {"objective": spec.name, "max_range": 20.0}
    env = fe.FlockEscapeEnv(FLOCK, render_mode="rgb_array", **options)
    env.reset(seed=SEED)
    has_ended = False
    while not has_ended:
        _, _, terminated, truncated, info = env.step(np.zeros(1, np.float32))
        has_ended = terminated or truncated
    run = fe.simulate(FLOCK, 10.0, seed=SEED)
    with mock.patch.object(Canvas, "text", autospec=True, return_value=9) as text:
        env.render()
        draw(run, FLOCK.num_steps, objective=spec.name)  # type: ignore[arg-type]
    value = expected(spec.name, 10.0)
    shown = f"{spec.symbol} {spec.text(value)}"
    assert [call.args[1] for call in text.call_args_list].count(shown) == 2
    assert info[spec.column] == pytest.approx(value, rel=1e-12)
    planner = Planner(FLOCK, ranges=[10.0], futures=[10.0], **options)
    assert planner.play(SEED).objective == info[spec.column]


@of_flocks
def test_a_comparison_has_the_objective(spec: ObjectiveSpec, tmp_path: Path) -> None:
    args = CompareArgs(
        policies=(f"{__name__}:three",),
        objective=spec.name,  # type: ignore[arg-type]
        output=tmp_path,
        flocks=4,
        tuning_flocks=2,
        grid_size=2,
    )
    drawn: list[Any] = []
    with mock.patch.object(plots, "save_figure", side_effect=lambda figure, _: drawn.append(figure)):
        table = compare(args)
    episodes = fe.rollout(FLOCK, fe.FixedRange(3.0), range(2_000_000, 2_000_004), max_range=20.0)
    assert table["objective"][-1] == pytest.approx(spec.values(episodes).mean(), rel=1e-12)
    against_range, over_time, under_attack = drawn
    assert against_range.axes[0].get_ylabel() == spec.with_unit(spec.symbol)
    assert over_time.axes[0].get_ylabel() == spec.with_unit(spec.label)
    titles = [part.get_suptitle() for part in under_attack.subfigs]
    assert all(f": {spec.symbol} " in title and title.endswith(" m") == bool(spec.unit) for title in titles)
    assert (" in m on " in (tmp_path / "table.md").read_text()) == bool(spec.unit)


@of_flocks
def test_studies_have_the_objective(spec: ObjectiveSpec, tmp_path: Path) -> None:
    values = np.linspace(0.5, 1.0, 6)
    folder = write_study(
        tmp_path, "shared", {"best fixed range": values}, {"search": values[np.newaxis]}, objective=spec.name
    )
    study = load_study(folder)
    assert figures.objective_label(study) == spec.with_unit(spec.symbol)
    (axes,) = figures.gains(summarize([study])).axes
    unit = spec.unit or "no unit"
    assert axes.get_xlabel() == f"{spec.label}: gain over the best fixed range ({unit})"


def test_an_objective_that_the_scenario_cannot_change_is_refused(tmp_path: Path) -> None:
    fields: dict[str, Any] = {"objective": "survival", "run": tmp_path / "run"}
    for call in (
        lambda: begin(make_args("search", fields)),
        lambda: compare(CompareArgs(policies=("random",), objective="survival", output=tmp_path / "run")),
    ):
        with pytest.raises(fe.ArgumentError, match="scenario: expected capture_radius"):
            call()
    assert not (tmp_path / "run").exists()
    assert Setting(scenario="capture", objective="survival").spec.unit == ""
