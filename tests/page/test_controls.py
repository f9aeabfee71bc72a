"""Slider, keys, fingers, pointer and links."""

import re
from typing import Any

import browser
import numpy as np
import pytest
from browser import DUEL, OBJECTIVES, SEED, STATE, OpenAt, lowest, open_page, scenario, set_range, text, wait
from playwright.sync_api import Page

import flockesc_env as fe
from flockesc_env.models.graph import neighbor_pairs
from flockesc_env.watch.live import RANGES
from playground.__main__ import FIRST, HEADLINE, means


def test_a_range_flies_the_whole_run_and_shows_the_present_moment(tab: Page, open_at: OpenAt) -> None:
    open_at(f"seed={SEED}&policies=fixed:12,{HEADLINE}")
    tab.evaluate("page.seek(5)")
    wait(tab, "page.trials.size === 2")
    ranges = [0, 2, 16, 60]
    for rho in ranges:
        set_range(tab, rho)
        wait(tab, f"page.trials.has('fixed:{rho}')")  # the run has ended
        run = fe.simulate("paper-flock", rho, seed=SEED)
        assert text(tab, ".lowest") == f"{run.mean_distance[:101].min():.1f} m"
        assert text(tab, ".now-value") == f"now {run.mean_distance[100]:.1f} m"
        assert f"Your range: {rho} m{lowest(run):.1f}" in text(tab, "#answer tbody")
        assert tab.evaluate("[page.player.time, page.panels[0].run.objective]") == [5, lowest(run)]
    dots = tab.evaluate("[...page.trials.values()].map(({ range, objective }) => [range, objective])")
    learned = lowest(fe.simulate("paper-flock", policy=HEADLINE, seed=SEED))
    expected = fe.sweep("paper-flock", [12.0, *ranges], seeds=[SEED]).min_mean_distance[:, 0].tolist()
    assert sorted(map(str, dots)) == sorted(
        map(str, [[None, learned], *map(list, zip([12, *ranges], expected, strict=True))])
    )
    assert tab.locator("#trials .dot").count() == 5


PLAYS = ("page.player.isPlaying", {" ": True, "Space": False})  # one key
TIMES = {"Home": 0, "ArrowRight": 0.05, "Shift+ArrowRight": 1.05, "ArrowLeft": 1.0, "Shift+ArrowLeft": 0}
VIEWS = {
    "+": [1.25, 0, 0, 0],
    "ArrowRight": [1.25, -30, 0, 0],
    "ArrowUp": [1.25, -30, 30, 0],
    "0": [1, 0, 0, 0],
    "-": [0.8, 0, 0, 0],
}
KEYS: list[tuple[str, str, str, dict[str, Any]]] = [
    ("", "body", *PLAYS),
    ("", "#range", *PLAYS),
    ("", "#scrub", "page.player.time", TIMES | {"End": 12}),
    ("", ".panel canvas", "[page.camera.zoomFactor, ...page.camera.shift, page.player.time]", VIEWS),
    (
        "steer=you",
        ".panel canvas",
        "page.steering.pointer",
        {"ArrowLeft": [-35, -30], "ArrowUp": [-35, -25], "Escape": None},
    ),
]


def test_keys_play_and_move_time_camera_and_predator(tab: Page, open_at: OpenAt) -> None:
    for address, selector, state, keys in KEYS:
        open_at(f"policies=fixed:12&{address}")
        tab.focus(selector)
        for key, expected in keys.items():
            tab.keyboard.press(key)
            assert tab.evaluate(state) == pytest.approx(expected), key
    open_at("policies=fixed:12")
    tab.focus("#range")
    for key, rho in (("ArrowRight", 14), ("ArrowLeft", 12)):  # every key moves by one range
        tab.keyboard.press(key)
        wait(tab, f"page.panels[0].run.spec === 'fixed:{rho}'")
    ranges = "page.scenarios.map(({ ranges }) => ranges.map((each) => placeOf(each, ranges)))"
    assert all(places == [*range(len(places))] for places in tab.evaluate(ranges))


def test_two_fingers_zoom(tab: Page, open_at: OpenAt) -> None:
    open_at()
    box = tab.query_selector(".panel canvas").bounding_box()  # type: ignore[union-attr]
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    devtools = tab.context.new_cdp_session(tab)
    for kind, apart in (("touchStart", 40), ("touchMove", 60), ("touchMove", 80)):
        points = [{"x": x - apart, "y": y, "id": 0}, {"x": x + apart, "y": y, "id": 1}]
        devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    devtools.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    assert tab.evaluate("[page.camera.zoomFactor, page.player.time]") == pytest.approx([2, 0])


def test_links_that_follow_one_another_show_the_last_one(tab: Page, playground: str) -> None:
    """A chart draws the runs of the flock before later: none is freed."""
    open_page(tab, playground)
    links = [f"scenario=pursuit&policies=fixed:3,{HEADLINE}&seed=3", "policies=fixed:5&seed=4&t=1"]
    tab.evaluate(f"location.hash = '{links[0]}'")
    wait(tab, "page.panels.length === 2 && page.flight.seed === '3'")
    for link in (*links, *links):
        tab.evaluate(f"location.hash = '{link}'")
    wait(tab, "page.panels.length === 1 && page.flight.seed === '4'")
    tab.wait_for_timeout(300)
    assert tab.evaluate(STATE) == ["paper-flock", "4", None, False, ["fixed:5"]]


def test_a_link_restores_flock_policies_agents_and_steering(tab: Page, open_at: OpenAt) -> None:
    open_at(f"scenario=pursuit&seed={2**64 - 1}&policies=fixed:3.5,{HEADLINE}&agents=80&steer=you")
    expected = tab.evaluate(STATE)
    assert expected == ["pursuit", str(2**64 - 1), 80, True, ["fixed:3.5", HEADLINE]]
    link = tab.evaluate("page.link()")
    open_at()
    open_at(link)
    assert tab.evaluate(STATE) == expected


@pytest.mark.parametrize(("name", "rho"), [("torus", 60), ("ring", 100), ("pursuit", 6)])
def test_a_scenario_starts_alike_from_a_link_and_from_the_list(
    name: str, rho: int, tab: Page, open_at: OpenAt
) -> None:
    open_at(f"policies={','.join(DUEL)}")
    assert text(tab, ".panel:last-of-type .note") == "predator always seen"
    tab.evaluate(f"page.fly({scenario(name)})")
    assert text(tab, ".panel:last-of-type .note") == "not trained for this scenario"
    assert tab.evaluate(STATE)[4] == [f"fixed:{rho}", HEADLINE]
    open_at(f"scenario={name}")
    assert tab.evaluate(STATE)[4] == [f"fixed:{rho}"]


INVALID = {
    "scenario=nowhere&seed=18446744073709551616&agents=1&guess=101&steer=maybe&world=1": (
        r"scenario: .*nowhere\. steer: .*maybe\. agents: .* from 2 to 3000, got 1\. "
        r"guess: .* to 100, got 101\. seed: .* world: unknown entry\.",
        DUEL,
    ),
    "policies=fixed:-3": ("fixed:-3: expected a range >= 0", ["fixed:12"]),
    "policies=fixed:0x10": ("fixed:0x10: expected a range >= 0", ["fixed:12"]),
    "policies=,toString,recording:0,": (".*: this page has no such policy.*", ["fixed:12"]),
    "seed=-1": (r"seed: expected an integer from 0 to 2\^64 - 1, got -1\.", DUEL),
    "policies=fixed:1,fixed:2,fixed:3": ("policies: expected at most 2, got 3.", ["fixed:1", "fixed:2"]),
}


def test_invalid_entries_of_a_link_are_named(tab: Page, open_at: OpenAt) -> None:
    for address, (message, specs) in INVALID.items():
        open_at(address)
        assert re.fullmatch(message, text(tab, "#message"))
        assert tab.evaluate(STATE) == ["paper-flock", str(FIRST), None, False, specs]
    open_at("scenario=leaders&agents=2")  # numbers that this scenario cannot have
    assert text(tab, "#message").startswith("alignment_strength: expected")
    assert tab.evaluate(STATE)[:3] == ["leaders", str(FIRST), None]
    tab.evaluate("page.seek(1)")
    assert tab.evaluate("page.panels[0].run.numAgents") == 300


def test_a_finger_grabs_the_predator_of_both_flocks(tab: Page, open_at: OpenAt) -> None:
    open_at(f"policies={','.join(DUEL)}")
    tab.evaluate("page.seek(1)")
    x, y = tab.evaluate("page.panels[0].scene.predatorPixels(0)")[:2]
    past = "Array.from(page.panels[1].run.positions.subarray(0, 21 * 600))"
    before = tab.evaluate(past)
    tab.hover(".panel canvas", position={"x": x, "y": y})
    tab.mouse.down()
    tab.hover(".panel canvas", position={"x": x + 60, "y": y + 20})
    wait(tab, "page.player.time > 1.3")
    assert tab.evaluate("[page.flight.isSteered, page.player.isPlaying]") == [True, True]
    assert tab.evaluate(past) == before
    tab.evaluate("page.player.pause(), page.seek(8)")
    predators = tab.evaluate("page.panels.map(({ run }) => Array.from(run.predators.subarray(320, 322)))")
    assert predators[0] == predators[1]
    assert predators[0] == pytest.approx(tab.evaluate("page.steering.pointer"), abs=3)
    tab.mouse.up()
    assert tab.evaluate("page.steering.pointer") is None
    first, second = tab.evaluate(OBJECTIVES)
    straight = [lowest(fe.simulate("paper-flock", policy=spec, seed=FIRST)) for spec in DUEL]
    cells = tab.evaluate("[...document.querySelectorAll('#answer tbody td')].map((cell) => cell.textContent)")
    reached = zip(straight, (first, second), (first, second), strict=True)
    assert cells == [f"{value:.1f}" for row in reached for value in row]


def test_the_means_are_those_of_the_held_out_flocks_of_the_task(tab: Page, open_at: OpenAt) -> None:
    open_at()
    task, measured = fe.tasks["per-agent-visible"], means(12, browser.FLOCKS)
    best = measured["fixed"][RANGES.index(12)]
    assert task.scales["paper-flock"].best_fixed_range == 12
    fixed = fe.sweep("paper-flock", [12.0], seeds=task.seeds[: browser.FLOCKS]).min_mean_distance
    assert best["mean"] == fixed.mean()
    for each in (best, measured["learned"]):
        assert f"{each['mean']:.1f}" in text(tab, "#answer")


def test_a_click_shows_whom_an_agent_hears_and_what_it_observes(tab: Page, open_at: OpenAt) -> None:
    name = "field-of-view"
    open_at(f"scenario={name}&seed={SEED}&policies=fixed:9")
    tab.evaluate("page.seek(5); page.seek(4)")
    run = fe.simulate(name, 9.0, seed=SEED)
    x, y = tab.evaluate("page.panels[0].scene.points.subarray(30, 32)")
    tab.click(".panel canvas", position={"x": x, "y": y})
    agent, heard = tab.evaluate("[page.look.chosen.agent, page.look.chosen.heard]")
    assert text(tab, "#agent") == f"Agent {agent} listens within 9 m"
    pairs = neighbor_pairs(run.scenario, run.positions[80], 9.0, velocities=run.velocities[80])
    assert sorted(heard) == pairs[pairs[:, 0] == agent, 1].tolist()
    tab.focus(".panel canvas")
    for key, other in (("n", agent + 1), ("Shift+N", agent)):
        tab.keyboard.press(key)
        assert tab.evaluate("page.look.chosen.agent") == other
    for step in (60, 100):
        tab.evaluate(f"page.seek({step} * page.player.timeStep)")
        shown = tab.evaluate("""Object.fromEntries([...document.querySelectorAll("#agent-entries div")].map(
            (row) => [...row.children].map((part) => part.textContent)))""")
        before = run.positions[step - 1], run.velocities[step - 1]
        pairs = neighbor_pairs(run.scenario, before[0], 9.0, velocities=before[1])
        way = run.predator_positions[step, 0] - run.positions[step, agent]
        assert (
            shown.items()
            >= {
                "time": f"{run.times[step]:.2f} s",
                "lowest mean distance so far": f"{run.mean_distance[: step + 1].min():.1f} m",
                "heard in the last step": f"{len(pairs[pairs[:, 0] == agent, 1])} agents",
                "distance to the predator": f"{np.linalg.norm(way):.1f} m",
            }.items()
        )
