"""Make the pictures of the viewer: `./run python docs/viewer_pictures.py [--report REPORT]` writes docs/pictures/."""

import argparse
import io
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.chromium import chromium, missing
from viewer import Viewer, open_stage
from viewer.session import Session

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

OUT = Path(__file__).resolve().parent / "pictures"
_SIZE = {"width": 1440, "height": 860}


@contextmanager
def page_of(browser: "Browser", what: str, **keys: str) -> Iterator[tuple["Page", Session]]:
    """The viewer's page of something, without the notice that there is no GPU."""
    with tempfile.TemporaryDirectory() as folder:
        stage = open_stage(what, **keys)  # type: ignore[arg-type]
        viewer = Viewer(lambda: stage, f"depthsim · {stage.name}", port=0, folder=Path(folder))
        page = browser.new_page(viewport=_SIZE)  # type: ignore[arg-type]
        page.set_default_timeout(600_000)
        page.goto(f"{viewer.url}?fixedDpr=1")
        page.get_by_text("points,").first.wait_for()
        session = next(iter(viewer.sessions.values()))
        page.add_style_tag(content="[class*=Notification] { display: none !important }")
        yield page, session
        page.close()
        viewer.stop()


def act_and_wait(session: Session, act: Callable[[], object]) -> None:
    """Do something, and wait until the page shows it."""
    before = session.shown
    act()
    while session.shown is before:
        time.sleep(0.05)


def shoot(page: "Page", name: str) -> None:
    """Save the page."""
    page.mouse.move(5, 5)
    time.sleep(6)  # a software renderer needs a few frames
    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    picture.save(OUT / name, optimize=True)
    print(OUT / name, file=sys.stderr)


def choose(control: object, value: object) -> Callable[[], None]:
    """Pick something."""
    return lambda: setattr(control, "value", value)


def main() -> None:
    """Write the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--report", help="a report, for viewer_gap.png")
    parser.add_argument("--only", help="the name of one picture")
    given = parser.parse_args()
    if why := missing():
        sys.exit(why)
    OUT.mkdir(exist_ok=True)
    with chromium() as browser:
        for make in (cloud, compare, knobs):
            if given.only in (None, make.__name__):
                make(browser)
        if given.report:
            gap(browser, given.report)


def cloud(browser: "Browser") -> None:
    """A D435 in the office, by depth."""
    with page_of(browser, "office", sensor="d435") as (page, session):
        act_and_wait(session, choose(session.playback._slider, 150))
        session._go_to("over its shoulder")
        shoot(page, "viewer.png")


def compare(browser: "Browser") -> None:
    """The paper's model beside the D435's, by error, on a light page."""
    with page_of(browser, "office", sensor="paper") as (page, session):
        act_and_wait(session, choose(session.playback._slider, 150))
        session.sensor.second.value = "d435"
        act_and_wait(session, choose(session.look.beside, "second sensor"))
        act_and_wait(session, choose(session.look.colouring, "error"))
        session.look.dark.value = False
        session._go_to("from outside")
        shoot(page, "viewer_compare.png")


def knobs(browser: "Browser") -> None:
    """The controls of the effects, and what became of every pixel."""
    with page_of(browser, "corridor", sensor="d435") as (page, session):
        act_and_wait(session, choose(session.playback._slider, 60))
        act_and_wait(session, choose(session.look.colouring, "validity"))
        session._go_to("over its shoulder")
        page.get_by_role("tab", name="Sensor").click()
        for effect in ("stereo_shadow", "invalid_band", "fill_rate"):
            folder = page.get_by_text(f"● {effect}")
            folder.click()
        page.get_by_text("● stereo_shadow").scroll_into_view_if_needed()
        shoot(page, "viewer_knobs.png")


def gap(browser: "Browser", report: str) -> None:
    """A report: where the gap lies, and its causes."""
    with page_of(browser, report) as (page, session):
        act_and_wait(session, choose(session.playback._slider, 25))
        act_and_wait(session, choose(session.gap._switches[0], True))
        act_and_wait(session, choose(session.look.beside, "nothing"))
        act_and_wait(session, choose(session.look.opacity, 1.0))
        act_and_wait(session, choose(session.look.points, "1 in 16"))
        session._go_to("from outside")
        shoot(page, "viewer_gap.png")


if __name__ == "__main__":
    main()
