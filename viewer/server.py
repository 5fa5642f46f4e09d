"""The server: one page for every browser that comes, on this machine alone; from elsewhere `ssh -L` leads here."""

import io
import threading
import warnings
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path

import viser

from depthsim.errors import InputError
from viewer.session import Session
from viewer.stage import Stage
from viewer.status import error_html

_HOST = "127.0.0.1"
"""viser has no say in who may connect, so that nobody elsewhere may."""


class Viewer:
    """Serves a stage to any number of browsers, each with settings of its own.

    open_stage: opens what is on show. Where that fails the page says why, and tries again for the next browser.
    port: the first free one from here is taken. folder: where the page may save files.
    """

    def __init__(
        self,
        open_stage: Callable[[], Stage],
        title: str,
        port: int = 8080,
        folder: Path = Path("viewer_files"),
    ) -> None:
        self._open_stage, self._folder = open_stage, folder
        self._stage: Stage | None = None
        self._opening, self.sessions = threading.Lock(), dict[int, Session]()
        self.error: InputError | None = None
        # A browser that goes away takes its page with it, and what was under way for it has nowhere to go.
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection")
        with redirect_stdout(io.StringIO()):  # viser greets on stdout, whatever `verbose` says
            self._server = viser.ViserServer(host=_HOST, port=port, label=title, verbose=False)
        self._try_to_open()
        self._server.on_client_connect(self._welcome)
        self._server.on_client_disconnect(self._farewell)

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://{_HOST}:{self._server.get_port()}/"

    def _try_to_open(self) -> Stage | None:
        with self._opening:
            if self._stage is None:
                try:
                    self._stage, self.error = self._open_stage(), None
                except InputError as error:
                    self.error = error
            return self._stage

    def _welcome(self, client: viser.ClientHandle) -> None:
        stage = self._try_to_open()
        if stage is None:
            client.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
            client.gui.add_html(error_html([str(self.error)]))
            client.gui.add_markdown("Correct it, and load this page again.")
            return
        session = Session(client, self._server, stage, self._folder)
        self.sessions[client.client_id] = session

    def _farewell(self, client: viser.ClientHandle) -> None:
        session = self.sessions.pop(client.client_id, None)
        if session is not None:
            session.close()

    def run(self, greeting: str) -> None:
        """Print a greeting, and serve until Ctrl-C, which may come as soon as the greeting is read."""
        try:
            print(greeting, flush=True)
            threading.Event().wait()
        except KeyboardInterrupt:
            pass
        finally:
            self.stop()

    def stop(self) -> None:
        """Close the page."""
        for session in list(self.sessions.values()):
            session.close()
        with redirect_stdout(io.StringIO()):
            self._server.stop()
