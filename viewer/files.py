"""Names that come from a browser: checked before anything is written under them."""

import re
from pathlib import Path

from depthsim.errors import InputError

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


def place_for(folder: Path, name: str, suffix: str) -> Path:
    """The path of a new file (or, with an empty suffix, folder) ``name`` in ``folder``.

    Raises :class:`InputError` for a name that is more than a plain one, that leaves the folder, or that is taken.
    """
    stem = name.strip().removesuffix(suffix) if suffix else name.strip()
    if not _NAME.fullmatch(stem) or ".." in stem:
        raise InputError("name", repr(name[:70]), "is no plain file name", "use letters, digits, dot, dash, underscore")
    path = folder / f"{stem}{suffix}"
    if path.parent.resolve() != folder.resolve() or path.is_symlink():
        raise InputError("name", repr(name), "leaves the folder", "give a plain name")
    if path.exists():
        raise InputError(path, "", "is there already", "give another name")
    return path
