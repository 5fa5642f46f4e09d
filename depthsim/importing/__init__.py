"""Recordings of others as runs: ROS 1 and 2 bags, TUM RGB-D sequences, folders of pictures. One file a format."""

import os
from pathlib import Path

from depthsim.errors import InputError
from depthsim.importing.options import Imported, ImportOptions
from depthsim.runs.whole import whole_folder

BAG_SUFFIXES = (".bag", ".mcap", ".db3")


def import_recording(source: Path, out: Path, options: ImportOptions | None = None) -> Imported:
    """Write the recording ``source`` as the run folder ``out``, whole or not at all.

    What it is, is found by itself: a .bag, .mcap or .db3 file, or a folder with one; a folder with depth.txt (TUM
    RGB-D); any other folder of PNG or npy files. A bag that is cut off or damaged gives the frames before that place,
    and ``cut`` of what comes back says where it was. Raises :class:`InputError` where there is nothing to keep.
    """
    source, options = Path(source), options or ImportOptions()
    kind = recognise(source)
    with whole_folder(out) as folder:
        if kind == "bag":
            from depthsim.importing.bag import read_bag

            return read_bag(source, folder, options)
        if kind == "tum":
            from depthsim.importing.tum import read_sequence

            return read_sequence(source, folder, options)
        from depthsim.importing.pictures import read_pictures

        return read_pictures(source, folder, options)


def recognise(source: Path) -> str:
    """bag, tum or pictures."""
    if not os.path.exists(source):  # which, unlike Path's, takes any text
        raise InputError(source, "", "no such file or folder", "give a .bag, .mcap or .db3 file, or a folder")
    if source.is_file():
        if source.suffix.lower() in BAG_SUFFIXES:
            return "bag"
        raise InputError(source, "", "is no recording", "give a .bag, .mcap or .db3 file, or a folder")
    names = [file.name for file in source.iterdir()]
    if "metadata.yaml" in names or any(Path(name).suffix.lower() in BAG_SUFFIXES for name in names):
        return "bag"
    return "tum" if "depth.txt" in names else "pictures"


__all__ = ["ImportOptions", "Imported", "import_recording", "recognise"]
