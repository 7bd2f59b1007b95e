"""The short version of the study of demonstrations that differ in an elbow: one iteration."""

import numpy as np
import pytest

from irlpilco_ros import cli
from irlpilco_ros.studies.baxter import elbows
from irlpilco_ros.studies.result_store import ResultStore
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.tool_kinematics import ToolKinematics

TIMES = np.arange(0.0, 8.0, 0.25)


def postures():
    motions = [elbows.elbow_motion(pull) for pull in elbows.PULLS]
    return np.array([[motion.at(time)[0] for time in TIMES] for motion in motions])


def test_elbows_go_three_ways_and_the_tools_one_but_the_mean_of_the_joints_goes_another():
    shown, tools = postures(), ToolKinematics()
    np.testing.assert_allclose(shown[1:, 0], shown[[0, 0], 0], atol=1e-3)  # they begin as one
    pulled = shown[:, :, ARM_JOINTS.index("right_e0")]
    assert (np.abs(pulled[1:, 8:] - pulled[0, 8:]) > 0.1).all()
    np.testing.assert_allclose(shown[1:, :, :7], shown[[0, 0], :, :7], atol=1e-3)
    as_shown = tools(shown[0])[0]
    for posture in shown[1:]:
        np.testing.assert_allclose(tools(posture)[0], as_shown, atol=3e-4)
    brush = (tools(shown.mean(axis=0))[0] - as_shown)[:, 3:]
    assert np.sqrt((brush**2).sum(axis=1).mean()) > 0.015


@pytest.mark.slow
def test_the_posture_that_differs_counts_least_and_the_brush_most():
    job = elbows.elbows_job("price 1, max margin beyond the spread", 0, iterations=1)
    first, second = job.compute([])["rows"]
    assert second["tools"][1] < 0.4 * first["tools"][1]
    weights = np.array(second["weights"])
    brush, arm = weights[9:18], weights[-7:]
    assert brush.max() == weights.max()
    # Of the arm with the brush only the elbow's own angle is the same in all demonstrations.
    assert sum(arm > 0.11 * weights.max()) <= 1


def test_table_of_elbows(tmp_path, capsys):
    store = ResultStore(tmp_path)
    row = {"joints": 0.005, "tools": [0.002, 0.003], "pieces": 19, "weights": []}
    for number, variant in enumerate(elbows.VARIANTS):
        rows = [{**row, "tools": [0.002, 1e-3 * (number + k)]} for k in range(6)]
        store.write(elbows.elbows_job(variant, 0), {"rows": rows})
    words = ["study", "baxter", "--experiments", "elbows", "--seeds", "1", "--tables-only"]
    assert cli.main([*words, "--out", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "| brush tip [mm]: price 1, uniform | 2.0 | 4.0 | 6.0 | 1 |" in shown
    assert "| pieces of 20: price 1, max margin | 19 | 19 | 19 | 1 |" in shown
    assert "| joints [mrad]: price 0.1 by hand, uniform | 5.0 | 5.0 | 5.0 | 1 |" in shown
