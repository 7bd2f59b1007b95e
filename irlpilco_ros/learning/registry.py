"""Names of classes that can be chosen in a settings file, ours and those of other packages.

A class of this package registers itself by a decorator; a class of another distribution is found by
an entry point of the registry's group (importlib.metadata), and is loaded when it is first used.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, is_dataclass
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Any, ClassVar, Generic, TypeVar

from irlpilco_ros.learning.errors import InvalidSettingError

_LOGGER = logging.getLogger(__name__)


@dataclass(frozen=True)
class NoSettings:
    """What an extension without settings is set by."""


class Extension:
    """What can be chosen by a name and have settings of its own: base of what a registry holds.

    Attributes:
        kind: The name; the registry tells the class.
        Settings: Dataclass made with `setting()`. Its fields are settings named `<kind>.<field>`.
    """

    kind: ClassVar[str]
    Settings: ClassVar[type[Any]] = NoSettings

    @classmethod
    def check_class(cls) -> None:
        """Check a class before it is registered.

        Raises:
            InvalidSettingError: it does not declare what it should.
        """


Kind = TypeVar("Kind", bound=Extension)


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
        self._loaded: dict[str, type[Kind]] = {}
        self._broken: set[str] = set()

    def register(self, name: str) -> Callable[[type[Kind]], type[Kind]]:
        """Return a class decorator that makes the class known, and known to itself, by a name."""

        def decorate(cls: type[Kind]) -> type[Kind]:
            if name in self._own:
                raise InvalidSettingError(f"{self.group} has a class named {name!r} already")
            self._own[name] = self._named(name, cls)
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
        found = self._own.get(name) or self._loaded.get(name)
        if found is not None:
            return found
        if name not in self._foreign:
            raise InvalidSettingError(
                f"{name!r} is unknown; valid: {', '.join(self.names())} (other packages add to "
                f"them by entry points of the group {self.group})"
            )
        entry = self._foreign[name]
        try:
            loaded = entry.load()
        except Exception as error:  # whatever another package does at import
            raise InvalidSettingError(
                f"{name!r} is offered by {entry.value}, which cannot be loaded: {error}"
            ) from error
        self._loaded[name] = self._named(name, loaded)
        return self._loaded[name]

    def classes(self) -> list[type[Kind]]:
        """Return the classes of all names, but for those of packages that cannot be loaded.

        What is wrong with these is logged once, and raised by `get` for whoever wants them.
        """
        found = []
        for name in self.names():
            try:
                found.append(self.get(name))
            except InvalidSettingError as error:
                if name not in self._broken:
                    self._broken.add(name)
                    _LOGGER.warning("%s", error)
        return found

    def _named(self, name: str, cls: Any) -> type[Kind]:
        """Tell a class its name, and return it; what is no class of this kind is refused."""
        if not (isinstance(cls, type) and issubclass(cls, self.base)):
            raise InvalidSettingError(
                f"{name!r} of {self.group} is {cls!r}; expected a subclass of "
                f"{self.base.__module__}.{self.base.__qualname__}"
            )
        if not name.isidentifier():
            raise InvalidSettingError(
                f"{name!r} of {self.group} is no name; expected letters, digits and underscores"
            )
        if not is_dataclass(cls.Settings):
            raise InvalidSettingError(f"Settings of {name!r} of {self.group} is no dataclass")
        cls.check_class()
        cls.kind = name
        return cls

    @cached_property
    def _foreign(self) -> dict[str, EntryPoint]:
        return {entry.name: entry for entry in entry_points(group=self.group)}
