"""Files that somebody else wrote, read with care: text and YAML of a bounded size.

Only what is a file is opened: a device never ends, and a FIFO may never begin.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Any, BinaryIO

import yaml

from irlpilco_ros.experience.errors import FileError

TEXT_LIMIT = 1 << 20
"""Largest text that is read whole [bytes]."""

_DEEPEST = 50
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_WordLoader: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)


def open_regular(path: Path) -> BinaryIO:
    """Open a file for reading, if it is one.

    Raises:
        FileError: it is not there, may not be read, or is a folder, a device or a FIFO.
    """
    try:
        # Without O_NONBLOCK the opening of a FIFO would wait for a writer.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except (OSError, ValueError) as error:
        raise FileError(f"cannot read {path}: {getattr(error, 'strerror', error)}") from error
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise FileError(f"cannot read {path}: it is no regular file")
    return os.fdopen(descriptor, "rb")


def read_text(path: Path, limit: int = TEXT_LIMIT) -> str:
    """Return the text of a file.

    Raises:
        FileError: as `open_regular`; or it is larger than `limit` [bytes], or no UTF-8.
    """
    with open_regular(path) as stream:
        try:
            content = stream.read(limit + 1)
        except OSError as error:
            raise FileError(f"cannot read {path}: {error.strerror}") from error
    if len(content) > limit:
        raise FileError(f"{path} is too large: more than {limit} bytes of text are not read")
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        raise FileError(f"{path} is no text: byte {error.start} is not UTF-8") from error


def read_yaml(path: Path, limit: int = TEXT_LIMIT, words_only: bool = False) -> Any:
    """Return what a YAML file holds.

    Args:
        path: The file.
        limit: Its largest size [bytes].
        words_only: Whether numbers and dates stay the words they are written with.

    Raises:
        FileError: as `read_text` and `parse_yaml`.
    """
    return parse_yaml(read_text(path, limit), path, words_only)


def parse_yaml(text: str, where: Path | str, words_only: bool = False) -> Any:
    """Return what a YAML text holds.

    Aliases are refused, as ROS refuses them: a few lines of them stand for gigabytes.

    Raises:
        FileError: it is no valid YAML, has aliases, or is nested too deeply.
    """
    loader = _WordLoader if words_only else _Loader
    try:
        _check(yaml.parse(text, Loader=loader), where)
        return yaml.load(text, Loader=loader)
    except FileError:
        raise
    except Exception as error:  # PyYAML raises ValueError and others for odd numbers and dates
        raise FileError(f"{where} is not valid YAML: {error}") from error


def _check(events: Any, where: Path | str) -> None:
    depth = 0
    for event in events:
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _DEEPEST:
            raise FileError(f"{where} is nested more than {_DEEPEST} levels deep")
        if isinstance(event, yaml.AliasEvent):
            line = event.start_mark.line + 1
            raise FileError(
                f"{where}, line {line}: the alias *{event.anchor} is not read; write out in full "
                "what it stands for"
            )
