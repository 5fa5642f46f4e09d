"""A room as a mesh file, and what lies in a folder, for comparing two."""

import hashlib
from pathlib import Path

ROOM = """
o room
usemtl cement
v -3 -2 0
v 3 -2 0
v 3 2 0
v -3 2 0
v -3 -2 2.5
v 3 -2 2.5
v 3 2 2.5
v -3 2 2.5
f 1 2 3 4
f 8 7 6 5
f 1 5 6 2
f 2 6 7 3
usemtl plastic
f 3 7 8 4
f 4 8 5 1
"""


def tree(folder: Path, without: tuple[str, ...] = ()) -> dict[str, str]:
    """Every file under a folder by its relative path, as a hash of its bytes; but those of the names ``without``."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.name not in without)
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}
