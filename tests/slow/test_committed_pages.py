"""Committed pages to the letter, intervals included; tests/studies compares them without intervals."""

from __future__ import annotations

from committed_pages import check_race, check_results


def test_results() -> None:
    check_results()


def test_arms_race() -> None:
    check_race()
