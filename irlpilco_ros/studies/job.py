"""One result of a study: computed once, for one condition and one seed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from irlpilco_ros.learning.errors import IrlPilcoError

Result = dict[str, Any]
"""What JSON can hold; {"failed": why} if the robot or the numerics gave up."""

FAILED = "failed"


@dataclass(frozen=True)
class Job:
    """What is computed for one condition of an experiment and one seed.

    Attributes:
        experiment: Name of the experiment; a folder of results.
        condition: What is varied; a folder in it.
        seed: Of everything random in it; a file in that.
        function: A function of a module, so that other processes can call it. It gets the
            arguments by name, and the results of `needs` as `needed`, if there are any.
        arguments: Numbers, texts and frozen dataclasses, whose `repr` tells them apart.
        needs: Jobs whose results it starts from.
    """

    experiment: str
    condition: str
    seed: int
    function: Callable[..., Result]
    arguments: Mapping[str, Any] = field(default_factory=dict)
    needs: tuple[Job, ...] = ()

    @property
    def description(self) -> str:
        """All that the result depends on, as one text: a result of another one is not this one's.

        The version of the code is not in it: whoever changes the algorithm starts a new folder.
        """
        arguments = ", ".join(f"{name}={value!r}" for name, value in sorted(self.arguments.items()))
        needs = "; ".join(need.description for need in self.needs)
        return f"{self.function.__module__}.{self.function.__name__}({arguments}) [{needs}]"

    def compute(self, needed: Sequence[Result]) -> Result:
        """Return the result; a robot that cannot go on and numerics that give up are results too.

        Args:
            needed: Results of `needs`, in that order.
        """
        for result in needed:
            if FAILED in result:
                return {FAILED: f"what it starts from failed: {result[FAILED]}"}
        inputs = {"needed": list(needed)} if self.needs else {}
        try:
            return self.function(**self.arguments, **inputs)
        except IrlPilcoError as error:
            return {FAILED: f"{type(error).__name__}: {error}"}
