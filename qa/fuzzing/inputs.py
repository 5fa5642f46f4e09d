"""One broken input: which files of a valid folder are changed, and into what. Decided by a seed alone."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

from qa.fuzzing.containers import by_suffix, mutate_db3
from qa.fuzzing.plain import WORDS
from qa.fuzzing.readers import Reader


class Corpus:
    """The valid files of one reader, in a folder in which they are changed and put back."""

    def __init__(self, reader: Reader, home: Path) -> None:
        self.reader, self.folder, self.out = reader, home / "in", home / "out"
        self._scratch = home
        self.folder.mkdir()
        reader.seed(self.folder)
        files = sorted(file for file in self.folder.rglob("*") if file.is_file())
        self._files = {file: file.read_bytes() for file in files}
        self._targets = [file for file in files if not reader.only or file.suffix in reader.only]

    @property
    def targets(self) -> list[tuple[str, bytes]]:
        """The files that are changed: name and valid content."""
        return [(file.name, self._files[file]) for file in self._targets]

    @contextmanager
    def holding(self, target: int, data: bytes) -> Iterator[Path]:
        """The folder with one of the :attr:`targets` replaced; as it was when the block ends."""
        file = self._targets[target]
        try:
            file.write_bytes(data)
            yield self.folder
        finally:
            self._restore({file})

    @contextmanager
    def broken(self, rng: Random) -> Iterator[Path]:
        """The folder with one or two files changed; as it was when the block ends."""
        chosen = {rng.choice(self._targets) for _ in range(1 if rng.random() < 0.85 else 2)}
        try:
            for file in sorted(chosen):
                self._break(file, rng)
            yield self.folder
        finally:
            self._restore(chosen)

    def _break(self, file: Path, rng: Random) -> None:
        lot = rng.random()
        if lot < 0.97 or self.reader.given:
            data = self._files[file]
            base = file.suffix == ".db3"
            file.write_bytes(mutate_db3(data, rng, self._scratch) if base else by_suffix(file.name)(data, rng))
            return
        file.unlink()
        how = rng.randrange(6)
        if how == 1:
            file.mkdir()
        elif how == 2:
            os.symlink("/etc/passwd", file)
        elif how == 3:
            os.symlink(file.name, file)  # a loop
        elif how == 4:
            file.write_bytes(self._files[rng.choice(list(self._files))])
        elif how == 5:
            name = rng.choice([word for word in WORDS if "/" not in word and "\0" not in word and 0 < len(word) < 200])
            name = name if name not in (".", "..") else "x"
            (file.with_name(name + file.suffix)).write_bytes(self._files[file])

    def _restore(self, changed: set[Path]) -> None:
        for file in changed:
            self._put_back(file)
        if self.out.exists() or self.out.is_symlink():
            shutil.rmtree(self.out, ignore_errors=True)

    def _put_back(self, file: Path) -> None:
        if file.is_dir() and not file.is_symlink():
            shutil.rmtree(file)
        elif file.exists() or file.is_symlink():
            file.unlink()
        file.write_bytes(self._files[file])
        for other in file.parent.iterdir():
            if not other.is_dir() and other not in self._files:
                other.unlink()
