"""A real Chromium without a screen, for the viewer's tests, its benchmark and its pictures."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from playwright.sync_api import Browser

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_FLAGS = ("--enable-unsafe-swiftshader", "--hide-scrollbars")
"""WebGL by software: a test machine has no GPU. With more of such flags Chromium draws the whole page by WebGL, too."""


def missing() -> str:
    """Why there is no browser here, "" if there is one."""
    try:
        import playwright  # noqa: F401
    except ImportError:
        return "playwright is not installed (pip install playwright)"
    return "" if _program() else "no Chromium is installed (Debian: apt-get install chromium)"


def _program() -> str | None:
    """CHROMIUM names another one."""
    given = os.environ.get("CHROMIUM")
    return given or next((found for name in _NAMES if (found := shutil.which(name))), None)


@contextmanager
def chromium() -> Iterator["Browser"]:
    """The system's Chromium, driven by playwright."""
    from playwright.sync_api import sync_playwright

    sandbox = () if os.geteuid() else ("--no-sandbox",)  # as root it has none
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=_program(), args=[*_FLAGS, *sandbox])
        try:
            yield browser
        finally:
            browser.close()
