"""A page of the viewer in a real Chromium: what the tests of the viewer share."""

import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from benchmarks.chromium import missing
from depthsim.camera import Camera
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import load_trajectory
from viewer import Viewer
from viewer.session import Session

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

WHY_NOT = missing()
PATIENCE = 300.0
"""[s] A busy machine may take long to draw by software; nothing here depends on how long it takes."""
CAMERA = Camera(name="small", width=64, height=48, fx=60, fy=60, cx=31.5, cy=23.5, baseline=0.05, rate=10)


def until(true: Callable[[], Any], seconds: float = PATIENCE) -> Any:
    """Wait for something to become true, and return it."""
    end = time.monotonic() + seconds
    while not (value := true()):
        assert time.monotonic() < end, "it did not come true in time"
        time.sleep(0.02)
    return value


class Visit:
    """A browser's visit to a viewer. errors: what its console reported of errors, and faults of its scripts."""

    def __init__(self, page: "Page", viewer: Viewer) -> None:
        self.page, self.viewer = page, viewer
        self.errors: list[str] = []
        page.set_default_timeout(1000 * PATIENCE)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)

    @property
    def session(self) -> Session:
        """The server's side of the visit that came last; waits until its first frame is sent."""
        until(lambda: self.viewer.sessions)
        session = self.viewer.sessions[max(self.viewer.sessions)]
        until(lambda: session.shown is not None)
        return session

    def open(self) -> Session:
        """Load the page, and wait for its first frame."""
        known = set(self.viewer.sessions)
        self.page.goto(self.viewer.url)
        until(lambda: set(self.viewer.sessions) - known)
        session = self.session
        self.page.get_by_text("points,").first.wait_for()
        return session

    def tab(self, name: str) -> None:
        """Open a tab of the controls."""
        self.page.get_by_role("tab", name=name, exact=True).click()

    def control(self, label: str) -> "Locator":
        """The box to type or to click beside a label."""
        name = self.page.locator("label").filter(has_text=re.compile(f"^{re.escape(label)}$"))
        row = name.locator("xpath=ancestor::div[contains(@class,'Flex-root')][1]")
        return row.locator("input:not([type=hidden])").last

    def type_into(self, label: str, value: object) -> None:
        """Type a number into the box beside a slider, as a person does."""
        box = self.control(label)
        box.fill(str(value))
        box.press("Enter")


def frame_after(session: Session, act: Callable[[], object]) -> Any:
    """What is shown once something has been done and the page has taken it in."""
    before = session.shown
    act()
    return until(lambda: session.shown if session.shown is not before else None)


@contextmanager
def visit(browser: "Browser", viewer: Viewer) -> Iterator[Visit]:
    """A new browser window, small so that a software renderer is quick."""
    context = browser.new_context(viewport={"width": 900, "height": 600})
    try:
        yield Visit(context.new_page(), viewer)
    finally:
        context.close()


def wall_run(folder: Path, frames: int = 5) -> Path:
    """A run along the built-in wall, seen by a small camera."""
    scene = load_scene("wall")
    path = load_trajectory(None, scene, CAMERA.rate, frames)
    generate(scene, path, CAMERA, load_profile("paper"), folder, seed=1)
    return folder
