"""`make faults`: its table tells what came of the tries, and its tries come out as they were."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks.faults.motions import ENDING, LASTING  # noqa: E402
from benchmarks.faults.table import BAR, Fault, Outcome, markdown  # noqa: E402
from benchmarks.faults.workplace import UNDISTURBED, workplace  # noqa: E402


def row(*outcomes: Outcome) -> list[str]:
    """Return the cells of a fault's row but for its name."""
    return markdown([Fault("it falls", outcomes)]).splitlines()[-1].split(" | ")[1:]


def test_a_row_tells_median_and_longest_time_losses_and_the_last_words():
    outcomes = [Outcome(f"told {i}", 0.01 * i, i % 2) for i in (1, 2, 9)]
    assert row(*outcomes) == ["3", "0.020, at most 0.090", "**2**", "told 9 |"]
    assert row(Outcome("said", BAR + 0.01, 0))[1:3] == ["0.160, at most **0.160**", "0"]
    assert row(Outcome("", math.inf, 0), Outcome("", 0.1, 0))[1] == "not stopped in 1"
    assert row(Outcome("said"))[1:3] == ["-", "-"]


def test_what_is_told_fits_in_a_cell():
    told = "a | b\n/tmp/x1/run/000 is torn " + "word " * 100
    cell = row(Outcome(told))[-1]
    assert cell.startswith("a \\| b 000 is torn word")
    assert len(cell) < 230


@pytest.mark.parametrize(
    ("outcome", "held"),
    [
        (Outcome("said", BAR, 0), True),
        (Outcome("said"), True),
        (Outcome("", 0.01, 0), False),
        (Outcome("said", BAR + 0.001, 0), False),
        (Outcome("said", math.inf), False),
        (Outcome("said", 0.01, 1), False),
    ],
)
def test_what_went_well(outcome, held):
    assert Fault("it falls", (Outcome("said", 0.01, 0), outcome)).held == held


def test_every_fault_has_a_row_of_its_own_in_the_page():
    names = [name for name, _ in (*ENDING, *LASTING)]
    assert len(set(names)) == len(names)
    page = (ROOT / "docs" / "reliability.md").read_text(encoding="utf-8")
    assert [name for name in names if f"| {name} |" not in page] == []


@pytest.mark.dds
def test_a_try_stops_the_robot_and_loses_nothing():
    with workplace() as place:
        outcome = place.run(dict(ENDING)["`controller/stop`"])
    assert outcome.told.endswith("trial stopped: controller/stop was called")
    assert outcome.lost == 0
    assert outcome.stopped_after is not None
    assert 0.0 < outcome.stopped_after < UNDISTURBED + 3.0
    for _ in range(3):  # where a busy computer is late with joint states, stopping is right
        with workplace() as place:
            outcome = place.run(lambda _: None, ends_trial=False)
            if "no joint state for" in outcome.told:
                continue
            assert outcome == Outcome("the trial goes on", None, 0)
            place.lost(place.bag)
            [file] = place.bag.glob("*.mcap")
            with file.open("rb+") as storage:
                storage.truncate(file.stat().st_size // 2)
            assert place.lost(place.bag) > 0
            return
    pytest.fail(outcome.told)
