"""The paper's claims about the theory of the line (Section III), measured."""

from __future__ import annotations

import numpy as np

from flockesc_env.jobs import Arrays
from studies.paper.claims import Claim, claim, every, exactly, mean, share
from studies.paper.plan import COARSE, FREE_RANGES, LINE, THRESHOLD_RANGES


def theory_claims(results: dict[str, Arrays]) -> list[Claim]:
    """Return the rows of Section III, in the paper's order."""
    return [*_consensus(results["free line"]), *_theorem_2(results), *_existence(results)]


def _consensus(free: Arrays) -> list[Claim]:
    at = FREE_RANGES.index
    # m(t) never falls, so that a line with one cluster was connected at all times.
    connected = every(np.diff(free["final"][at(0.3)], axis=1) <= 0.3, 1)
    off_mean, off_alpha = free["mean_offset"][at(0.3)][connected], free["alpha_offset"][at(0.2)]
    reached, monotone = every(free["converged"], 0), every(~free["falls"], 0)
    return [
        claim(
            "III, Lemma 1",
            "Without predator the number of components m(t) never falls.",
            "it never falls, under any of the ranges 0, 0.1, 0.2, 0.3, 1",
            monotone,
            share("lines in which it never falls", monotone),
        ),
        claim(
            "III, Theorem 1",
            "Without predator the line converges to a steady state of separate clusters.",
            "a line comes to rest, under all of these ranges",
            reached,
            share("lines that converge", reached),
        ),
        claim(
            "III",
            "A line that stays connected converges to the average of x(0).",
            "a connected line ends within 1e-9 of its average; the mean offset is as small",
            off_mean < 1e-9,
            mean("offset from the average, rho = 0.3", off_mean, digits=4),
            exactly("largest offset", off_mean.max(), digits=3),
            in_expectation=off_mean.mean() < 1e-9,
        ),
        claim(
            "III, Definition 1",
            "Cluster i ends at alpha_i, its average at the time t_c of the last split.",
            "all clusters end within 1e-9 of alpha_i; the mean offset is as small",
            off_alpha < 1e-9,
            mean("largest offset from alpha_i, rho = 0.2", off_alpha, digits=4),
            exactly("over all lines", off_alpha.max(), digits=3),
            in_expectation=off_alpha.mean() < 1e-9,
        ),
    ]


def _theorem_2(results: dict[str, Arrays]) -> list[Claim]:
    studies = {rho: results[f"threshold {rho}"] for rho in THRESHOLD_RANGES}
    everywhere = every(np.array([study["converged"][0] for study in studies.values()]), 0)
    stays_out = {rho: ~study["returns"][0] for rho, study in studies.items()}
    return [
        claim(
            "III, Theorem 2",
            "With Eq. 8 and s >= s* = rho_p + rho the line converges (rho <= rho_p).",
            "a line comes to rest under all four ranges",
            everywhere,
            share("lines that converge at s = s*, rho = 0.05, 0.1, 0.15 and 0.2", everywhere),
        ),
        claim(
            "III, Eq. 10",
            "Proof of Theorem 2: after one step no agent is within the predator's range.",
            "no agent is within rho_p after the first step, under all four ranges",
            every(np.array(list(stays_out.values())), 0),
            *(share(f"lines with no agent in range, rho = {rho:g}", out) for rho, out in stays_out.items()),
        ),
    ]


def _existence(results: dict[str, Arrays]) -> list[Claim]:
    rows = []
    for force, where, name in (
        ("linear_as_printed", "III, Remark", "Eq. 9 as printed"),
        ("linear", "IV", "Eq. 9 as simulated (`linear`)"),
    ):
        converged = results[f"grid {force}"]["converged"][COARSE]
        within = every(converged[: round(LINE.predator_range * 10) + 1], 0)
        beyond = every(converged, 0)
        worst = int(np.argmin(converged.mean(axis=1)))
        rows.append(
            claim(
                where,
                f"With {name} and s = 2 a steady state exists for all of Figure 5, which d_ss needs.",
                "a line comes to rest within 1,000 steps under each of these ranges",
                beyond,
                share("lines that converge for all of rho = 0, 0.1, .., 1", beyond),
                share("lines that converge for rho = 0, 0.1, 0.2 (<= rho_p)", within),
                share(f"lines that converge at the worst, rho = {worst / 10:g}", converged[worst]),
                is_reading=True,
            )
        )
    return rows
