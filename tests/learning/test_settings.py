"""Settings: their types, and those that extensions declare."""

from __future__ import annotations

import dataclasses
import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.imitation import MatchFeatures
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.policies import LinearPolicy, RbfPolicy
from irlpilco_ros.learning.registry import Extension, Registry
from irlpilco_ros.learning.settings import (
    check,
    declarations,
    extension_settings,
    from_values,
    setting,
    values_of,
)


class Fruit(Extension):
    pass


FRUITS = Registry("irlpilco_ros.test_fruits", Fruit)


@FRUITS.register("apple")
class Apple(Fruit):
    @dataclass(frozen=True)
    class Settings:
        mass: float = setting(0.2, "How heavy it is.", unit="kg", minimum=0.0)
        pips: tuple[int, ...] = setting((5,), "Pips in each chamber.")

        def __post_init__(self) -> None:
            if self.mass > 1.0 and not self.pips:
                raise InvalidSettingError("an apple of that size has pips")


@dataclass(frozen=True)
class Basket:
    fruit: str = setting("apple", "What is in it.", choices=FRUITS.names)
    count: int = setting(1, "How many.", minimum=0)
    lid: bool = setting(False, "Whether it has one.")
    options: Mapping[str, Any] = extension_settings(FRUITS.classes)

    def __post_init__(self) -> None:
        check(self)


@FRUITS.register("pear")  # after the basket was declared
class Pear(Fruit):
    pass


def test_choices_are_those_there_are_when_somebody_chooses():
    assert Basket(fruit="pear").fruit == "pear"
    assert declarations(Basket)["fruit"].choices == ("apple", "pear")
    with pytest.raises(InvalidSettingError, match=r"fruit is 'plum'; valid values: apple, pear"):
        Basket(fruit="plum")


def test_settings_of_extensions_are_declared_with_all_that_is_known_of_them():
    declared = declarations(Basket)
    assert list(declared) == ["fruit", "count", "lid", "apple.mass", "apple.pips"]
    mass = declared["apple.mass"]
    assert (mass.default, mass.unit, mass.minimum, mass.hint) == (0.2, "kg", 0.0, float)


def test_they_are_converted_checked_and_handed_to_their_extension():
    basket = Basket(options={"apple.pips": [4, 5], "apple.mass": 1})
    assert basket.options == {"apple.mass": 1.0, "apple.pips": (4, 5)}
    assert values_of(basket)["apple.mass"] == 1.0
    assert values_of(Basket())["apple.pips"] == (5,)
    assert from_values(Basket, {**values_of(basket), "colour": "red"}) == basket
    assert hash(Basket()) == hash(Basket())
    assert pickle.loads(pickle.dumps(basket)) == basket
    given = {"apple.mass": 0.3}
    kept = Basket(options=given)
    given["apple.mass"] = -1.0
    assert kept.options == {"apple.mass": 0.3}


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"apple.colour": 1}, "Basket.options sets apple.colour.*valid: apple.mass, apple.pips"),
        ({"mass": 1.0}, "sets mass, which no extension declares"),
        ({"apple.mass": -1.0}, r"apple.mass is -1.0 \[kg\]; expected at least 0.0 \[kg\]"),
        ({"apple.mass": "much"}, r"apple.mass is 'much' \(str\); expected float"),
        ({"apple.pips": 5}, "apple.pips is 5; expected a list"),
        ({"apple.mass": 2.0, "apple.pips": ()}, "an apple of that size has pips"),
    ],
)
def test_what_an_extension_does_not_know_is_refused_in_a_sentence(options, reason):
    with pytest.raises(InvalidSettingError, match=reason):
        Basket(options=options)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"count": 2.5}, r"Basket.count is 2.5 \(float\); expected int"),
        ({"count": True}, r"Basket.count is True \(bool\); expected int"),
        ({"count": "a"}, "Basket.count is 'a'"),
        ({"lid": 1}, "Basket.lid is 1"),
        ({"fruit": 3}, "Basket.fruit is 3"),
    ],
)
def test_types_are_checked_as_they_are_promised(change, reason):
    with pytest.raises(InvalidSettingError, match=reason):
        Basket(**change)
    assert type(Basket(count=np.arange(4)[3]).count) is int


def test_two_extensions_of_one_name_cannot_declare_the_same_setting():
    @dataclass(frozen=True)
    class Both:
        options: Mapping[str, Any] = extension_settings(lambda: [Apple, Apple])

    with pytest.raises(InvalidSettingError, match=r"apple.mass is declared by two extensions"):
        declarations(Both)


def test_learning_settings_know_those_of_policies_and_ways_of_imitating():
    settings = LearningSettings(policy="rbf", options={"rbf.count": 25})
    assert settings.options_of(RbfPolicy).count == 25
    assert LearningSettings().options_of(RbfPolicy).count == 10
    assert settings.options_of(MatchFeatures).variance_weight == 1.0
    assert dataclasses.replace(settings, seed=3).options == {"rbf.count": 25}
    assert settings.options_of(LinearPolicy) == LearningSettings().options_of(LinearPolicy)
    assert {"linear_phase.count", "feature_matching.variance_weight"} <= set(values_of(settings))
    with pytest.raises(InvalidSettingError, match=r"valid values: .*linear_phase, rbf"):
        LearningSettings(policy="open_loop")  # nothing that could be searched
    with pytest.raises(InvalidSettingError, match=r"rbf.count is 0; expected at least 1"):
        LearningSettings(options={"rbf.count": 0})
