"""Episodes as a LeRobot dataset, version 3.0: parquet files and what describes them.

    meta/info.json                              features, frames a second, how many there are
    meta/tasks.parquet                          what was to be done
    meta/episodes/chunk-000/file-000.parquet    a row for each episode, with its statistics
    meta/stats.json                             statistics of all frames
    data/chunk-000/file-000.parquet             a row for each frame

Needs pyarrow, which is imported late: it is an optional dependency.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.episodes import Episode, common_rate
from irlpilco_ros.learning.errors import InvalidSettingError

VERSION = "v3.0"

_PLACE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_FIRST = "chunk-000/file-000.parquet"
_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_COUNTERS = ("frame_index", "episode_index", "index", "task_index")
_LIMIT = 1 << 20  # frames in the one data file: some 100 MB of a robot of 14 joints


def write_lerobot(folder: Path, episodes: Sequence[Episode], task: str, robot: str) -> int:
    """Write a dataset.

    The state is the joints' positions; velocities are told as well. The action is what was
    commanded, the mean of each control period; where somebody guided the robot, it is the
    velocity at which its joints went.

    Args:
        folder: Where to; a new folder.
        episodes: What was recorded.
        task: What the robot was to do.
        robot: Its name.

    Returns:
        Frames a second [Hz].

    Raises:
        InvalidSettingError: there are too many frames for one file.
        FileError: a file cannot be written.
        ImportError: pyarrow is not installed.
    """
    rate = common_rate(episodes)
    frames = [_frames(episode.at(rate)) for episode in episodes]
    begins = np.cumsum([0, *(len(each["timestamp"]) for each in frames)])
    if begins[-1] > _LIMIT:
        raise InvalidSettingError(
            f"{begins[-1]} frames are too many for one file; export parts of the run"
        )
    for number, each in enumerate(frames):
        count = len(each["timestamp"])
        each["frame_index"] = np.arange(count)
        each["episode_index"] = np.full(count, number)
        each["index"] = begins[number] + np.arange(count)
        each["task_index"] = np.zeros(count, dtype=np.int64)
    whole = {key: np.concatenate([each[key] for each in frames]) for key in frames[0]}
    features = _features(episodes[0].joints)
    _write_data(folder / "data" / _FIRST, frames, features)
    _write_tasks(folder / "meta/tasks.parquet", task)
    _write_episodes(folder / "meta/episodes" / _FIRST, episodes, frames, begins, task)
    _write_json(folder / "meta/stats.json", {key: _statistics(whole[key]) for key in whole})
    _write_json(
        folder / "meta/info.json", _info(features, rate, len(frames), int(begins[-1]), robot)
    )
    return rate


def _frames(episode: Episode) -> dict[str, NDArray[Any]]:
    """Return the columns of one episode."""
    action = episode.commands if episode.was_commanded else episode.velocities
    return {
        "observation.state": episode.positions.astype(np.float32),
        "observation.velocity": episode.velocities.astype(np.float32),
        "action": np.nan_to_num(action).astype(np.float32),
        "timestamp": episode.times.astype(np.float32),
    }


def _features(joints: Sequence[str]) -> dict[str, dict[str, Any]]:
    vector = {"dtype": "float32", "shape": [len(joints)], "names": list(joints)}
    number = {"shape": [1], "names": None}
    return {
        "observation.state": vector,
        "observation.velocity": vector,
        "action": vector,
        "timestamp": {"dtype": "float32", **number},
        **{name: {"dtype": "int64", **number} for name in _COUNTERS},
    }


def _info(
    features: Mapping[str, Any], rate: int, episodes: int, frames: int, robot: str
) -> dict[str, Any]:
    return {
        "codebase_version": VERSION,
        "robot_type": robot,
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": rate,
        "splits": {"train": f"0:{episodes}"},
        "data_path": f"data/{_PLACE}",
        "video_path": None,
        "features": features,
    }


def _statistics(values: NDArray[Any]) -> dict[str, list[float] | list[int]]:
    """Return statistics of one feature over its frames (n,) or (n, K)."""
    table = values.reshape(len(values), -1).astype(np.float64)
    found: dict[str, list[float] | list[int]] = {
        "min": table.min(axis=0).tolist(),
        "max": table.max(axis=0).tolist(),
        "mean": table.mean(axis=0).tolist(),
        "std": table.std(axis=0).tolist(),
        "count": [len(table)],
    }
    for name, part in _QUANTILES.items():
        found[name] = np.quantile(table, part, axis=0).tolist()
    return found


def _write_data(
    path: Path,
    frames: Sequence[Mapping[str, NDArray[Any]]],
    features: Mapping[str, Mapping[str, Any]],
) -> None:
    """Write all frames, one row group for each episode."""
    import pyarrow as pa
    from pyarrow import parquet

    kinds = {"float32": pa.float32(), "int64": pa.int64()}
    fields = []
    for name, feature in features.items():
        kind, size = kinds[feature["dtype"]], feature["shape"][0]
        is_vector = feature["names"] is not None and size > 1
        fields.append(pa.field(name, pa.list_(kind, size) if is_vector else kind))
    schema = pa.schema(fields)
    sink = pa.BufferOutputStream()
    with parquet.ParquetWriter(sink, schema) as writer:
        for each in frames:
            columns = [_column(pa, field.type, each[field.name]) for field in schema]
            writer.write_table(pa.Table.from_arrays(columns, schema=schema))
    _write(path, sink.getvalue().to_pybytes())


def _column(pa: Any, kind: Any, values: NDArray[Any]) -> Any:
    if pa.types.is_fixed_size_list(kind):
        flat = pa.array(values.ravel(), type=kind.value_type)
        return pa.FixedSizeListArray.from_arrays(flat, kind.list_size)
    return pa.array(values.reshape(-1), type=kind)


def _write_tasks(path: Path, task: str) -> None:
    """Write the tasks: a table whose index, as pandas has it, is the task's name."""
    import pyarrow as pa

    table = pa.table(
        {"task_index": pa.array([0], pa.int64()), "task": pa.array([task], pa.string())}
    )
    index = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            {
                "name": name,
                "field_name": name,
                "pandas_type": kind,
                "numpy_type": "int64" if kind == "int64" else "object",
                "metadata": None,
            }
            for name, kind in (("task_index", "int64"), ("task", "unicode"))
        ],
        "pandas_version": "2.0.0",
    }
    _write_table(path, table.replace_schema_metadata({"pandas": json.dumps(index)}))


def _write_episodes(
    path: Path,
    episodes: Sequence[Episode],
    frames: Sequence[Mapping[str, NDArray[Any]]],
    begins: NDArray[Any],
    task: str,
) -> None:
    import pyarrow as pa

    rows = [
        {
            "episode_index": number,
            "tasks": [task],
            "length": len(each["timestamp"]),
            "recording": episode.name,
            "dataset_from_index": int(begins[number]),
            "dataset_to_index": int(begins[number + 1]),
            "data/chunk_index": 0,
            "data/file_index": 0,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
            **{
                f"stats/{feature}/{kind}": value
                for feature in each
                for kind, value in _statistics(each[feature]).items()
            },
        }
        for number, (episode, each) in enumerate(zip(episodes, frames, strict=True))
    ]
    _write_table(path, pa.Table.from_pylist(rows))


def _write_table(path: Path, table: Any) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    sink = pa.BufferOutputStream()
    parquet.write_table(table, sink)
    _write(path, sink.getvalue().to_pybytes())


def _write_json(path: Path, content: Mapping[str, Any]) -> None:
    _write(path, json.dumps(content, indent=4, ensure_ascii=False).encode())


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, content)
