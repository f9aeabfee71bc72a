"""Where every equation of the paper is computed and tested."""

from __future__ import annotations

from typing import Final, NamedTuple


class Equation(NamedTuple):
    """One row of the page's table: content of an equation, its function, and a test; files from the root."""

    equation: str
    file: str
    function: str
    test_file: str
    test: str


_CORE = "rust/flockesc-core/src"
_TESTS = "tests/model"

EQUATIONS: Final = (
    Equation(
        "Eq. 1: consensus of the line",
        f"{_CORE}/line/consensus.rs",
        "means",
        f"{_TESTS}/test_reference.py",
        "test_line",
    ),
    Equation(
        "Eq. 2: Perron matrix P = I - Delta^-1 L",
        f"{_CORE}/graph/matrices.rs",
        "perron_matrix",
        f"{_TESTS}/test_graph.py",
        "test_perron_matrix_is_row_stochastic_and_moves_the_line",
    ),
    Equation(
        "Eq. 4, Definition 1: t_c and alpha_i",
        "studies/paper/jobs.py",
        "_consensus_of",
        "tests/studies/test_paper.py",
        "test_consensus_is_what_a_slow_reference_finds",
    ),
    Equation(
        "Eq. 7: a step of the line under attack",
        f"{_CORE}/line/step.rs",
        "step",
        f"{_TESTS}/test_reference.py",
        "test_line",
    ),
    Equation(
        "Eqs. 8 and 9: escape force of the line",
        f"{_CORE}/line/escape.rs",
        "at",
        f"{_TESTS}/test_reference.py",
        "test_boundaries_of_the_line",
    ),
    Equation(
        "Inequality 10 and Theorem 2",
        f"{_CORE}/line/simulate.rs",
        "simulate_line",
        f"{_TESTS}/test_theorems.py",
        "test_theorem_2_holds_off_the_predator_though_its_proof_does_not",
    ),
    Equation(
        "Eq. 11: consensus force of the flock",
        f"{_CORE}/flock/motion/forces.rs",
        "consensus_force",
        f"{_TESTS}/test_reference.py",
        "test_flock_of_the_paper",
    ),
    Equation(
        "Section V: escape force of the flock",
        f"{_CORE}/flock/motion/forces.rs",
        "add_escape_force",
        f"{_TESTS}/test_reference.py",
        "test_boundaries_of_the_flock_are_inclusive",
    ),
    Equation(
        "Section V: positions, velocities, constant speed",
        f"{_CORE}/flock/motion/inertial.rs",
        "integrate",
        f"{_TESTS}/test_reference.py",
        "test_flock_of_the_paper",
    ),
    Equation(
        "Eqs. 12 and 13: J_mean and J_min",
        f"{_CORE}/episode/outcomes.rs",
        "record",
        f"{_TESTS}/test_golden.py",
        "test_flock",
    ),
)
