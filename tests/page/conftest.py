"""A browser, a tab that is empty of errors at the end of a test, and the playground in it."""

from collections.abc import Iterator

import pytest
from browser import ARGUMENTS, EXECUTABLE, FLOCKS, MISSING, TIMEOUT, OpenAt, open_page
from playwright.sync_api import Browser, Page, sync_playwright

from flockesc_env.watch.live import has_engine
from playground.__main__ import main


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if EXECUTABLE is None:
        pytest.skip(MISSING)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=EXECUTABLE, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def tab(browser: Browser) -> Iterator[Page]:
    problems: list[str] = []
    with browser.new_context(viewport={"width": 1440, "height": 900}) as context, context.new_page() as tab:
        tab.set_default_timeout(1000 * TIMEOUT)
        tab.on("pageerror", lambda error: problems.append(str(error)))
        tab.on("console", lambda message: problems.append(message.text))
        yield tab
        tab.evaluate("new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    assert problems == []


@pytest.fixture(scope="session")
def playground(tmp_path_factory: pytest.TempPathFactory) -> str:
    if not has_engine():
        pytest.skip("needs the core for web pages: `make engine`")
    folder = tmp_path_factory.mktemp("playground")
    main(folder, flocks=FLOCKS)
    return (folder / "index.html").as_uri()


@pytest.fixture
def open_at(tab: Page, playground: str) -> OpenAt:
    def open_at(address: str = "") -> None:
        tab.goto("about:blank")
        open_page(tab, f"{playground}#{address}&t=0")

    return open_at
