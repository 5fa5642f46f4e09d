"""The `depthsim` command. Little is imported before :func:`main` runs, so that Ctrl-C is one line at any moment."""

import gc
import os
import sys

_INTERRUPTED = 130
"""The exit status after Ctrl-C."""
_KEPT = {
    "generate": "; whole frames are kept, and the same command goes on from there",
    "sweep": "; whole frames are kept, and the same command goes on from there",
}
"""What a command that was stopped leaves; any other leaves what there was before it."""


def main() -> None:
    """Run the command line. A fault of the input is one line on stderr and exit status 2, Ctrl-C one line and 130."""
    try:
        _run()
    except BaseException as error:
        if not _is_interrupt(error):
            raise
        print(f"stopped{_KEPT.get(''.join(sys.argv[1:2]), '')}", file=sys.stderr)
        sys.exit(_INTERRUPTED)


_GARBAGE = 100_000
"""New objects between two looks for garbage. Python's 700 have the modules that are imported looked through again and
again, for a tenth of a second of every start."""


def _run() -> None:
    gc.set_threshold(_GARBAGE)
    # One thread for the little linear algebra there is: the kernels have the cores, and those of BLAS would spin beside
    # them. Before numpy is imported, or it is too late.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from depthsim.cli import app
    from depthsim.errors import InputError

    try:
        app()
    except InputError as error:
        if _is_interrupt(error):
            raise
        _install_what_is_missing(error)
        print(error, file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        # Whoever read our output has gone, as in `depthsim ... | head`.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)


def _install_what_is_missing(error: Exception) -> None:
    """Under `./run`, start the command anew with the extra that it lacks; otherwise return."""
    from depthsim.extras import MissingExtra, install_by_run

    if isinstance(error, MissingExtra):
        install_by_run(error, sys.argv[1:])


def _is_interrupt(error: BaseException) -> bool:
    """Whether Ctrl-C is behind an error: in the making of a class Python raises another for it; typer exits by 130."""
    if isinstance(error, SystemExit):
        return error.code == _INTERRUPTED
    return any(isinstance(one, KeyboardInterrupt) for one in (error, error.__cause__, error.__context__))


if __name__ == "__main__":
    main()
