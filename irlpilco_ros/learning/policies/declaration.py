"""Fields of a policy that know their shape, unit, limits and meaning."""

from __future__ import annotations

import dataclasses
import math
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.numerics.arrays import Array


@dataclass(frozen=True)
class Declared:
    """A field of a policy.

    Attributes:
        name: Of the field.
        shape: Symbols of an array's sizes, such as ("F", "D"); empty for a number. F is the number
            of controls, D that of the state dimensions which the policy sees; any other symbol
            stands for the same size throughout one policy.
        description: One sentence for whoever reads the parameter in a terminal.
        unit: SI unit without brackets; empty if it has none.
        minimum: Smallest allowed value, or None.
        searched: Whether policy search changes it.
        kind: Type of a number: int or float; of an array's elements float.
    """

    name: str
    shape: tuple[str, ...]
    description: str
    unit: str
    minimum: float | None
    searched: bool
    kind: type[int] | type[float]

    def checked(self, owner: str, value: Any, sizes: dict[str, int]) -> Array | float | int:
        """Return the value as it is declared; `sizes` learns of the symbols that it fixes.

        Raises:
            InvalidSettingError: says which field of which kind of policy is wrong, and why.
        """
        if not self.shape:
            return self._checked_number(owner, value)
        array = _numbers(f"{self.name} of a {owner} policy", value)
        if not fits(array.shape, self.shape, sizes):
            wanted = tuple(sizes.get(symbol, symbol) for symbol in self.shape)
            raise InvalidSettingError(
                f"{self.name} of a {owner} policy has shape {array.shape}; expected "
                f"({', '.join(str(each) for each in wanted)})"
            )
        sizes.update(zip(self.shape, array.shape, strict=True))
        if not np.isfinite(array).all():
            where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
            raise InvalidSettingError(
                f"{self.name} of a {owner} policy holds {array[where]} at {where}; "
                "expected finite numbers"
            )
        self._check_minimum(owner, float(array.min()) if array.size else np.inf)
        array.flags.writeable = False
        return array

    def _checked_number(self, owner: str, value: Any) -> float | int:
        try:
            number = self.kind(value)
        except (TypeError, ValueError, OverflowError):
            number = self.kind(0)
            value = repr(value)
        if not np.isfinite(number) or number != value:
            meant = "a whole number" if self.kind is int else "a finite number"
            raise InvalidSettingError(
                f"{self.name} of a {owner} policy is {value}; expected {meant}"
            )
        self._check_minimum(owner, number)
        return number

    def _check_minimum(self, owner: str, smallest: float) -> None:
        if self.minimum is not None and smallest < self.minimum:
            raise InvalidSettingError(
                f"{self.name} of a {owner} policy holds {smallest:g}; expected at least "
                f"{self.minimum:g}"
            )


def parameter(shape: str, description: str, unit: str = "") -> Any:
    """Declare an array that policy search changes.

    Args:
        shape: Symbols of its sizes, "F D" (see `Declared`).
        description: One sentence for whoever reads the parameter in a terminal.
        unit: SI unit without brackets; empty if it has none.
    """
    return _field(shape, description, unit, None, True)


def fixed(shape: str, description: str, unit: str = "", minimum: float | None = None) -> Any:
    """Declare an array that policy search leaves as it is; arguments as `parameter`."""
    return _field(shape, description, unit, minimum, False)


def number(description: str, unit: str = "", minimum: float | None = None) -> Any:
    """Declare an int or a float that policy search leaves as it is; arguments as `parameter`."""
    return _field("", description, unit, minimum, False)


def control_limit() -> Any:
    """Declare the field `control_limit`, which every policy has."""
    return fixed(
        "F", "Largest control of each joint, at most the robot's own.", "rad/s, or Nm", minimum=0.0
    )


def _field(shape: str, description: str, unit: str, minimum: float | None, searched: bool) -> Any:
    metadata = {
        "shape": tuple(shape.split()),
        "description": description,
        "unit": unit,
        "minimum": minimum,
        "searched": searched,
    }
    return dataclasses.field(metadata=metadata)


_known: dict[type[Any], tuple[Declared, ...]] = {}


def declared(cls: type[Any]) -> tuple[Declared, ...]:
    """Return the fields of a kind of policy, in their order.

    Raises:
        InvalidSettingError: a field is not declared by a function of this module.
    """
    if cls not in _known:
        _known[cls] = tuple(_declarations(cls))
    return _known[cls]


def _declarations(cls: type[Any]) -> Iterator[Declared]:
    if not dataclasses.is_dataclass(cls):
        raise InvalidSettingError(f"{cls.__qualname__} is no dataclass, as every policy must be")
    hints = typing.get_type_hints(cls)
    known = {"F", "D"}
    for field in dataclasses.fields(cls):
        if "shape" not in field.metadata:
            raise InvalidSettingError(
                f"the field {field.name} of {cls.__qualname__} is not declared; make it with "
                "parameter(), fixed() or number()"
            )
        shape = field.metadata["shape"]
        if len([symbol for symbol in shape if symbol not in known]) > 1:
            raise InvalidSettingError(
                f"the shape {' '.join(shape)} of {cls.__qualname__}.{field.name} has two sizes "
                "that are new; in a flat list of numbers only one of them can be told"
            )
        known.update(shape)
        kind = int if hints[field.name] is int else float
        yield Declared(name=field.name, kind=kind, **field.metadata)


def _numbers(name: str, value: Any) -> Array:
    try:
        return np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InvalidSettingError(f"{name} holds something else than numbers") from None


def fits(have: tuple[int, ...], shape: tuple[str, ...], sizes: Mapping[str, int]) -> bool:
    """Whether an array's shape fits symbols, some of which have a known size."""
    if len(have) != len(shape):
        return False
    return all(sizes.get(symbol, size) == size for symbol, size in zip(shape, have, strict=True))


def with_shape(field: Declared, value: Any, sizes: dict[str, int]) -> Any:
    """Return a flat list of numbers as an array of a field's shape; a number as it is.

    Args:
        field: What the list is of.
        value: The list.
        sizes: The numbers of controls F and of state dimensions D, and what else is known; learns
            of the symbol that the list's length tells.

    Raises:
        InvalidSettingError: it holds something else than numbers, or has a wrong length.
    """
    if not field.shape:
        return value
    flat = _numbers(field.name, value)
    free = next((symbol for symbol in field.shape if symbol not in sizes), None)
    known = math.prod(sizes[symbol] for symbol in field.shape if symbol != free)
    rows = flat.size // known if known else 0
    if rows == 0 or flat.size != rows * known or (free is None and rows != 1):
        given = "".join(f", {each} = {sizes[each]}" for each in field.shape if each != free)
        raise InvalidSettingError(
            f"{field.name} has {flat.size} values; expected "
            f"{'a multiple of ' if free else ''}{known} (shape {' x '.join(field.shape)}{given})"
        )
    if free is not None:
        sizes[free] = rows
    return flat.reshape([sizes[symbol] for symbol in field.shape])
