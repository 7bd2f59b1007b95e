"""Names of classes that can be chosen in a settings file, ours and those of other packages.

A class of this package registers itself by a decorator; a class of another distribution is found by
an entry point of the registry's group (importlib.metadata), and is loaded when it is first used.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Generic, TypeVar

from irlpilco_ros.learning.errors import InvalidSettingError

Kind = TypeVar("Kind")


class Registry(Generic[Kind]):
    """Classes by name.

    Attributes:
        group: The entry-point group of other packages' classes, such as "irlpilco_ros.policies".
        base: What each of them must be a subclass of.
    """

    def __init__(self, group: str, base: type[Kind]) -> None:
        """Begin with no class of our own; `base` is what all of them derive from."""
        self.group = group
        self.base = base
        self._own: dict[str, type[Kind]] = {}

    def register(self, name: str) -> Callable[[type[Kind]], type[Kind]]:
        """Return a class decorator that makes the class known, and known to itself, by a name."""

        def decorate(cls: type[Kind]) -> type[Kind]:
            self._check(name, cls)
            if name in self._own:
                raise InvalidSettingError(f"{self.group} has a class named {name!r} already")
            self._own[name] = cls
            return cls

        return decorate

    def names(self) -> tuple[str, ...]:
        """Return every name: ours in the order of their definition, then others by the alphabet."""
        return (*self._own, *sorted(set(self._foreign) - set(self._own)))

    def get(self, name: str) -> type[Kind]:
        """Return the class of a name.

        Raises:
            InvalidSettingError: no class has it, or the package that offers one cannot be loaded.
        """
        if name in self._own:
            return self._own[name]
        if name not in self._foreign:
            raise InvalidSettingError(
                f"{name!r} is unknown; valid: {', '.join(self.names())} (other packages add to "
                f"them by entry points of the group {self.group})"
            )
        entry = self._foreign[name]
        try:
            found = entry.load()
        except Exception as error:  # whatever another package does at import
            raise InvalidSettingError(
                f"{name!r} is offered by {entry.value}, which cannot be loaded: {error}"
            ) from error
        self._check(name, found)
        self._own[name] = found
        return self._own[name]

    def _check(self, name: str, cls: object) -> None:
        """Refuse what is no class of this kind, and tell one that is its name."""
        if not (isinstance(cls, type) and issubclass(cls, self.base)):
            raise InvalidSettingError(
                f"{name!r} of {self.group} is {cls!r}; expected a subclass of "
                f"{self.base.__module__}.{self.base.__qualname__}"
            )
        cls.kind = name  # type: ignore[attr-defined]

    @cached_property
    def _foreign(self) -> dict[str, EntryPoint]:
        return {entry.name: entry for entry in entry_points(group=self.group)}
