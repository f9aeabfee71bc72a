"""Fixtures for tests of the watch page in a browser: a plugin of such test files."""

from __future__ import annotations

from collections.abc import Iterator

import chromium
import pytest
from playwright.sync_api import Browser, Page


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium.chromium() as browser:
        yield browser


@pytest.fixture
def problems() -> list[str]:
    """Errors and console messages of the page; empty at the end of every test."""
    return []


@pytest.fixture
def tab(browser: Browser, problems: list[str]) -> Iterator[Page]:
    with browser.new_context() as context, context.new_page() as tab:
        tab.set_default_timeout(1000 * chromium.TIMEOUT)
        tab.on("pageerror", lambda error: problems.append(str(error)))
        tab.on("console", lambda message: problems.append(message.text))
        yield tab
        tab.evaluate("new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    assert problems == []
