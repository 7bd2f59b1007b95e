from __future__ import annotations

import base64
import dataclasses
from html.parser import HTMLParser

import numpy as np
import pytest
from report_runs import summary

from irlpilco_ros.experience.path_quality import UNKNOWN
from irlpilco_ros.report.joint_use import JointUse
from irlpilco_ros.report.page import Artwork, Made, duration, render_page
from irlpilco_ros.report.run_summary import DebrisCount

MADE = Made("2026-11-27 09:54 UTC", "1.2.3", "irlpilco report runs/test")
VOID = {"meta", "img", "input", "br"}


class Page(HTMLParser):
    """Reads a page and checks that its tags are balanced."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self._open: list[str] = []
        self.feed(html)
        assert not self._open

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attributes)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open[-1:] not in (["style"], ["script"]):
            self.text += data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture
def artwork() -> Artwork:
    counts = {"demonstration": np.array([20, 19]), "learned policy": np.array([18, 16])}
    return Artwork(
        error="<svg>error</svg>",
        weights="<svg>weights</svg>",
        time="<svg>time</svg>",
        joints={
            (k, v): f"<svg>{k} {v}</svg>" for k in range(3) for v in ("position", "difference")
        },
        relevance="<svg>relevance</svg>",
        debris="<svg>debris</svg>",
        debris_count=DebrisCount((0, 1), 20, counts),
        filmstrip=b"strip",
        animation=b"film",
    )


def test_page_needs_nothing_else(artwork: Artwork) -> None:
    page = Page(render_page(summary(("a", "b")), artwork, MADE))
    sources = [attributes["src"] or "" for attributes in page.all("img")]
    assert len(sources) == 2 + 6 + 5
    assert all(source.startswith("data:image/") for source in sources)
    assert not page.all("link")
    assert {attributes["href"] for attributes in page.all("a")} == {"#band"}
    assert any(attributes.get("id") == "band" for attributes in page.all("p"))
    assert all("src" not in attributes for attributes in page.all("script"))


def test_pictures_come_back_out_of_the_page(artwork: Artwork) -> None:
    page = Page(render_page(summary(("a", "b")), artwork, MADE))
    found = {base64.b64decode((a["src"] or "").partition(",")[2]) for a in page.all("img")}
    assert {b"strip", b"film", b"<svg>error</svg>", b"<svg>1 difference</svg>"} <= found


def test_every_picture_is_described(artwork: Artwork) -> None:
    page = Page(render_page(summary(("a", "b")), artwork, MADE))
    assert all(len(attributes["alt"] or "") > 20 for attributes in page.all("img"))
    assert page.all("html")[0]["lang"] == "en"


def test_every_iteration_and_view_can_be_chosen(artwork: Artwork) -> None:
    page = Page(render_page(summary(("a", "b")), artwork, MADE))
    buttons = page.all("input")
    iterations = [b["value"] for b in buttons if b["name"] == "iteration"]
    views = [b["value"] for b in buttons if b["name"] == "view"]
    assert [b["value"] for b in buttons if "checked" in b] == ["0", "difference"], "the best trial"
    figures = {figure.get("id") for figure in page.all("figure")}
    assert {f"joints-{k}-{view}" for k in iterations for view in views} <= figures
    # Without a script all of them are seen, and no buttons that do nothing.
    assert not any("hidden" in figure for figure in page.all("figure"))
    assert any(div.get("id") == "joint-controls" and "hidden" in div for div in page.all("div"))


def test_headline_and_tables_have_the_numbers(artwork: Artwork) -> None:
    text = Page(render_page(summary(("a", "b")), artwork, MADE)).text
    for number in ("0.0010 rad", "0.0200", "24\xa0s", "17.0 of 20", "3 trials"):
        assert number in text
    for number in ("0.0020 rad on the whole path", "0.0270", "1.25", "43.5", "1.50"):
        assert number in text
    assert text.index("0.0020") < text.index("0.0010"), "the path comes first"
    assert "nan" not in text
    assert "open-loop replay" in text


def test_the_page_leads_with_the_best_policy_and_how_to_run_it(artwork: Artwork) -> None:
    run = dataclasses.replace(summary(("a", "b")), best_command="ros2 run it")
    html = render_page(run, artwork, MADE)
    text = Page(html).text
    head = text[: text.index("Error over iterations")]
    assert "The best policy so far is that of iteration 0" in head
    assert "The latest trial, 2, is not the best: 0.0060 rad on the whole path" in head
    assert head.index("iteration 0") < head.index("ros2 run it") < head.index("latest trial")
    assert "Right: the best trial, that of iteration 0." in text
    assert "0, initial trial, best" in text
    assert text.count(", best") == 3, "in the tables of errors, accelerations and computing"
    unknown = dataclasses.replace(run, best_command="")
    assert "without a learner" not in Page(render_page(unknown, artwork, MADE)).text
    last = dataclasses.replace(run.last, mse=0.0)
    best = dataclasses.replace(run, iterations=(*run.iterations[:-1], last))
    assert "is not the best" not in Page(render_page(best, artwork, MADE)).text


def test_the_page_tells_when_and_by_what_it_was_made(artwork: Artwork) -> None:
    text = Page(render_page(summary(("a", "b")), artwork, MADE)).text
    assert "Made 2026-11-27 09:54 UTC by irlpilco_ros 1.2.3: irlpilco report runs/test" in text


def test_what_lies_within_the_band_is_told_of_each_trial_and_explained(artwork: Artwork) -> None:
    run = summary(("a", "b"))
    text = Page(render_page(run, artwork, MADE)).text
    assert "within its band [%]" in text
    assert "about 95 %" in text
    for each in run.iterations[1:]:
        assert f"{100 * run.coverage(each):.0f} % of what was measured lies within" in text
    first = dataclasses.replace(run, iterations=run.iterations[:1])
    bare = dataclasses.replace(artwork, relevance=None, joints={(0, "difference"): "<svg/>"})
    assert "about 95 %" not in Page(render_page(first, bare, MADE)).text, "nothing was predicted"


USES = (
    JointUse("a_1", (-0.5, 0.25), (-1.0, 1.0), 0.75, 0.6, 1.5, 0.81, 1.5),
    JointUse("b", (-0.5, 0.95), (-1.0, 1.0), 0.25, 0.3, 1.5, float("nan"), float("nan")),
)


def test_limits_and_what_was_used_of_them_are_told(artwork: Artwork) -> None:
    run = dataclasses.replace(summary(("a_1", "b")), uses=USES)
    text = Page(render_page(run, artwork, MADE)).text
    assert "Fastest for its limit: a 1, 50\xa0% of 1.5\xa0rad/s." in text
    assert "Nearest to an end of its range: b, 0.05\xa0rad before it." in text
    assert "\u22120.50 … 0.25" in text
    assert "largest command" in text
    assert "Limits and speeds" not in Page(render_page(summary(("a",)), artwork, MADE)).text


def test_efforts_have_limits_of_their_own_and_sliding_joints_their_unit(artwork: Artwork) -> None:
    run = summary(("a_1", "b"))
    run = dataclasses.replace(run, commands="efforts", units=("rad", "m"), uses=USES)
    text = Page(render_page(run, artwork, MADE)).text
    assert "largest effort" in text
    for words in ("a 1 [rad]", "b [m]", "largest speed, per s", "0.05\xa0m before it", "rad and m"):
        assert words in text
    alike = dataclasses.replace(run, units=("m", "m"))
    assert "largest speed [m/s]" in Page(render_page(alike, artwork, MADE)).text
    assert "nan" not in text


def test_a_phone_gets_figures_and_tables_that_scroll(artwork: Artwork) -> None:
    run = dataclasses.replace(summary(("a", "b")), uses=USES)
    page = Page(render_page(run, artwork, MADE))
    metas = {attributes.get("name"): attributes.get("content") for attributes in page.all("meta")}
    assert metas["viewport"] == "width=device-width, initial-scale=1"
    boxes = [attributes["class"] or "" for attributes in page.all("div") if "class" in attributes]
    assert sum(box.startswith("pan") for box in boxes) == len(page.all("img"))
    assert boxes.count("scroll") == len(page.all("table")) - 1, "all but the settings, which wrap"


def test_a_run_whose_path_is_not_known_speaks_of_the_decisions_alone(artwork: Artwork) -> None:
    run = summary(("a", "b"))
    coarse = tuple(dataclasses.replace(each, path=UNKNOWN) for each in run.iterations)
    run = dataclasses.replace(run, iterations=coarse)
    text = Page(render_page(run, artwork, MADE)).text
    assert "to within 0.0010 rad (root mean square)" in text
    assert "whole path" not in text
    assert "nan" not in text


def test_what_is_missing_is_said(artwork: Artwork) -> None:
    bare = dataclasses.replace(
        artwork, filmstrip=None, animation=None, debris=None, debris_count=None,
        relevance=None, notes=("Pictures are left out: install <libegl1>.",),
    )  # fmt: skip
    html = render_page(summary(("a", "b")), bare, MADE)
    assert "install &lt;libegl1&gt;" in html
    text = Page(html).text
    assert "debris" not in text
    assert "What matters" not in text


def test_names_are_escaped(artwork: Artwork) -> None:
    run = dataclasses.replace(summary(("a", "b")), name="<b>&", settings={"k<": "v&"})
    html = render_page(run, artwork, MADE)
    assert "&lt;b&gt;&amp;" in html
    assert "k&lt;" in html
    assert "<b>&" not in html


def test_run_without_replay_does_not_speak_of_it(artwork: Artwork) -> None:
    run = dataclasses.replace(summary(("a", "b")), replay=None, replay_rmse=float("nan"))
    html = render_page(run, artwork, MADE)
    assert "nan" not in html
    assert "<td>open-loop replay</td>" not in html


def test_remarks_of_an_iteration_are_shown(artwork: Artwork) -> None:
    run = summary(("a", "b"))
    last = dataclasses.replace(run.last, notes=("jitter was added",))
    run = dataclasses.replace(run, iterations=(*run.iterations[:-1], last))
    assert "Iteration 2: jitter was added" in render_page(run, artwork, MADE)


def test_a_robot_that_was_shown_twice_and_is_commanded_efforts(artwork: Artwork) -> None:
    run = dataclasses.replace(summary(("a", "b")), demonstrations=2, commands="efforts")
    text = Page(render_page(run, artwork, MADE)).text
    assert "learned from 2 demonstrations" in text
    assert "shown the task 2 times" in text
    assert "demonstrated efforts" in text
    assert "velocities" not in text


TWO_ARMS = tuple(f"{side}_{joint}" for side in ("left", "right") for joint in ("s0", "s1", "e0"))


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        (("left_s0", "left_s1"), "The arm is guided"),
        (("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"), "The arm is guided"),
        (TWO_ARMS, "The arms are guided"),
    ],
)
def test_arms_are_counted(artwork: Artwork, joints: tuple[str, ...], words: str) -> None:
    assert words in Page(render_page(summary(joints), artwork, MADE)).text


def test_sentences_that_do_not_apply_are_left_out(artwork: Artwork) -> None:
    run = dataclasses.replace(summary(("a",), iterations=0), replay=None, replay_rmse=float("nan"))
    bare = dataclasses.replace(artwork, relevance=None)
    bare = dataclasses.replace(bare, joints={(0, "position"): "<svg/>"})
    text = Page(render_page(run, bare, MADE)).text
    assert "1 joint ·" in text
    assert "Diamonds" not in text
    assert "velocities" not in text


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.4, "0.4 s"),
        (64.0, "64 s"),
        (99.7, "1 min 40 s"),
        (125.0, "2 min 5 s"),
        (4320, "1 h 12 min"),
    ],
)
def test_durations_are_said_as_one_says_them(seconds: float, words: str) -> None:
    assert duration(seconds).replace("\xa0", " ") == words
