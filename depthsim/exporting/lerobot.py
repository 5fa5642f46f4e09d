"""LeRobot data sets, version 3: Parquet with the pictures in it, an episode a run, for its loader and for `datasets`.

    data/chunk-000/file-000.parquet   an episode each: pictures, state, and LeRobot's own columns
    meta/info.json, stats.json, tasks.parquet, episodes/chunk-000/file-000.parquet

Depth is a TIFF a frame, without loss: 16 bits of millimetres where the camera stores those, else floats of metres.
observation.state is the camera's pose; observation.imu and observation.environment_state (the objects that move) are
there where a run has them. LeRobot counts time by frames at a whole rate from the episode's beginning; the run's own
stamps are in observation.stamp.
Source: LeRobotDataset v3.0, https://huggingface.co/docs/lerobot/lerobot-dataset-v3, and the loader of lerobot 0.4 on.
"""

import io
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.exporting.options import ExportOptions
from depthsim.exporting.tables import IMU_COLUMNS, colour, imu_columns
from depthsim.extras import load_extra
from depthsim.runs import Run
from depthsim.runs.png import encode_png
from depthsim.trajectory.tum import read_tum

VERSION = "v3.0"
_FILES, _ROWS, _STRIDE = 1000, 32, 4
"""Files in a chunk; frames in a row group; every so many pixels each way are looked at for statistics."""
_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_DEPTHS = {"depth": "observation.images.depth", "clean": "observation.images.clean"}
_RGB, _MASK, _INSTANCE = (f"observation.images.{name}" for name in ("rgb", "mask", "instance"))
_OWN = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
"""LeRobot's own columns."""


def write(run: Run, out: Path, options: ExportOptions) -> str:
    """Write the data set of one run; says what is in it."""
    return write_runs([run], out)


def write_runs(runs: Iterable[Run], out: Path) -> str:
    """Write the data set of runs that have the same camera and the same kinds of pictures, an episode each.

    Raises :class:`InputError` for runs that differ in that, and where pyarrow is missing.
    """
    pq = load_extra("pyarrow.parquet", "lerobot")
    first: _Episode | None = None
    episodes: list[dict[str, Any]] = []
    tasks: list[str] = []
    total, whole = 0, dict[str, _Moments]()
    for number, run in enumerate(runs):
        episode = _Episode.of(run)
        first = first or episode
        for key in first.features.keys() | episode.features.keys():
            if episode.features.get(key) != first.features.get(key):
                problem = f"its {key} is not as that of {first.run.path.name}"
                raise InputError(run.path, "", problem, "export runs of one camera and with the same pictures together")
        if (task := _task(run)) not in tasks:
            tasks.append(task)
        chunk, file = divmod(number, _FILES)
        path = out / "data" / f"chunk-{chunk:03d}" / f"file-{file:03d}.parquet"
        path.parent.mkdir(parents=True, exist_ok=True)
        moments = {key: _Moments(shape) for key, shape in episode.measured.items()}
        place = {"episode_index": number, "task_index": tasks.index(task)}
        with pq.ParquetWriter(path, _schema(first.features), compression="snappy") as writer:
            for table in episode.tables(total, place, moments):
                writer.write_table(table)
        for key, own in moments.items():
            whole.setdefault(key, _Moments(episode.measured[key])).join(own)
        entry = {"episode_index": number, "tasks": [task], "length": len(run)}
        entry |= {"data/chunk_index": chunk, "data/file_index": file}
        entry |= {"dataset_from_index": total, "dataset_to_index": total + len(run)}
        entry |= {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
        for key, own in moments.items():
            entry |= {f"stats/{key}/{name}": value for name, value in own.found().items()}
        episodes.append(entry)
        total += len(run)
    if first is None:
        raise InputError(out, "", "would hold no run", "give one or more")
    _write_meta(
        out, first.run, first.features, episodes, tasks, {key: own.found() for key, own in whole.items()}, total
    )
    return f"{total} frames in {len(episodes)} episode{'s' if len(episodes) > 1 else ''} of {', '.join(first.pictures)}"


def _task(run: Run) -> str:
    return f"see {run.meta.get('scene') or run.path.resolve().name}"


@dataclass
class _Moments:
    """Least, greatest, mean and standard deviation of what was added, by component."""

    shape: tuple[int, ...]
    count: int = 0
    rows: int = 0
    low: NDArray[np.float64] = field(init=False)
    high: NDArray[np.float64] = field(init=False)
    total: NDArray[np.float64] = field(init=False)
    square: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        self.low, self.high = np.full(self.shape, np.inf), np.full(self.shape, -np.inf)
        self.total, self.square = np.zeros(self.shape), np.zeros(self.shape)

    def add(self, values: NDArray[Any]) -> None:
        """values: (N, components) of a frame."""
        v = values.reshape(-1, int(np.prod(self.shape))).astype(np.float64)
        self.rows, self.count = self.rows + 1, self.count + len(v)
        self.low = np.minimum(self.low, v.min(axis=0).reshape(self.shape))
        self.high = np.maximum(self.high, v.max(axis=0).reshape(self.shape))
        self.total = self.total + v.sum(axis=0).reshape(self.shape)
        self.square = self.square + np.square(v).sum(axis=0).reshape(self.shape)

    def join(self, other: "_Moments") -> None:
        """Add what was added to another."""
        self.rows, self.count = self.rows + other.rows, self.count + other.count
        self.low, self.high = np.minimum(self.low, other.low), np.maximum(self.high, other.high)
        self.total, self.square = self.total + other.total, self.square + other.square

    def found(self) -> dict[str, Any]:
        """As LeRobot has them; ``count`` is of frames."""
        mean = self.total / self.count
        std = np.sqrt(np.maximum(self.square / self.count - mean**2, 0))
        named = {"min": self.low, "max": self.high, "mean": mean, "std": std}
        return {name: value.tolist() for name, value in named.items()} | {"count": [self.rows]}


@dataclass
class _Episode:
    """One run as rows. features: as in info.json. columns: (frames, n) numbers by key."""

    run: Run
    features: dict[str, dict[str, Any]]
    columns: dict[str, NDArray[np.float64]]

    @classmethod
    def of(cls, run: Run) -> "_Episode":
        camera, height, width = run.camera, run.camera.height, run.camera.width
        about: dict[str, Any] = {name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy", "baseline")}
        about |= {"distortion": list(camera.distortion), "is_depth_map": False}

        def image(channels: int, **info: Any) -> dict[str, Any]:
            names = ["height", "width", "channels"]
            return {"dtype": "image", "shape": [height, width, channels], "names": names, "info": about | info}

        unit = {"is_depth_map": True, "depth_unit": "mm" if _in_millimetres(run) else "m"}
        features = {key: image(1, **unit) for stream, key in _DEPTHS.items() if run.has(stream)}
        features |= {_RGB: image(3)} if run.has("rgb") else {}
        features |= {_MASK: image(3)} if run.has("mask") else {}
        features |= {_INSTANCE: image(1)} if run.has("instance") else {}
        poses = np.column_stack([run.trajectory.positions, run.trajectory.quaternions])
        columns = {"observation.state": poses, "observation.stamp": run.stamps[:, None]}
        names: dict[str, tuple[str, ...]] = {"observation.state": _POSE, "observation.stamp": ("stamp",)}
        if (imu := imu_columns(run)) is not None:
            names["observation.imu"] = IMU_COLUMNS[1:]
            at = [np.interp(run.stamps, imu["t"], imu[name]) for name in IMU_COLUMNS[1:]]
            columns["observation.imu"] = np.column_stack(at)
        moving = {one.name: one.poses for one in run.instances.values() if one.poses is not None}
        if moving:
            tracks = [read_tum(run.path / file).at(run.stamps) for file in moving.values()]
            names["observation.environment_state"] = tuple(f"{name}.{axis}" for name in moving for axis in _POSE)
            both = [np.column_stack([track.positions, track.quaternions]) for track in tracks]
            columns["observation.environment_state"] = np.column_stack(both)
        for key, of in names.items():
            kind = "float64" if key == "observation.stamp" else "float32"
            features[key] = {"dtype": kind, "shape": [len(of)], "names": list(of)}
        features |= {key: {"dtype": kind, "shape": [1], "names": None} for key, kind in _OWN.items()}
        return cls(run, features, columns)

    @property
    def pictures(self) -> list[str]:
        """What they are of."""
        return [key.rpartition(".")[2] for key, of in self.features.items() if of["dtype"] == "image"]

    @property
    def measured(self) -> dict[str, tuple[int, ...]]:
        """The shape of the statistics of each feature: by channel of pictures, by component of others."""
        shapes = {key: (of["shape"][-1], 1, 1) for key, of in self.features.items() if of["dtype"] == "image"}
        return shapes | {key: tuple(of["shape"]) for key, of in self.features.items() if of["dtype"] != "image"}

    def tables(self, first: int, place: dict[str, int], moments: dict[str, _Moments]) -> Iterator[Any]:
        """Some frames at a time as Arrow tables. first: the number of the first frame in the data set."""
        import pyarrow as pa

        schema, rate = _schema(self.features), _rate(self.run)
        for begin in range(0, len(self.run), _ROWS):
            rows: dict[str, list[Any]] = {key: [] for key in self.features}
            for index in range(begin, min(begin + _ROWS, len(self.run))):
                own = {"timestamp": index / rate, "frame_index": index, "index": first + index, **place}
                for key, feature in self.features.items():
                    if feature["dtype"] == "image":
                        data, values = _picture(self.run, key, index)
                        ending = "png" if data[1:4] == b"PNG" else "tiff"
                        rows[key].append({"bytes": data, "path": f"frame-{index:06d}.{ending}"})
                        moments[key].add(values[::_STRIDE, ::_STRIDE])
                    else:
                        value = self.columns[key][index] if key in self.columns else np.array([own[key]])
                        rows[key].append(value.tolist() if len(value) > 1 else value[0].item())
                        moments[key].add(value)
            yield pa.table({name: pa.array(rows[name], schema.field(name).type) for name in schema.names}, schema)


def _in_millimetres(run: Run) -> bool:
    return abs(run.camera.depth_scale - 0.001) < 1e-12


def _rate(run: Run) -> int:
    """Frames a second, a whole number."""
    return max(round(run.camera.rate), 1)


def _picture(run: Run, key: str, index: int) -> tuple[bytes, NDArray[Any]]:
    """The file of a frame's picture, and its values: of depth in its unit, of colours 0 to 1."""
    if key in (_RGB, _MASK):
        shown, trusted = (run.rgb(index), None) if key == _RGB else (None, run.mask(index))
        if trusted is not None:
            shown = trusted.astype(np.uint8) * np.uint8(255)
        assert shown is not None  # of() has looked
        rgb = np.ascontiguousarray(colour(shown))
        return encode_png(rgb), rgb / np.float32(255)
    if key == _INSTANCE:
        numbers = run.instance(index)
        assert numbers is not None
        return _tiff(numbers), numbers
    depth = run.depth(index) if key == _DEPTHS["depth"] else run.clean(index)
    assert depth is not None
    if _in_millimetres(run):
        depth = np.rint(depth * np.float32(1000)).astype(np.uint16)
    return _tiff(depth), depth


def _tiff(picture: NDArray[Any]) -> bytes:
    from PIL import Image

    data = io.BytesIO()
    Image.fromarray(picture).save(data, "TIFF", compression="tiff_adobe_deflate")
    return data.getvalue()


def _schema(features: dict[str, dict[str, Any]]) -> Any:
    """The columns as Arrow has them, with what `datasets` wants to know of them."""
    import pyarrow as pa

    fields: list[Any] = []
    known: dict[str, dict[str, Any]] = {}
    for key, feature in features.items():
        kind, size = feature["dtype"], feature["shape"][0]
        if kind == "image":
            fields.append(pa.field(key, pa.struct([("bytes", pa.binary()), ("path", pa.string())])))
            known[key] = {"_type": "Image"}
        elif size == 1:
            fields.append(pa.field(key, getattr(pa, kind)()))
            known[key] = {"dtype": kind, "_type": "Value"}
        else:
            fields.append(pa.field(key, pa.list_(getattr(pa, kind)(), size)))
            known[key] = {"feature": {"dtype": kind, "_type": "Value"}, "length": size, "_type": "Sequence"}
    return pa.schema(fields, {"huggingface": json.dumps({"info": {"features": known}})})


def _write_meta(
    out: Path,
    run: Run,
    features: dict[str, dict[str, Any]],
    episodes: list[dict[str, Any]],
    tasks: list[str],
    stats: dict[str, dict[str, Any]],
    total: int,
) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    meta = out / "meta"
    (meta / "episodes" / "chunk-000").mkdir(parents=True)
    info = {
        "codebase_version": VERSION, "robot_type": run.camera.name, "total_episodes": len(episodes),
        "total_frames": total, "total_tasks": len(tasks), "chunks_size": _FILES, "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200, "fps": _rate(run), "splits": {"train": f"0:{len(episodes)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "video_path": None,
        "features": features,
    }  # fmt: skip
    (meta / "info.json").write_text(json.dumps(info, indent=4))
    (meta / "stats.json").write_text(json.dumps(stats, indent=4))
    pq.write_table(pa.Table.from_pylist(episodes), meta / "episodes" / "chunk-000" / "file-000.parquet")
    # The loader finds the text of a task in the index of a pandas table.
    columns = [
        {"field_name": name, "name": name, "pandas_type": kind, "numpy_type": of, "metadata": None}
        for name, kind, of in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
    ]
    pandas = {"index_columns": ["task"], "column_indexes": [], "columns": columns, "pandas_version": "2.0.0"}
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": tasks})
    pq.write_table(table.replace_schema_metadata({"pandas": json.dumps(pandas)}), meta / "tasks.parquet")
