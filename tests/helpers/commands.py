"""The command line in the test's own process, which spares a second of imports for every call."""

import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from subprocess import CompletedProcess
from unittest.mock import patch

from depthsim.__main__ import main


def depthsim_here(*words: object, cwd: Path | None = None) -> CompletedProcess[str]:
    """What `depthsim WORDS` gives; a fault that would be a traceback is raised."""
    arguments = ["depthsim", *map(str, words)]
    out, err, status = StringIO(), StringIO(), 0
    with redirect_stdout(out), redirect_stderr(err), chdir(cwd or Path.cwd()), patch.object(sys, "argv", arguments):
        try:
            main()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else int(end.code is not None)
    return CompletedProcess(arguments, status, out.getvalue(), err.getvalue())
