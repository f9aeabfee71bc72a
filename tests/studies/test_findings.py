"""The study of learned ranges: its page, its measurements against loops and replays, a tiny run of all."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from cli_runs import Ran
from option_table import small_flock

import flockesc_env as fe
from flockesc_env import FlockScenario, save_policy, simulate
from flockesc_env.cli.exits import Exit
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.jobs import Cache, Job, find_backend
from flockesc_env.models.sweep import FLOCK_RANGES
from flockesc_env.policies import BasePolicy
from flockesc_env.policies.network import Architecture, NetworkPolicy
from flockesc_env.scenario import GivenHeadings, GivenPositions
from flockesc_env.tasks.fitting import check_fits
from studies.__main__ import STUDIES
from studies.findings import controls, headlines, listening, losses, one_agent
from studies.findings.page import Findings, markdown_page, outcome, rows_of
from studies.measurements import Runner, play

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results" / "findings"
HEADLINES = {one.task.name: one for one in headlines.load(COMMITTED)}
SCENARIO = small_flock(num_agents=8, num_steps=18, predator_range=45.0)
STEPS = 3


def test_the_committed_page_follows_from_the_committed_results() -> None:
    results, page = Findings.load(COMMITTED), ROOT / "docs" / "findings.md"
    text = page.read_text("utf-8")
    assert text == markdown_page(results, COMMITTED, page)
    assert all((page.parent / picture).is_file() for picture in re.findall(r"\]\((.*?\.png)\)", text))
    rows = rows_of(results.entries)
    lost = sum(outcome(row.gain) == "loss" for row in rows)
    readme = " ".join((ROOT / "README.md").read_text("utf-8").split())
    assert f"in {lost} of {len(rows)} tasks to an untrained rule" in readme


@pytest.mark.parametrize("task", headlines.EXPLAINED)
def test_headline_policies_fit_their_tasks_and_replay_bit_for_bit(task: str) -> None:
    one = HEADLINES[task]
    check_fits(one.entry, one.task)
    assert str(one.file.relative_to("scoreboard")) in headlines.candidates(task)[one.file.parts[-3]]
    flocks, table = HELD_OUT[:2], pl.read_parquet(COMMITTED / controls.BLOCKED_FILE).filter(policy=task)
    for blocked in controls.BLOCKED:
        scenario = one.task.scenario.replace(blocks_warnings=blocked)
        kept = table.filter(blocked=blocked)[: len(flocks)]
        played = play(one.content, scenario, one.task.spec.name, flocks)["objective"]
        assert kept["objective"].to_list() == played.tolist()
        fixed = play(f"fixed:{one.best_fixed_range:g}", scenario, one.task.spec.name, flocks)["objective"]
        assert kept["fixed"].to_list() == fixed.tolist()


@pytest.mark.parametrize(
    ("file", "name", "task"),
    [
        (losses.STARTS_FILE, "half the side", "one-range"),
        (losses.TRANSFER_FILE, "encircled", "per-agent-visible-minimum"),
        (losses.TRANSFER_FILE, "mutual", "per-agent-visible"),
    ],
)
def test_losses_replay_bit_for_bit(file: str, name: str, task: str) -> None:
    scenario, one = (losses.starts() | losses.scenarios())[name], HEADLINES[task]
    kept = pl.read_parquet(COMMITTED / file).filter(task=task, scenario=name)[:2]
    played = play(one.content, scenario, one.task.spec.name, HELD_OUT[:2])["objective"]
    assert kept["objective"].to_list() == played.tolist()
    fixed = fe.sweep(scenario, kept["interaction_range"][:1], HELD_OUT[:2])
    assert kept["fixed"].to_list() == one.task.spec.values(fixed)[0].tolist()


def test_the_best_fixed_range_is_that_of_tuning_flocks(tmp_path: Path) -> None:
    one, runner = HEADLINES["one-range"], Runner(Cache(tmp_path), find_backend("serial"))
    table = losses.play([one], {"small": SCENARIO}, 6, 1.0, runner)
    tuned = fe.sweep(SCENARIO, FLOCK_RANGES, TUNING[:12]).min_mean_distance.mean(axis=1)
    assert set(table["interaction_range"]) == {FLOCK_RANGES[int(tuned.argmax())]}
    played = play(one.content, SCENARIO, one.task.spec.name, HELD_OUT[:6])["objective"]
    assert table["objective"].to_list() == played.tolist()
    fixed = fe.sweep(SCENARIO, table["interaction_range"][:1], HELD_OUT[:6]).min_mean_distance[0]
    assert table["fixed"].to_list() == fixed.tolist()


def test_policies_that_cannot_run_are_left_out() -> None:
    profile, scenarios = HEADLINES["per-agent-visible-profile"], losses.scenarios()
    assert {name for name, scenario in scenarios.items() if not losses.can_run(profile, scenario)} == {
        "frozen-graph"
    }
    assert all(losses.can_run(HEADLINES["one-range"], scenario) for scenario in scenarios.values())


@pytest.mark.parametrize("neighbors", [1, 2])
def test_the_largest_turn_is_that_of_the_model(neighbors: int) -> None:
    """All neighbors head alike, at most 0.1 degrees off the best heading among these."""
    angles = []
    for heading in np.radians(np.arange(90.0, 180.0, 0.1)):
        others = [(np.cos(heading), np.sin(heading))] * neighbors
        flock = FlockScenario(
            num_agents=1 + neighbors,
            num_steps=1,
            initial_positions=GivenPositions(((0.0, 0.0),) * (1 + neighbors)),
            initial_headings=GivenHeadings(((1.0, 0.0), *others)),
            predators=(),
        )
        along, across = fe.simulate(flock, 1.0, seed=0).velocities[-1][0]
        angles.append(np.degrees(np.arctan2(across, along)))
    assert max(angles) < one_agent.largest_turn(neighbors) + 1e-9
    assert max(angles) == pytest.approx(one_agent.largest_turn(neighbors), abs=0.02)


@pytest.fixture(params=[True, False], ids=["visible", "local"])
def listener(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[BasePolicy, bytes]:
    """A policy whose ranges fall below ``SILENT`` at different times for different agents, and its file."""
    names = ("time", "predator_distance", "predator_direction_ahead")
    options: dict[str, Any] = {
        "max_range": 20.0,
        "steps_per_action": STEPS,
        "predator_sensing_range": math.inf if request.param else SCENARIO.predator_range,
    }
    policy = NetworkPolicy(Architecture(names, ()), [-3.0, 3.0, -0.8, -0.8])
    entry = policy.with_options(name="it", per_agent=True, scenario=SCENARIO, **options)
    save_policy(entry, tmp_path / "it.npz")
    return entry, (tmp_path / "it.npz").read_bytes()


def test_hidden_entries_are_constants(listener: tuple[BasePolicy, bytes]) -> None:
    """Against a loop that overwrites the observations of every agent."""
    entry, content = listener
    flocks = HELD_OUT[:3]
    column = controls.watch(entry, flocks)[0].index("predator_distance")
    found = controls.hide(content, "min_mean_distance", ((column, 0.7),), flocks)["objective"]
    env = fe.parallel_env(SCENARIO, **entry.options)
    for flock, objective in zip(flocks, found, strict=True):
        policy = entry.bind(env)
        observations, infos = env.reset(seed=flock)
        while env.agents:
            for observed in observations.values():
                observed[column] = 0.7
            observations, *_, infos = env.step(policy(observations))
        assert infos["agent_0"]["min_mean_distance"] == pytest.approx(objective, rel=1e-6)
    assert (found != play(content, SCENARIO, "min_mean_distance", flocks)["objective"]).any()


def test_ranges_over_time_and_by_place(listener: tuple[BasePolicy, bytes]) -> None:
    """Against loops over flocks, actions and agents."""
    entry, content = listener
    visible = entry.options["predator_sensing_range"] == math.inf
    kept = listening.listen(content, HELD_OUT[:12])
    runs = [simulate(SCENARIO, policy=entry, seed=seed) for seed in HELD_OUT[:12]]
    cosines, distances = kept["cosines"], kept["distances"]
    sums, counts, hidden = np.zeros((20, 24)), np.zeros((20, 24)), 0
    for action, step in enumerate(range(0, SCENARIO.num_steps, STEPS)):
        ranges = np.concatenate([run.interaction_ranges[step] for run in runs])
        assert kept["silent"][action] == np.mean([rho < listening.SILENT for rho in ranges])
        expected = np.quantile(ranges, [0.1, 0.25, 0.5, 0.75, 0.9])
        np.testing.assert_allclose(kept["quantiles"][:, action], expected, rtol=0, atol=1e-4)
        for run in runs:
            for agent in range(SCENARIO.num_agents):
                away = run.positions[step, agent] - run.predator_positions[step, 0]
                heading, distance = run.velocities[step, agent], np.linalg.norm(away)
                cosine = heading @ away / distance / np.linalg.norm(heading)
                if not visible and distance > SCENARIO.predator_range:
                    hidden += 1
                elif distances[0] <= distance <= distances[-1]:
                    at = np.searchsorted(cosines, cosine) - 1, np.searchsorted(distances, distance) - 1
                    sums[at] += run.interaction_ranges[step, agent]
                    counts[at] += 1
    assert (hidden > 0) != visible
    means = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
    np.testing.assert_allclose(kept["range_by_place"], means, rtol=0, atol=1e-3)
    np.testing.assert_allclose(kept["times"], np.arange(6) * STEPS * SCENARIO.time_step)


def test_all_is_measured_and_an_interrupted_study_continues(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {
        "per-agent-visible": [
            "ppo/policies/per-agent-visible-0.npz",
            "search/policies/per-agent-visible-0.npz",
        ],
        "per-agent-visible-derived": ["search/policies/per-agent-visible-derived-0.npz"],
        "per-agent-local": ["search/policies/per-agent-local-0.npz"],
    }
    monkeypatch.setattr(headlines, "EXPLAINED", tuple(files))
    monkeypatch.setattr(
        headlines, "candidates", lambda task: {file.partition("/")[0]: [file] for file in files[task]}
    )
    encircled = losses.scenarios()["encircled"]
    monkeypatch.setattr(losses, "scenarios", lambda: {"encircled": encircled})
    monkeypatch.setattr(losses, "starts", lambda: {"half the side": FlockScenario(initial_side=50.0)})
    flags = ["--output", tmp_path, "--page", tmp_path / "it.md", "--backend", "serial", "--scale", "0.01"]
    run, jobs = Job.run, []

    def die(job: Job) -> Any:
        if job.function.endswith(":follow"):
            raise RuntimeError("killed")
        jobs.append(job)
        return run(job)

    with monkeypatch.context() as patch:
        patch.setattr(Job, "run", die)
        assert Ran(capsys, "findings", *flags, run=STUDIES.main).code != Exit.DONE
    finished, again = len(jobs), []
    monkeypatch.setattr(Job, "run", lambda job: again.append(job) or run(job))
    ran = Ran(capsys, "findings", *flags, run=STUDIES.main)
    assert ran.code == Exit.DONE, ran.err
    assert finished > 10
    assert not {job.key for job in jobs} & {job.key for job in again}
    chosen = headlines.load(tmp_path)[0]
    column, scenario = chosen.task.spec.name, chosen.task.scenario
    means = {
        file: play((headlines.BOARD / file).read_bytes(), scenario, column, TUNING[:2])
        for file in files["per-agent-visible"]
    }
    best = max(means, key=lambda file: means[file]["objective"].mean())
    assert chosen.file == headlines.BOARD / best
    page = (tmp_path / "it.md").read_text("utf-8")
    assert page == markdown_page(Findings.load(tmp_path), tmp_path, tmp_path / "it.md")
    assert (tmp_path / "figures" / "policies.gif").stat().st_size > 10_000
    assert Ran(capsys, "findings-page", *flags[:4], run=STUDIES.main).code == Exit.DONE
    assert (tmp_path / "it.md").read_text("utf-8") == page


@pytest.mark.parametrize("study", ["paper", "robustness", "validation", "arms-race", "findings"])
def test_a_folder_that_cannot_be_written_is_refused_before_the_work(
    study: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: Any) -> None:
        raise AssertionError("continued before the folder was checked")

    monkeypatch.setattr("studies.__main__.require", never)
    (tmp_path / "file").touch()
    ran = Ran(capsys, study, "--output", tmp_path / "file" / "folder", run=STUDIES.main)
    assert (ran.code, ran.out) == (Exit.REFUSED, "")
    assert "output: expected a folder that can be written (Not a directory), got " in ran.err
