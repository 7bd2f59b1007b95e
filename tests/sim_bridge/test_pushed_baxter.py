import numpy as np

from sim_bridge.pushed_baxter import PushedBaxter


def test_a_push_moves_the_pushed_arm_and_ends():
    robot, calm = PushedBaxter(), PushedBaxter()
    robot.push("right_hand", (0.0, -20.0, 0.0), 0.3)
    for _ in range(30):
        robot.step()
        calm.step()
    moved = np.abs(robot.true_positions - calm.true_positions)
    assert moved[7:].max() > 0.02
    assert moved[:7].max() < 1e-3
    assert robot.data.xfrc_applied.any()
    robot.step()
    assert not robot.data.xfrc_applied.any()
