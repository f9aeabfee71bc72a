"""Fixtures of pages in a browser. Other environments run tests of this folder without Playwright."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from page_browser import ARGUMENTS, EXECUTABLE  # fails without Playwright
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=EXECUTABLE, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def problems() -> list[str]:
    """Errors and console messages of the page; empty at the end of every test."""
    return []


@pytest.fixture
def tab(browser: Any, problems: list[str]) -> Iterator[Any]:
    from page_browser import TIMEOUT

    with browser.new_context() as context, context.new_page() as tab:
        tab.set_default_timeout(1000 * TIMEOUT)
        tab.on("pageerror", lambda error: problems.append(str(error)))
        tab.on("console", lambda message: problems.append(message.text))
        yield tab
        tab.evaluate("new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    assert problems == []


@pytest.fixture(scope="module")
def playground(tmp_path_factory: pytest.TempPathFactory) -> str:
    from flockesc_env.watch.live import has_engine
    from playground.__main__ import main

    if not has_engine():
        pytest.skip("needs the core for web pages: `make engine`")
    folder = tmp_path_factory.mktemp("playground")
    main(folder, flocks=20)
    return (folder / "index.html").as_uri()


@pytest.fixture
def open_at(tab: Any, playground: str) -> Callable[[str], None]:
    """Open the playground, paused, at an address."""
    from page_browser import open_page

    def open_at(address: str = "") -> None:
        tab.goto("about:blank")
        open_page(tab, f"{playground}#{address}&t=0", 1440)

    return open_at
