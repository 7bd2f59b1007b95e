"""Classes by name: our own, and those that another distribution offers by an entry point."""

from __future__ import annotations

from typing import Any

import pytest

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.registry import Extension, Registry

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


class Shape(Extension):
    corners = 0

    @classmethod
    def check_class(cls):
        if cls.corners < 0:
            raise InvalidSettingError(f"{cls.__name__} has {cls.corners} corners")


@pytest.fixture
def shapes(tmp_path, monkeypatch):
    """A registry with one class of its own, beside a distribution that offers four names."""
    (tmp_path / "shapes_of_another.py").write_text(MODULE)
    information = tmp_path / "shapes_of_another-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Name: shapes_of_another\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.syspath_prepend(tmp_path)
    registry: Registry[Any] = Registry(GROUP, Shape)
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


def test_packages_that_cannot_be_loaded_are_left_out_and_told_of_once(shapes, caplog):
    for _ in range(2):
        assert [cls.kind for cls in shapes.classes()] == ["square", "round"]
    told = [record.getMessage() for record in caplog.records]
    assert len(told) == 2
    assert "'gone' is offered by" in told[0]
    assert "'stranger' of" in told[1]


@pytest.mark.parametrize(
    ("name", "members", "message"),
    [
        ("a.b", {}, "'a.b' of .* is no name"),
        ("odd", {"Settings": int}, "Settings of 'odd' of .* is no dataclass"),
        ("odd", {"corners": -1}, "Odd has -1 corners"),
    ],
)
def test_a_class_is_checked_when_it_is_registered(shapes, name, members, message):
    with pytest.raises(InvalidSettingError, match=message):
        shapes.register(name)(type("Odd", (Shape,), members))
    assert name not in shapes.names()
