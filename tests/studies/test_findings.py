"""The study of learned ranges: its page, its measurements against loops and replays, a tiny run of all."""

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from cli_runs import Cli
from option_table import small_flock

import flockesc_env as fe
from flockesc_env import FlockScenario
from flockesc_env.cli.output import Exit
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.jobs import Cache, Job, find_backend
from flockesc_env.scenario import GivenHeadings, GivenPositions
from studies.__main__ import STUDIES
from studies.findings import controls, headlines, listening, loads, losses, styles
from studies.findings.report import Findings, report
from studies.measurements import Runner, play, policy_of
from studies.study import REPORT

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results" / "findings"
HEADLINES = {one.task.name: one for one in headlines.load(COMMITTED)}
SCENARIO = small_flock(num_agents=8, num_steps=18, predator_range=45.0)


@pytest.mark.parametrize("task", headlines.EXPLAINED)
def test_headline_policies_fit_their_tasks_and_replay_bit_for_bit(task: str) -> None:
    one = HEADLINES[task]
    one.task.setup(one.entry)
    assert str(one.file.relative_to("scoreboard")) in headlines.candidates(task)[one.file.parts[-3]]
    flocks, table = HELD_OUT[:2], pl.read_parquet(COMMITTED / controls.BLOCKED_FILE).filter(policy=task)
    for blocked in controls.BLOCKED:
        scenario = one.task.scenario.replace(blocks_warnings=blocked)
        kept = table.filter(blocked=blocked)[: len(flocks)]
        played = play(one.content, scenario, one.task.spec.name, {}, flocks)["objective"]
        assert kept["objective"].to_list() == played.tolist()
        fixed = play(f"fixed:{one.task.best_fixed_range:g}", scenario, one.task.spec.name, {}, flocks)[
            "objective"
        ]
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
    played = play(one.content, scenario, one.task.spec.name, {}, HELD_OUT[:2])["objective"]
    assert kept["objective"].to_list() == played.tolist()
    fixed = fe.sweep(scenario, kept["interaction_range"][:1], HELD_OUT[:2])
    assert kept["fixed"].to_list() == one.task.spec.values(fixed)[0].tolist()


def test_the_best_fixed_range_is_that_of_tuning_flocks(tmp_path: Path) -> None:
    one, runner = HEADLINES["one-range"], Runner(Cache(tmp_path), find_backend("serial"))
    (row,) = losses.play([one], {"small": SCENARIO}, 6, 1.0, runner)
    table = pl.DataFrame(row)
    tuned = fe.sweep(SCENARIO, SCENARIO.search_ranges, TUNING[:12]).min_mean_distance.mean(axis=1)
    assert set(table["interaction_range"]) == {SCENARIO.search_ranges[int(tuned.argmax())]}
    played = play(one.content, SCENARIO, one.task.spec.name, {}, HELD_OUT[:6])["objective"]
    assert table["objective"].to_list() == played.tolist()
    fixed = fe.sweep(SCENARIO, table["interaction_range"][:1], HELD_OUT[:6]).min_mean_distance[0]
    assert table["fixed"].to_list() == fixed.tolist()


def test_gains_at_equal_load_are_over_the_line_between_the_two_nearest_fixed_ranges() -> None:
    fixed = {"heard": np.array([[0.0, 0.0], [1.0, 3.0], [5.0, 7.0]])}
    fixed["objective"] = np.array([[1.0, 2.0], [3.0, 8.0], [7.0, 4.0]])
    played = {"heard": np.array([[0.0, 2.0], [4.0, 6.0]]), "objective": np.array([[9.0, 9.0], [9.0, 9.0]])}
    np.testing.assert_array_equal(loads.at_equal_load(played, fixed), [[7.0, 4.0], [3.0, 4.0]])
    same = {name: values[[1]] for name, values in fixed.items()}
    np.testing.assert_array_equal(loads.at_equal_load(same, fixed), [[0.0, 0.0]])


def test_loads_are_those_of_the_scoreboards_flocks() -> None:
    """The objectives are those that the scoreboard holds, and loads those of ``rollout``."""
    for name, load in loads.loads(COMMITTED).items():
        task = fe.tasks[name]
        for kind, entrant in {"learner": load.learner, "rule": load.rule}.items():
            result = fe.taskset.read_result(Path("scoreboard") / entrant / f"{name}.json")
            values = result.values(next(iter(task.scales)))[:, : loads.FLOCKS]
            assert load.objective[kind] == pytest.approx(values.mean(), rel=1e-12)
    flocks, task = HELD_OUT[:2], fe.tasks["per-agent-visible"]
    played = loads.play(("fixed:12", task.rule), task.name, flocks)
    for row, (policy, options) in enumerate({"fixed:12": {}, task.rule: task.options}.items()):
        episodes: Any = fe.rollout(task.scenario, policy, flocks, per_agent=True, **options)
        assert played["heard"][row].tolist() == episodes.mean_heard.tolist()


class Forgetful:
    """A policy with a memory for which every action is the first of an episode."""

    def __init__(self, policy: fe.NetworkPolicy) -> None:
        self.policy = policy

    def act(self, observations: Any, spec: Any) -> Any:
        self.policy.reset(np.ones(len(observations), bool))
        return self.policy.act(observations, spec)


def test_styles_are_those_of_single_runs_and_the_control_erases_the_memory() -> None:
    content = (headlines.BOARD / "gradient" / "policies" / f"{styles.TASK}-0.npz").read_bytes()
    found = styles.style(content, False, HELD_OUT[:2])
    for k, seed in enumerate(HELD_OUT[:2]):
        run = fe.simulate(FlockScenario(), policy=policy_of(content), seed=seed)
        ranges, toward = run.interaction_ranges[::4], run.predator_positions - run.positions
        heading = (toward * run.velocities).sum(axis=-1) / np.linalg.norm(toward, axis=-1) / 10
        listens, heads_toward = ranges >= 1, heading[:-1:4] >= 0.5
        assert found["objective"][k] == run.mean_distance.min()
        assert found["nobody"][k] == pytest.approx(1 - listens.mean())
        assert found["farthest"][k] == pytest.approx((ranges >= 19).mean())
        assert found["toward"][k] == pytest.approx(listens[heads_toward].mean(), abs=1e-3)  # at 60 degrees
        assert found["changes"][k] == pytest.approx((listens[1:] != listens[:-1]).sum() / 300 / 11.8)
    policy: Any = policy_of(content)
    options = {**vars(policy.policy_spec.options), "per_agent": True}
    played: Any = fe.rollout(FlockScenario(), Forgetful(policy), HELD_OUT[:2], **options)
    erased = styles.style(content, True, HELD_OUT[:2])["objective"]
    assert erased.tolist() == played.min_mean_distance.tolist()


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
    assert max(angles) < listening.largest_turn(neighbors) + 1e-9
    assert max(angles) == pytest.approx(listening.largest_turn(neighbors), abs=0.02)


@pytest.mark.parametrize("policy", ["stubborn-leaders", HEADLINES["per-agent-visible"].content])
def test_a_replay_without_exchange_is_the_run(policy: str | bytes) -> None:
    run = fe.simulate(FlockScenario(), policy=policy_of(policy), seed=5)
    assert controls.replay(run) == pytest.approx(run.mean_distance.min(), rel=1e-9)
    found = controls.exchange(policy, FlockScenario(), HELD_OUT[:2])
    assert (found["played"] - found["exchanged"]).mean() > 1


def test_all_is_measured_and_an_interrupted_study_continues(
    tmp_path: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch
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
    monkeypatch.setattr(loads, "TASKS", ("warned-agents",))
    monkeypatch.setattr(
        headlines, "candidates", lambda task: {file.partition("/")[0]: [file] for file in files[task]}
    )
    encircled = losses.scenarios()["encircled"]
    monkeypatch.setattr(losses, "scenarios", lambda: {"encircled": encircled})
    monkeypatch.setattr(losses, "starts", lambda: {"half the side": FlockScenario(initial_side=50.0)})
    flags = ["--output", tmp_path, "--backend", "serial", "--scale", "0.01"]
    run, jobs = Job.run, []

    def die(job: Job) -> Any:
        if job.function.endswith(":follow"):
            raise RuntimeError("killed")
        jobs.append(job)
        return run(job)

    with monkeypatch.context() as patch:
        patch.setattr(Job, "run", die)
        assert cli("findings", *flags, run=STUDIES.main).code != Exit.DONE
    finished, again = len(jobs), []
    monkeypatch.setattr(Job, "run", lambda job: again.append(job) or run(job))
    ran = cli("findings", *flags, run=STUDIES.main)
    assert ran.code == Exit.DONE, ran.err
    assert finished >= 10
    assert not {job.key for job in jobs} & {job.key for job in again}
    chosen = headlines.load(tmp_path)[0]
    contents = [(headlines.BOARD / file).read_bytes() for file in files["per-agent-visible"]]
    spec, scenario = chosen.task.spec, chosen.task.scenario
    means = [play(content, scenario, spec.name, {}, TUNING[:2])["objective"].mean() for content in contents]
    assert chosen.content == contents[int(np.argmax(means))]
    assert (tmp_path / REPORT).read_text("utf-8") == report(Findings.load(tmp_path))


@pytest.mark.parametrize("study", ["paper", "robustness", "scaling", "validation", "findings"])
def test_a_folder_that_cannot_be_written_is_refused_before_the_work(
    study: str, tmp_path: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: Any) -> None:
        raise AssertionError("continued before the folder was checked")

    monkeypatch.setattr("studies.__main__.require", never)
    (tmp_path / "file").touch()
    ran = cli(study, "--output", tmp_path / "file" / "folder", run=STUDIES.main)
    assert (ran.code, ran.out) == (Exit.REFUSED, "")
    assert "output: expected a folder that can be written (Not a directory), got " in ran.err
