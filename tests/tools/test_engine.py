"""The core for web pages gives the same bits in Node as the native core."""

import hashlib
import json
import shutil
import subprocess
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from golden_episodes import CHASED, RANDOM, ZIGZAG, ranges
from network_outcomes import cases as networks
from network_outcomes import policy_of
from option_table import small_flock
from watch_documents import needs_engine

import flockesc_env as fe
from flockesc_env.common.array_files import read_document
from flockesc_env.common.checks import FloatArray
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.starts import as_start
from flockesc_env.models.graph import neighbor_pairs
from flockesc_env.policies.network import Architecture
from flockesc_env.scenario import PrescribedPath, Topological
from flockesc_env.scenario.options import EnvOptions, to_plain

ROOT = Path(__file__).parents[2]
ENGINE = ROOT / "flockesc_env" / "watch" / "engine"
SCRIPT = Path(__file__).parents[1] / "support" / "engine.mjs"
SEED, ACTIONS = 7, 40

pytestmark = [
    needs_engine,
    pytest.mark.skipif(not shutil.which("node"), reason="needs Node: `apt-get install nodejs`"),
]

Case = dict[str, Any]
VIEWS: list[tuple[bool, dict[str, Any]]] = [
    (False, {}),
    (True, {"reward": "individual_distance_change"}),
    (True, {"reward": "difference", "steps_per_action": 3}),  # plays a copy for every agent
]
far = partial(EnvOptions, action_mode="range", max_range=100.0)
UNEVEN = {"inputs": ["time"], "hidden": [3], "ranges": [0.3, 7.3, 17.9]}
"""A network that chooses from ranges that are no float32."""
BOX = pytest.param(fe.FlockScenario(predators=(), periodic_side=60.0, initial_side=60.0), id="torus")
EPISODE = {"kind": "episode", "scenario": "{}", "options": "{}", "seed": "0", "actions": [[[1.0], []]]}
ZEROS = [0.0] * 600
REFUSED: list[tuple[str, Any, str]] = [
    ("steps_per_action", 0, "expected an integer from 1 to "),
    ("min_range", -5, "expected a finite number of at least 0, got -5"),
    ("range_grid", [-1.0, 5.0], "expected ranges from 0.0 to 40.0"),
    ("action_mode", "range", "expected 'normalized', got 'range'"),
    ("profile_ranges", [5.0, 5.0], "expected increasing ranges"),
    ("predator_sensing_range", -1, ""),
    ("extra_entries", ["wings"], ""),
    ("reward", "no", ""),
    ("count_components", 1, ""),
    ("wings", 1, ""),
    ("view", "agent", ""),
]


def played_in_node(cases: list[Case]) -> list[Any]:
    command = ["node", "--experimental-default-type=module", str(SCRIPT), str(ENGINE)]
    ended = subprocess.run(  # noqa: S603
        command, input=json.dumps(cases), capture_output=True, text=True, check=True
    )
    return json.loads(ended.stdout)


def play(batch: FlockBatch, start: dict[str, Any] | None = None) -> tuple[Case, str]:
    """Play an episode with ranges, and actions of the learned predators, that differ in every step.

    Returns the episode as a case, and the hash of its states, observations and rewards in the native core.
    """
    begin = as_start(start, batch.scenario)
    batch.reset([0], [SEED], [begin])
    arrays = [begin["initial_positions"], begin["initial_velocities"]]
    case: Case = {
        "kind": "episode",
        "scenario": batch.scenario.to_json(),
        "options": batch.options.to_core(per_agent=batch.policy_spec.per_agent),
        "seed": str(SEED),
        "start": None if arrays[0] is None else [array.ravel().tolist() for array in arrays],
        "actions": [],
    }
    digest = hashlib.sha256()

    def note(rewards: FloatArray) -> None:
        state = batch.core.state(0)
        for name in ("positions", "velocities", "predator_positions", "predator_velocities"):
            digest.update(state[name].tobytes())
        digest.update(batch.core.observe([0]).tobytes() + rewards.tobytes())

    note(np.zeros(batch.rows))
    while not batch.core.has_ended(0) and len(case["actions"]) < ACTIONS:
        t, count, dimension = len(case["actions"]), batch.predator_policy_spec.count, batch.scenario.dimension
        pushes = ranges(t, count * dimension).astype(np.float64).reshape(-1, dimension) / 64
        rewards = batch.step(ranges(t, batch.rows), predator_actions=pushes if count else None)[1]
        case["actions"].append([batch.core.state(0)["interaction_range"].tolist(), pushes.ravel().tolist()])
        note(rewards)
    return case, digest.hexdigest()


def assert_equal_in_node(played: list[tuple[Case, Any]]) -> None:
    assert played_in_node([case for case, _ in played]) == [outcome for _, outcome in played]


def flocks() -> dict[str, fe.FlockScenario]:
    """Return all presets that environments take, and flocks with every option."""
    presets = {name: each.scenario for name, each in fe.PRESETS.items() if each.model is fe.FlockScenario}
    found = {name: flock for name, flock in presets.items() if flock.predators}
    path = PrescribedPath(ZIGZAG, interval=0.3)
    for dimension in (2, 3):
        small = small_flock(dimension, num_steps=ACTIONS, **RANDOM)
        found |= {
            f"everything, {dimension}D": small,
            f"learned, {dimension}D": small.with_learned_predators(),
            f"capture, {dimension}D": small_flock(dimension, num_steps=ACTIONS, **CHASED),
            f"a path, {dimension}D": small_flock(dimension, predators=(path,)),
            f"a large flock, {dimension}D": small_flock(
                dimension, num_agents=6000, num_steps=4, initial_side=500.0
            ),
        }
    return found


def test_flocks_of_both_views_have_the_same_bits() -> None:
    """Presets and large flocks in the agents' view alone."""
    played = [
        play(FlockBatch(scenario, far(**extra), per_agent=per_agent))
        for name, scenario in flocks().items()
        for per_agent, extra in (VIEWS[1:2] if name in fe.PRESETS or scenario.num_agents > 100 else VIEWS)
    ]
    for dimension in (2, 3):
        batch = FlockBatch(flocks()[f"everything, {dimension}D"], far())
        run = fe.simulate(batch.scenario, 9.0, seed=1)
        start = {"initial_positions": run.positions[9], "initial_velocities": run.velocities[9]}
        played += [play(batch, start)]
    assert_equal_in_node(played)


def header_of(scenario: fe.FlockScenario, architecture: Any, per_agent: bool, **options: Any) -> Case:
    parts = {"architecture": architecture, "per_agent": per_agent, "options": to_plain(options)}
    return {"name": "mine", "model": "flock", "scenario": json.loads(scenario.to_json()), **parts}


def network_case(
    scenario: fe.FlockScenario, policy: fe.NetworkPolicy, header: Case, **options: Any
) -> tuple[Case, list[Any]]:
    """Return an episode under a network as a case, and its result in the native core."""
    played = fe.rollout(scenario, policy, [SEED], per_agent=header["per_agent"], **options)
    chosen = EnvOptions(**options)
    case = {
        "kind": "network",
        "scenario": scenario.to_json(),
        "options": chosen.to_core(per_agent=header["per_agent"]),
        "seed": SEED,
        "header": json.dumps(header),
        "parameters": policy.parameters.tolist(),
    }
    lowest = played.min_min_distance if chosen.objective == "min_min_distance" else played.min_mean_distance
    return case, [lowest[0], played.num_components[0]]


def test_networks_set_the_same_ranges() -> None:
    cases = [
        (scenario, asdict(architecture), {"per_agent": False, **options})
        for scenario, architecture, options in networks().values()
        if isinstance(scenario, fe.FlockScenario)
    ]
    flock = small_flock(num_agents=40)
    grid = {"action_mode": "discrete", "range_grid": (0.0, 5.0, 7.0, 30.0)}
    cases += [(flock, UNEVEN, {"per_agent": True, **options}) for options in ({}, grid)]
    played = []
    for scenario, document, options in cases:
        lists = {name: tuple(value) for name, value in document.items() if isinstance(value, list)}
        policy = policy_of(Architecture(**{**document, **lists}))
        header = header_of(scenario, document, **options)
        played.append(
            network_case(scenario, policy, header, **{k: v for k, v in options.items() if k != "per_agent"})
        )
    assert_equal_in_node(played)


def test_stored_networks_set_the_same_ranges_on_a_flock_with_other_options() -> None:
    """The headers are those of the files, which lack fields in files of older versions."""
    played = []
    for path in sorted((ROOT / "scoreboard").glob("*/policies/*-0.npz")):
        header, _ = read_document(path, "a policy", "parameters")
        stored = fe.load_policy(path)
        if isinstance(stored.scenario, fe.FlockScenario) and isinstance(stored, fe.NetworkPolicy):
            short = stored.scenario.replace(num_steps=ACTIONS)
            case, outcome = network_case(short, stored, header, **stored.options)
            objective = EnvOptions(**stored.options).objective
            options = EnvOptions(objective=objective, steps_per_action=1).to_core(per_agent=True)
            played.append(({**case, "kind": "observed", "options": options}, outcome))
    assert len(played) > 9
    assert_equal_in_node(played)


def test_files_that_python_refuses_are_refused_by_name(tmp_path: Path) -> None:
    """Bounds have the same texts, because one check in the core serves both."""
    document = {"inputs": ["time"], "hidden": []}
    good = header_of(small_flock(), document, True, max_range=40.0)
    headers = [{**good, "options": {"max_range": 40.0, name: value}} for name, value, _ in REFUSED]
    changes: list[Case] = [
        {"scenario": {**good["scenario"], "num_agents": 0}},
        {"scenario": json.loads(small_flock(neighbor_rule=Topological()).to_json()), "options": {}},
        {"architecture": {**document, "inputs": ["wings"]}},
        {"architecture": {**document, "ranges": [50.0]}},
        {"per_agent": 1},
        {"name": None},
    ]
    headers += [{**good, **change} for change in changes]
    headers += [{key: good[key] for key in good if key != name} for name in good]
    messages = played_in_node(
        [{"kind": "refusal", "header": json.dumps(each), "parameters": [1, 2]} for each in [good, *headers]]
    )
    assert messages[0] is None
    rows = [(name, text) for name, _, text in REFUSED] + [("", "")] * (len(headers) - len(REFUSED))
    for header, message, (name, text) in zip(headers, messages[1:], rows, strict=True):
        assert message, header
        np.savez(tmp_path / "bad.npz", header=np.array(json.dumps(header)), parameters=np.ones(2))
        with pytest.raises(fe.InputError) as caught:
            fe.load_policy(tmp_path / "bad.npz")
        for found in (message, str(caught.value)):
            assert text in found
            assert name in found


@pytest.mark.parametrize("scenario", ["paper-flock", "topological", "voronoi", "field-of-view", "space", BOX])
def test_neighbor_graphs_are_the_same(scenario: fe.FlockScenario | str) -> None:
    run, rng = fe.simulate(scenario, 12.0, seed=SEED), np.random.default_rng(SEED)
    n = run.scenario.num_agents
    played = []
    for radii in (np.zeros(1), np.array([6.0]), rng.uniform(0.0, 15.0, n)):
        arrays = run.positions[-1], run.velocities[-1], radii
        case = {"kind": "graph", "scenario": run.scenario.to_json()}
        radius = radii if len(radii) == n else radii[0]
        native = neighbor_pairs(run.scenario, arrays[0], radius, velocities=arrays[1])
        played.append(({**case, "arrays": [a.ravel().tolist() for a in arrays]}, native.ravel().tolist()))
    assert_equal_in_node(played)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scenario": '{"num_agents": 0}'}, "num_agents: expected"),
        ({"options": '{"reward": "no"}'}, "reward: "),
        ({"actions": [[[1.0] * 3, []]]}, "ranges: expected 1 entries, got 3"),
        ({"actions": [[[1.0], [0.5]]]}, "predator_actions: expected 0 entries, got 1 entries"),
        ({"start": [[0.0], ZEROS]}, "initial_positions: expected 300 x 2 numbers, got 1 numbers"),
        ({"kind": "graph", "arrays": [[0.0] * 4, [0.0] * 2, [1.0]]}, "velocities: expected 4 numbers, got 2"),
        ({"kind": "graph", "arrays": [ZEROS, ZEROS, [1.0] * 3]}, "interaction_range: expected 300 ranges"),
    ],
)
def test_bad_input_is_an_error_that_names_it(changes: Case, message: str) -> None:
    with pytest.raises(subprocess.CalledProcessError) as error:
        played_in_node([{**EPISODE, **changes}])
    assert message in error.value.stderr
