"""What the page says besides its pictures: figures of the frames, what is under way, and what went wrong."""

import asyncio
import html
from contextlib import suppress

import viser

_SLOW, _SLOW_IN_A_PLAY = 0.1, 1.0
"""[s] What takes longer shows that it is under way; frames that follow each other show it themselves."""
_DOING = {
    "frame": "measuring",
    "fly": "flying the path",
    "picture": "saving the picture",
    "profile": "saving the profile",
    "save frame": "saving the frame",
}


class Status:
    """Lines over the controls of one browser."""

    def __init__(self, gui: viser.GuiApi, loop: asyncio.AbstractEventLoop) -> None:
        self._loop, self._job, self._shown, self._slow = loop, 0, False, _SLOW
        self._errors: dict[str, str] = {}
        self._error = gui.add_html("", visible=False)
        self._text = gui.add_markdown("")
        self._doing = gui.add_markdown("", visible=False)
        self._bar = gui.add_progress_bar(100.0, visible=False, animated=True)

    def figures(self, lines: list[str]) -> None:
        """Tell of the frames, a line each."""
        self._text.content = "  \n".join(lines)

    def moving(self, moving: bool) -> None:
        """Whether frames follow each other from now on."""
        self._slow = _SLOW_IN_A_PLAY if moving else _SLOW

    def busy(self, kind: str | None) -> None:
        """A job begins, or the one that was begun is done; called by the worker."""
        self._job += 1
        if kind is not None:
            with suppress(RuntimeError):  # the server has stopped meanwhile
                self._loop.call_soon_threadsafe(self._loop.call_later, self._slow, self._show, self._job, kind)
        elif self._shown:
            self._shown = self._doing.visible = self._bar.visible = False

    def _show(self, job: int, kind: str) -> None:
        if job == self._job:
            self._shown = True
            self._doing.content = f"*{_DOING.get(kind, kind)} …*"
            self._doing.visible = self._bar.visible = True

    def ended(self, kind: str, line: str) -> None:
        """A job is done (""), or could not be done, for the reason in one line."""
        if self._errors.get(kind, "") == line:
            return
        self._errors[kind] = line
        lines = [error for error in self._errors.values() if error]
        self._error.content = error_html(lines)
        self._error.visible = bool(lines)


def error_html(lines: list[str]) -> str:
    """One-line errors, as the page shows them."""
    return "".join(
        '<div class="depthsim-error" style="margin:0.4em 0.75em;padding:0.5em 0.7em;border-radius:0.4em;'
        'background:#7f1d1d;color:#fff;font-size:0.85em;overflow-wrap:anywhere">' + html.escape(line) + "</div>"
        for line in lines
    )
