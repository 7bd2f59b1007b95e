"""Classes by name: our own, and those that another distribution offers by an entry point."""

from __future__ import annotations

import pytest

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.registry import Registry

GROUP = "irlpilco_ros.shapes_of_this_test"
MODULE = """
from test_registry import Shape

class Round(Shape): ...
class Stranger: ...
"""
ENTRY_POINTS = f"""
[{GROUP}]
round = shapes_of_another:Round
stranger = shapes_of_another:Stranger
gone = shapes_of_another:Gone
square = shapes_of_another:Round
"""


class Shape:
    kind: str


@pytest.fixture
def shapes(tmp_path, monkeypatch):
    """A registry with one class of its own, beside a distribution that offers four names."""
    (tmp_path / "shapes_of_another.py").write_text(MODULE)
    information = tmp_path / "shapes_of_another-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Name: shapes_of_another\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.syspath_prepend(tmp_path)
    registry = Registry(GROUP, Shape)
    registry.register("square")(type("Square", (Shape,), {}))
    return registry


def test_names_are_ours_and_then_theirs(shapes):
    assert shapes.names() == ("square", "gone", "round", "stranger")


def test_a_class_knows_the_name_it_is_found_by(shapes):
    found = shapes.get("round")
    assert (found.__name__, found.kind) == ("Round", "round")
    assert shapes.get("round") is found


def test_another_package_does_not_replace_our_own(shapes):
    assert shapes.get("square").__name__ == "Square"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("oval", r"'oval' is unknown; valid: square, gone, round, stranger .*group irlpilco_ros"),
        ("gone", r"'gone' is offered by shapes_of_another:Gone, which cannot be loaded: .*Gone"),
        ("stranger", r"'stranger' .* is .*Stranger.*; expected a subclass of test_registry\.Shape"),
    ],
)
def test_what_cannot_be_had_is_told(shapes, name, message):
    with pytest.raises(InvalidSettingError, match=message):
        shapes.get(name)


def test_a_name_is_given_once(shapes):
    with pytest.raises(InvalidSettingError, match="has a class named 'square' already"):
        shapes.register("square")(type("Other", (Shape,), {}))
