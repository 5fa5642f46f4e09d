"""The command line, one command a file. It is thin: read the inputs, call the library, print.

Everything heavy is imported inside the commands, so that `depthsim --help` starts at once.
"""

import sys

import typer

from depthsim.cli.apply import apply
from depthsim.cli.diagnose import diagnose
from depthsim.cli.diagnose_flight import diagnose_flight
from depthsim.cli.export import export
from depthsim.cli.fit_drag import fit_drag
from depthsim.cli.fit_material import fit_material
from depthsim.cli.flags import Command
from depthsim.cli.fly import fly
from depthsim.cli.generate import generate
from depthsim.cli.import_ import import_
from depthsim.cli.inspect import inspect
from depthsim.cli.match import match
from depthsim.cli.reconstruct import reconstruct
from depthsim.cli.report import report
from depthsim.cli.slam import slam
from depthsim.cli.sweep import sweep
from depthsim.cli.view import view

app = typer.Typer(
    help="A RealSense depth sensor on triangle meshes, and the diagnosis of its sim-to-real gap.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command(cls=Command)(generate)
app.command(cls=Command)(apply)
app.command(cls=Command)(sweep)
app.command(cls=Command)(fly)
app.command(cls=Command)(inspect)
app.command(cls=Command)(diagnose)
app.command(cls=Command)(match)
app.command(cls=Command)(fit_material)
app.command(cls=Command)(diagnose_flight)
app.command(cls=Command)(report)
app.command(cls=Command)(fit_drag)
app.command(cls=Command)(view)
app.command(cls=Command)(slam)
app.command(cls=Command)(reconstruct)
app.command("import", cls=Command)(import_)
app.command(cls=Command)(export)


@app.callback(invoke_without_command=True)
def _begin(version: bool = typer.Option(False, "--version", help="Show the version.")) -> None:
    if sys.stderr.isatty():  # in a file or a pipe there is nothing but errors
        from depthsim.cli.notes import show_notes

        show_notes()
    if version:
        from depthsim import __version__

        print(f"depthsim {__version__}")
        raise typer.Exit


__all__ = ["app"]
