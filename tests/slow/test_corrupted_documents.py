"""Ten thousand corrupted scenario documents."""

from corrupted_documents import check, outcome_of


def test_ten_thousand() -> None:
    check(outcome_of(0, 10_000), 10_000)
