"""Where the files that come with depthsim lie: beside the package in a checkout, inside it in a wheel."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def resource(*parts: str) -> Path:
    """The path of a file or folder that comes with depthsim, such as ``resource("scenes", "office.yaml")``."""
    installed = _PACKAGE / "data"
    root = installed if installed.is_dir() else _PACKAGE.parent
    return root.joinpath(*parts)
