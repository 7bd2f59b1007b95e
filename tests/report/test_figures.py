from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection, QuadMesh
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from report_runs import LATE, summary

from irlpilco_ros.experience.path_quality import UNKNOWN
from irlpilco_ros.report import style
from irlpilco_ros.report.debris_figure import DEMONSTRATION, LEARNED, REPLAY, debris_figure
from irlpilco_ros.report.joint_figures import difference_figure, joint_groups, position_figure
from irlpilco_ros.report.model_figure import relevance_figure
from irlpilco_ros.report.progress_figures import error_figure, time_figure, weights_figure
from irlpilco_ros.report.run_summary import UNKNOWN_UNIT, DebrisCount

BAXTER = tuple(
    f"{side}_{joint}"
    for side in ("left", "right")
    for joint in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")
)


def panels(figure: Figure) -> dict[str, Axes]:
    return {axes.get_title(loc="left"): axes for axes in figure.axes if axes.axison}


def colours(axes: Axes) -> dict[Any, np.ndarray]:
    return {line.get_color(): np.asarray(line.get_xydata()) for line in axes.lines}


@pytest.mark.parametrize(
    "joints", [BAXTER, ("a", "b"), ("a", "b", "c", "d"), tuple(f"arm_j{n}" for n in range(7))]
)
def test_every_joint_has_one_panel(joints: tuple[str, ...]) -> None:
    run = summary(joints)
    found = panels(position_figure(run, run.last))
    assert list(found) == [style.pretty(joint) for joint in joints]


@pytest.mark.parametrize(
    ("joints", "groups"),
    [
        (
            ("left_s0", "left_s1", "left_e0", "right_s0", "right_s1", "right_e0"),
            ((0, 1, 2), (3, 4, 5)),
        ),
        (("l_a", "r_a", "head_pan", "l_b", "r_b", "l_c", "r_c"), ((0, 3, 5), (1, 4, 6), (2,))),
        (("panda_joint1", "panda_joint2", "panda_joint3"), ((0, 1, 2),)),
        (
            ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint"),
            ((0, 1, 2, 3),),
        ),
        (("base_joint", "shoulder_joint", "elbow_joint"), ((0, 1, 2),)),
        (("cart", "pole"), ((0, 1),)),
    ],
)
def test_arms_are_told_by_their_joints_names(
    joints: tuple[str, ...], groups: tuple[tuple[int, ...], ...]
) -> None:
    assert joint_groups(joints) == list(map(list, groups))


def test_positions_show_demonstration_prediction_and_robot_over_the_same_times() -> None:
    run = summary(BAXTER)
    lines = colours(panels(position_figure(run, run.last))["left e0"])
    for colour, values in (
        (style.INK, run.demonstration),
        (style.BLUE, run.last.prediction),
        (style.ORANGE, run.last.trial),
    ):
        assert values is not None
        np.testing.assert_allclose(lines[colour][:, 0], run.times)
        np.testing.assert_allclose(lines[colour][:, 1], values[:, 2])


def test_band_is_two_standard_deviations_on_either_side() -> None:
    run = summary(("a", "b"))
    axes = panels(position_figure(run, run.last))["b"]
    band = next(item for item in axes.collections if isinstance(item, PolyCollection))
    corners = np.asarray(band.get_paths()[0].vertices)
    at_end = corners[np.isclose(corners[:, 0], run.times[-1])]
    assert run.last.prediction is not None
    middle = run.last.prediction[-1, 1]
    assert at_end[:, 1].min() == pytest.approx(middle - 2 * 0.006)
    assert at_end[:, 1].max() == pytest.approx(middle + 2 * 0.006)


def test_differences_have_the_demonstration_at_zero_and_one_scale() -> None:
    run = summary(("a", "b"))
    found = panels(difference_figure(run, run.last))
    lines = colours(found["a"])
    np.testing.assert_allclose(lines[style.INK][:, 1], 0.0)
    np.testing.assert_allclose(lines[style.ORANGE][:, 1], 3 * LATE)
    limits = {axes.get_ylim() for axes in found.values()}
    assert len(limits) == 1
    low, high = limits.pop()
    assert low == -high
    assert high > 2 * 0.006


def test_initial_trial_has_no_prediction() -> None:
    run = summary(("a", "b"))
    figure = position_figure(run, run.iterations[0])
    assert style.BLUE not in colours(panels(figure)["a"])
    legends = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    assert [text.get_text() for text in legends[0].texts] == ["demonstration", "robot, trial 0"]


def test_joint_at_rest_looks_at_rest() -> None:
    run = summary(("a", "b"))
    still = dataclasses.replace(run, demonstration=np.zeros_like(run.demonstration))
    trial = dataclasses.replace(run.iterations[0], trial=np.full_like(run.demonstration, 1e-3))
    low, high = panels(position_figure(still, trial))["a"].get_ylim()
    assert high - low >= 0.2


def test_axes_of_joints_have_units() -> None:
    run = summary(("a", "b"))
    for figure in (position_figure(run, run.last), difference_figure(run, run.last)):
        assert figure.get_supxlabel().endswith("[s]")
        assert figure.get_supylabel().endswith("[rad]")


def test_error_has_replay_as_a_line_of_its_own() -> None:
    run = summary(("a", "b"))
    axes = error_figure(run).axes[0]
    lines = colours(axes)
    np.testing.assert_allclose(lines[style.ORANGE], [[0, 1e-3], [1, 2e-3], [2, 3e-3]])
    assert set(lines[style.FAINT][:, 1]) == {0.02}
    expected = [run.predicted_rmse(iteration) for iteration in run.iterations]
    np.testing.assert_allclose(lines[style.BLUE][:, 1], expected)
    assert "[rad]" in axes.get_ylabel()


def test_error_without_replay_and_prediction_is_one_line_and_one_of_the_path() -> None:
    run = summary(("a", "b"), iterations=0)
    run = dataclasses.replace(run, replay=None, replay_rmse=float("nan"))
    assert [line.get_label() for line in error_figure(run).axes[0].lines] == [
        "robot, whole path",
        "robot, at the decisions",
    ]
    coarse = dataclasses.replace(run.last, path=UNKNOWN)
    run = dataclasses.replace(run, iterations=(coarse,))
    assert len(error_figure(run).axes[0].lines) == 1


def test_errors_that_differ_by_a_factor_are_on_a_logarithmic_axis() -> None:
    run = summary(("a", "b"))
    assert error_figure(run).axes[0].get_yscale() == "log"
    near = dataclasses.replace(run, replay_rmse=0.002, iterations=run.iterations[1:])
    axes = error_figure(near).axes[0]
    assert axes.get_yscale() == "linear"
    assert axes.get_ylim()[0] == 0.0


def test_weights_are_written_into_their_cells() -> None:
    run = summary(("a", "b"))
    left, right = weights_figure(run).axes
    cells = {text.get_position(): text.get_text() for text in left.texts}
    assert cells == {(0, 0): "0.10", (0, 1): "0.10", (1, 0): "0.20", (1, 1): "0.20"}
    assert [tick.get_text() for tick in left.get_xticklabels()] == ["1", "2"]
    np.testing.assert_allclose(np.asarray(right.lines[0].get_ydata()), [0.5, 0.25, 0.5 / 3])


def test_weights_before_the_first_iteration() -> None:
    left, right = weights_figure(summary(("a", "b"), iterations=0)).axes
    assert not left.axison
    assert np.size(right.lines[0].get_ydata()) == 1


def test_computing_time_is_stacked_and_robot_time_adds_up() -> None:
    left, right = time_figure(summary(("a", "b"))).axes
    bars = [patch for patch in left.patches if isinstance(patch, Rectangle)]
    tops = [bar.get_y() + bar.get_height() for bar in bars]
    np.testing.assert_allclose(tops, [1.5, 3.0, 4.0, 8.0])
    np.testing.assert_allclose(np.asarray(right.lines[0].get_ydata()), [8.0, 16.0, 24.0])


def test_figures_name_the_unit_of_the_robot() -> None:
    unknown = (UNKNOWN_UNIT, UNKNOWN_UNIT)
    run = dataclasses.replace(summary(("a", "b")), units=unknown, margin_unit="")
    assert position_figure(run, run.last).get_supylabel() == "joint position [rad or m]"
    assert difference_figure(run, run.last).get_supylabel() == "difference [rad or m]", "short"
    assert "[rad or m]" in error_figure(run).axes[0].get_ylabel()
    assert weights_figure(run).axes[1].get_ylabel() == "margin of the weights"


def test_where_joints_turn_and_slide_each_has_its_unit() -> None:
    run = dataclasses.replace(summary(("a", "b")), units=("rad", "m"))
    figure = position_figure(run, run.last)
    assert figure.get_supylabel() == "joint position"
    assert [axes.get_title("left") for axes in figure.axes[:2]] == ["a [rad]", "b [m]"]
    assert "[rad and m]" in error_figure(run).axes[0].get_ylabel()
    sliding = dataclasses.replace(run, units=("m", "m"))
    assert position_figure(sliding, run.last).get_supylabel() == "joint position [m]"


def test_relevance_has_a_name_at_every_row_and_column() -> None:
    model = summary(("left_s0", "left_s1")).model
    assert model is not None
    axes = relevance_figure(model).axes[0]
    mesh = next(item for item in axes.collections if isinstance(item, QuadMesh))
    np.testing.assert_allclose(mesh.get_array().reshape(4, 6), model.relevance)
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["left s0", "left s1"] * 3
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["left s0", "left s1"] * 2
    assert [text.get_text() for text in axes.texts] == ["position", "velocity", "command"]


def test_debris_shows_every_scattering_and_the_means() -> None:
    counts = {DEMONSTRATION: [20, 18], REPLAY: [10, 13], LEARNED: [19, 20]}
    count = DebrisCount((0, 1), 20, {name: np.array(each) for name, each in counts.items()})
    axes = debris_figure(count).axes[0]
    assert [text.get_text() for text in axes.texts] == ["mean 19.0", "mean 11.5", "mean 19.5"]
    marked = [
        list(np.asarray(line.get_ydata()))
        for line in axes.lines
        if line.get_marker() in ("s", "D", "o")
    ]
    assert marked == list(counts.values())
    assert axes.get_ylim()[1] > 20
