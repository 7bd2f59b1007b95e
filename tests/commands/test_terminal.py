"""Progress: plain lines in a log, a bar in a terminal."""

from __future__ import annotations

import io
import time

from irlpilco_ros.commands.terminal import ProgressDisplay


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_plain_lines_come_with_the_stage_and_then_seldom(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    stream = io.StringIO()
    with ProgressDisplay("iteration 2", stream) as display:
        for step in range(12):
            now[0] = float(step)
            display.update("model" if step < 2 else "policy", step / 12, f"step {step}")
    assert stream.getvalue().splitlines() == [
        "iteration 2: model, 0 % step 0",
        "iteration 2: policy, 17 % step 2",
        "iteration 2: policy, 58 % step 7",
    ]


def test_a_terminal_gets_one_bar_that_is_gone_in_the_end():
    stream = Terminal()
    with ProgressDisplay("iteration 2", stream) as display:
        display.update("model", 0.5, "cost 3.2")
    text = stream.getvalue()
    assert "iteration 2: model |" in text
    assert "50%" in text
    assert ", cost 3.2" in text
    assert "\n" not in text
    assert text.split("\r")[-2].strip() == ""
