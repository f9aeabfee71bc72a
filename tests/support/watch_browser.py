"""Fixtures for tests of the page in a browser: a plugin of such test files."""

from collections.abc import Callable, Iterator

import chromium
import pytest
from chromium import open_page
from playwright.sync_api import Browser, Page

from flockesc_env.watch.live import has_engine
from playground.__main__ import main


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


@pytest.fixture(scope="module")
def playground(tmp_path_factory: pytest.TempPathFactory) -> str:
    if not has_engine():
        pytest.skip("needs the core for web pages: `make engine`")
    folder = tmp_path_factory.mktemp("playground")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("playground.__main__.CANDIDATES", range(30))  # a tenth of the time
        main(folder, flocks=20)
    return (folder / "index.html").as_uri()


@pytest.fixture
def open_at(tab: Page, playground: str) -> Callable[[str], None]:
    """Open the playground, paused, at an address."""

    def open_at(address: str = "") -> None:
        tab.goto("about:blank")
        open_page(tab, f"{playground}#{address}&t=0", 1440)

    return open_at
