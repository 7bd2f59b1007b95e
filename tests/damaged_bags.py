"""Bags with damage of all kinds, chosen at random."""

from __future__ import annotations

import random
from pathlib import Path

import yaml


def truncate(content: bytearray, rng: random.Random) -> None:
    del content[rng.randrange(len(content)) :]


def flip(content: bytearray, rng: random.Random) -> None:
    for _ in range(rng.choice((1, 1, 8))):
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)


def remove(content: bytearray, rng: random.Random) -> None:
    start = rng.randrange(len(content))
    del content[start : start + rng.choice((1, 4, 100))]


def insert(content: bytearray, rng: random.Random) -> None:
    start = rng.randrange(len(content))
    content[start:start] = rng.randbytes(rng.choice((1, 8, 300)))


def blank(content: bytearray, rng: random.Random) -> None:
    start = rng.randrange(len(content))
    content[start : start + 64] = bytes(len(content[start : start + 64]))


def extreme(content: bytearray, rng: random.Random) -> None:
    """Lengths and counts that are far too large."""
    start = rng.randrange(max(len(content) - 8, 1))
    content[start : start + 8] = b"\xff" * rng.choice((2, 4, 8))


BYTES = (truncate, flip, flip, remove, insert, blank, extreme)


def mutate_tree(node, rng: random.Random):
    """Replace one value somewhere in a YAML document by one of another kind."""
    if isinstance(node, dict) and node and rng.random() < 0.8:
        key = rng.choice(sorted(node, key=str))
        return {**node, key: mutate_tree(node[key], rng)}
    if isinstance(node, list) and node and rng.random() < 0.8:
        place = rng.randrange(len(node))
        return [*node[:place], mutate_tree(node[place], rng), *node[place + 1 :]]
    return rng.choice([None, [], {}, [[1]], {"a": 1}, -1, 2**70, "x", "../../x", "", True, 1e400])


def damage(bag: Path, rng: random.Random) -> None:
    file = rng.choice(sorted(bag.iterdir()))
    if file.name == "metadata.yaml" and rng.random() < 0.5:
        file.write_text(yaml.safe_dump(mutate_tree(yaml.safe_load(file.read_text()), rng)))
        return
    content = bytearray(file.read_bytes())
    rng.choice(BYTES)(content, rng)
    file.write_bytes(content)


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
