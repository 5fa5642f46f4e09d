"""What the library logs, for who sits at a terminal."""

import logging
import sys


class _OnTerminal(logging.Handler):
    """Prints a record's message alone, above a progress bar where there is one."""

    def emit(self, record: logging.LogRecord) -> None:
        """Called with every message."""
        print(record.getMessage(), file=sys.stderr, flush=True)  # rich stands in for sys.stderr while a bar is shown


def show_notes() -> None:
    """Show depthsim's own log on standard error, a line each."""
    log = logging.getLogger("depthsim")
    log.setLevel(logging.INFO)
    log.addHandler(_OnTerminal())
    log.propagate = False
