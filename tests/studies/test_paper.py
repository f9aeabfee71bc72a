"""The reproduction of the paper: measurements against the models, verdicts, mechanism, page and figures."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
import reference
from cli_runs import Cli

from flockesc_env import LineScenario, simulate_line
from flockesc_env.cli.output import Exit
from flockesc_env.jobs import Arrays
from studies.__main__ import STUDIES
from studies.paper import jobs, plan
from studies.paper.claims import Verdict, claim
from studies.paper.line_claims import clusters
from studies.paper.mechanism_claims import mechanism_claims
from studies.paper.plan import CONTROL_GRID, LINE_GRID, NO_FORCE, STRENGTHS, Trials, control
from studies.paper.report import PaperResults
from studies.study import REPORT, RESULTS_FILE, document

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results" / "paper"


@pytest.mark.parametrize(
    ("share", "in_expectation", "expected"),
    [
        (1.0, True, Verdict.HOLDS),
        (0.95, True, Verdict.HOLDS),
        (0.949, True, Verdict.IN_EXPECTATION),
        (0.0, True, Verdict.IN_EXPECTATION),
        (0.99, False, Verdict.SOMETIMES),
        (0.001, False, Verdict.SOMETIMES),
        (0.0, False, Verdict.FAILS),
    ],
)
def test_verdicts_follow_one_rule(share: float, in_expectation: bool, expected: Verdict) -> None:
    is_so = np.arange(1000) < 1000 * share
    judgment = claim("", "", "", is_so, in_expectation=in_expectation).judgment
    assert judgment.verdict is expected
    assert judgment.share.low <= share <= judgment.share.high


def test_equations_name_functions_and_tests_that_exist() -> None:
    _, _, equations = (COMMITTED / REPORT).read_text("utf-8").partition("## Equations in the code")
    links = re.findall(r"\[`(\w+)`\]\(\.\./\.\./(\S+\.(?:rs|py))\)", equations.partition("\n## ")[0])
    assert len(links) == 20
    for name, file in links:
        assert re.search(rf"\b(fn|def) {name}\b", (ROOT / file).read_text("utf-8")), file


@pytest.mark.parametrize("force", ["constant", "linear", None])
def test_consensus_is_what_a_slow_reference_finds(force: str | None) -> None:
    fields = {"predator_position": None} if force is None else {"escape_force": force}
    scenario = LineScenario(num_agents=30, **fields)
    found = jobs.consensus(scenario, (0.1, 0.2), range(8))
    for i, rho in enumerate((0.1, 0.2)):
        for seed in range(8):
            states = [simulate_line(scenario, rho, seed=seed).states[0]]
            while len(states) < 2 or np.abs(states[-1] - states[-2]).max() > 1e-12:
                states.append(reference.line_step(scenario, states[-1], rho))
            counts = [len(clusters(np.sort(x), rho)) for x in states]
            at_split = states[counts.index(counts[-1])]
            order = np.argsort(states[-1], kind="stable")
            last = states[-1][order]
            offsets = []
            for center in clusters(last, rho):
                who = order[np.abs(last - center) < 1e-6]
                offsets.append(abs(at_split[who].mean() - center))
            cell = {name: values[i, seed] for name, values in found.items()}
            np.testing.assert_allclose(cell["final"], last, atol=1e-9)
            assert cell["mean_offset"] == pytest.approx(abs(states[-1].mean() - states[0].mean()), abs=1e-9)
            assert cell["alpha_offset"] == pytest.approx(max(offsets), abs=1e-9)
            assert cell["falls"] == any(b < a for a, b in itertools.pairwise(counts))
            in_range = [] if force is None else [np.abs(x - 0.6).min() < 0.2 for x in states[1:]]
            assert cell["returns"] == any(in_range)
            assert cell["converged"]


def test_the_paper_is_reproduced(cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small run from the command line gives the same numbers in JSON and in the report."""
    monkeypatch.setattr("training.figure_style.DPI", 40)
    monkeypatch.setattr("matplotlib.layout_engine.ConstrainedLayoutEngine.execute", lambda *_: None)  # slow
    output = tmp_path / "paper"
    flags = ["--flocks", 4, "--lines", 40, "--backend", "serial", "--output", output]
    ran = cli("paper", *flags, run=STUDIES.main)
    assert ran.code == Exit.DONE
    results = PaperResults.load(output)
    assert document(results) == (output / RESULTS_FILE).read_text("utf-8")
    drawn = {path.stem: path.read_bytes() for path in output.glob("*.png")}
    assert len(drawn) == 11
    markdown = (output / REPORT).read_text("utf-8")
    assert "](figure_9.png)" in markdown
    for row in results.claims:
        for text in (row.holds_if, row.judgment.verdict, *map(str, row.measured)):
            assert text.replace("*", "\\*") in markdown
    jobs_before = sorted((output / "cache").iterdir())
    for name in drawn:
        (output / f"{name}.png").unlink()
    some = cli("paper", *flags, "--figures", "9", run=STUDIES.main)
    assert some.code == Exit.DONE
    assert {path.stem: path.read_bytes() for path in output.glob("*.png")} == {"figure_9": drawn["figure_9"]}
    assert sorted((output / "cache").iterdir()) == jobs_before


def test_the_committed_results_are_those_of_the_defaults() -> None:
    results = PaperResults.load(COMMITTED)
    assert results.trials == Trials()


def verdicts(
    without: dict[float, float], fleeing: dict[float, float], blocked: float = 0.0
) -> dict[str, set[Verdict]]:
    """Return the verdicts on 40 made-up flocks and lines, by the claim's first word.

    The objective without and with the force is 0 except for the given ranges. ``blocked`` is that at 10 m if
    warnings are blocked.
    """
    noise = np.random.default_rng(0).normal(scale=0.01, size=40)

    def values(peaks: dict[float, float], grid: tuple[float, ...], scale: float = 1.0) -> Arrays:
        rows = np.array([peaks.get(round(rho * scale, 9), 0.0) for rho in grid])[:, np.newaxis] + noise
        names = ("min_mean_distance", "min_min_distance", "fraction_surviving", "escape_distance")
        return dict.fromkeys(names, rows)

    found = {
        control(scenario, strength, kind): values(without if strength == NO_FORCE else fleeing, CONTROL_GRID)
        for scenario in plan.SCENARIOS
        for strength in STRENGTHS
        for kind in ("control", "captures")
    }
    for name in ("blocked", "blocked captures"):
        found[name] = values({0.0: fleeing.get(0.0, 0.0), 10.0: blocked}, plan.SHORT_RANGES)
    found["fearless line"], found["grid linear"] = (values(p, LINE_GRID, 100) for p in (without, fleeing))
    words: dict[str, set[Verdict]] = {}
    for row in mechanism_claims(found):
        words.setdefault(row.claim.split()[0], set()).add(row.judgment.verdict)
    return words


def test_the_explanation_is_judged_by_what_the_force_does() -> None:
    """It makes the optimum; the optimum needs no force; warning and masking are judged apart."""
    best = {10.0: 2.0, 100.0: 1.0}
    holds, fails = {Verdict.HOLDS}, {Verdict.FAILS}
    assert verdicts({}, best) == {"Some": holds, "Too": holds, "The": holds}
    assert verdicts(best, best, blocked=2.0) == {"Some": fails, "Too": fails, "The": fails}
    neither = verdicts({10.0: 1.0}, {0.0: 1.5, 10.0: 2.0, 100.0: 2.5}, blocked=2.0)
    assert neither["Some"] == neither["Too"] == fails
    masking = verdicts({10.0: 1.0}, {0.0: 1.5, 10.0: 2.0}, blocked=2.0)
    assert (masking["Some"], masking["Too"]) == (fails, holds)
