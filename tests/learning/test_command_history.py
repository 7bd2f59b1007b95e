"""A robot that lags: its last commands are part of the state."""

import numpy as np
import pytest
from block_checks import slope
from scipy.stats import multivariate_normal

from irlpilco_ros.learning import Iteration, LearningSettings, Rollout, Task, apprenticeship
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import JointMotion, JointPositions
from irlpilco_ros.learning.gp.evidence import negative_log_evidence
from irlpilco_ros.learning.gp.kernel import Hyperparameters, squared_exponential
from irlpilco_ros.learning.gp.linear_part import LinearPart
from irlpilco_ros.learning.joints import Joints, PolicyOf
from irlpilco_ros.learning.lag import with_known_history
from irlpilco_ros.learning.learn import expected_cost, learn, start_state
from irlpilco_ros.learning.moments.moment_matching import MomentMatching
from irlpilco_ros.learning.policies import LinearPolicy, SmoothPhasePolicy
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.prediction.predicted_trajectory import predict_trajectory
from irlpilco_ros.learning.prediction.prior_mean import servo_part, velocity_mean
from irlpilco_ros.learning.prediction.trial_data import train_on_trials
from irlpilco_ros.learning.state_layout import StateLayout

J, H, DT = 2, 10, 0.25
ROBOT = Joints(("a", "b"))


def lagging_trial(policy, lag=1, seed=0, spread=0.0):
    """Joints at the speed of the command `lag` periods ago, with gains of their own."""
    rng = np.random.default_rng(seed)
    acting = PolicyOf(ROBOT, policy)
    position, velocity = np.zeros(J), np.zeros(J)
    told = [np.zeros(J)] * lag
    states, controls = [], []
    for t in range(H):
        measured = np.concatenate([position, velocity]) + 1e-4 * rng.standard_normal(2 * J)
        states.append(measured)
        controls.append(acting.act(measured, t) + spread * rng.standard_normal(J))
        told.append(controls[-1])
        velocity = np.array([0.8, 1.1]) * told[-1 - lag]
        position = position + DT * velocity
    states.append(np.concatenate([position, velocity]))
    return Rollout(np.array(states), np.array(controls))


def shown():
    times = np.linspace(0.0, 1.0, H + 1)[:, None]
    positions = np.hstack([0.5 * times**2 * (3 - 2 * times), -0.3 * times**2 * (3 - 2 * times)])
    velocities = np.gradient(positions, DT, axis=0)
    return Rollout(np.hstack([positions, velocities]), np.full((H, J), np.nan))


def task(**changes):
    noise = {"position_noise": 1e-3, "velocity_noise": 1e-3}
    return Task((shown(),), DT, np.array([2.0, 2.0]), **{**noise, **changes})


def settings(**changes):
    usual = {"threads": 1, "command_history": 1, "prior_mean": "identified"}
    return LearningSettings(**{**usual, **changes})


def test_whole_states_hold_the_last_commands_latest_first():
    layout = StateLayout(3).remembering(2, 2)
    states, controls = np.arange(12.0).reshape(4, 3), 10.0 + np.arange(6.0).reshape(3, 2)
    whole = layout.whole_states(states, controls)
    np.testing.assert_array_equal(whole[:, :3], states)
    np.testing.assert_array_equal(whole[0, 3:], np.zeros(4))
    np.testing.assert_array_equal(whole[1, 3:], [10.0, 11.0, 0.0, 0.0])
    np.testing.assert_array_equal(whole[3, 3:], [14.0, 15.0, 12.0, 13.0])
    by_state, by_control = layout.known_part
    for before, after, control in zip(whole[:-1], whole[1:], controls, strict=True):
        known = by_state @ before + by_control @ control
        np.testing.assert_array_equal(known[3:], after[3:])
        np.testing.assert_array_equal(known[:3], before[:3])


def test_sines_and_cosines_stay_where_they_are_seen():
    joints = Joints(("a", "b"), continuous=("b",))
    layout = joints.layout.remembering(2, 1)
    state = np.array([0.1, 0.7, 0.2, 0.3, 5.0, 6.0])
    seen = [0.1, 0.2, 0.3, 5.0, 6.0, np.sin(0.7), np.cos(0.7)]
    np.testing.assert_allclose(layout.policy_view(state), seen)
    np.testing.assert_allclose(layout.dynamics_view(state), seen)
    noise = layout.policy_noise(np.array([0.1, 0.2, 0.3, 0.4]))
    np.testing.assert_allclose(noise, [0.01, 0.09, 0.16, 0.0, 0.0, 0.04, 0.04])


def test_a_layout_remembers_once_and_only_what_fits():
    assert StateLayout(4).remembering(2, 0) == StateLayout(4)
    with pytest.raises(InvalidSettingError, match="holds 1 commands already"):
        StateLayout(4).remembering(2, 1).remembering(2, 1)
    with pytest.raises(InvalidSettingError, match="cannot hold 3 commands of 2 controls"):
        StateLayout(4, controls=2, history=3)


def problem(kind, continuous=()):
    joints = Joints(ROBOT.names, continuous=continuous)
    given = task(layout=joints.layout, features=JointPositions.of_robot(joints)).remembering(2)
    rng = np.random.default_rng(1)
    policy = SmoothPhasePolicy(
        0.2 * rng.standard_normal((J, given.policy_size)),
        0.2 * rng.standard_normal((J, 4)),
        H,
        np.array([2.0, 2.0]),
        0.1 * rng.standard_normal((H, given.policy_size)),
        0.5,
    )
    trials = [lagging_trial(LinearPolicy(np.zeros((J, 4)), np.ones(J), np.ones(J)), spread=0.3)]
    layout = given.state_layout
    model = train_on_trials(
        trials,
        layout,
        velocity_mean(layout, J, DT),
        None,
        1,
        linear=servo_part(layout, J, DT) if kind == "identified" else None,
    )
    weights = np.ones(given.feature_map.size)
    return expected_cost(given, settings(), model, trials, weights), policy


@pytest.mark.parametrize("kind", ["velocity", "identified"])
@pytest.mark.parametrize("continuous", [(), ("b",)])
def test_gradient_agrees_with_finite_differences(kind, continuous):
    objective, policy = problem(kind, continuous)
    _, gradient = objective.value_and_gradient(policy)
    rng = np.random.default_rng(2)
    for _ in range(4):
        change = rng.standard_normal(len(policy.parameters))

        def along(h, change=change):
            moved = policy.with_parameters(policy.parameters + h * change)
            return objective.evaluate(moved, gradient=False).value

        assert gradient @ change == pytest.approx(slope(along), rel=2e-6)


def test_mean_sensitivities_are_exact_without_spread():
    objective, policy = problem("identified")
    start = start_state(task().remembering(2), [lagging_trial(policy)])
    certain = type(start)(start.mean, 0.0 * start.covariance)

    def means(h):
        moved = policy.with_parameters(policy.parameters + h * change)
        return predict_trajectory(
            objective.model, moved, certain, 3, objective.layout, gradient=False
        ).means

    change = np.random.default_rng(3).standard_normal(len(policy.parameters))
    trajectory = predict_trajectory(objective.model, policy, certain, 3, objective.layout)
    expected = trajectory.mean_sensitivities() @ change
    found = (means(1e-5) - means(-1e-5)) / 2e-5
    # Predicted means also depend on the spread, which grows from step to step.
    np.testing.assert_allclose(found[:2], expected[:2], atol=1e-6 * np.abs(expected).max())
    np.testing.assert_allclose(found, expected, atol=2e-2 * np.abs(expected).max())


def test_a_policy_is_told_what_it_commanded_before():
    weights = np.zeros((J, 2 * J + 2 * J))
    weights[:, 4:] = [[1.0, 0.0, 10.0, 0.0], [0.0, 1.0, 0.0, 10.0]]
    seen = []

    class Spy(LinearPolicy):
        def act(self, state, step):
            seen.append(state[4:])
            return np.array([step + 1.0, -step - 1.0])

    acting = PolicyOf(ROBOT, Spy(weights, np.zeros(J), np.ones(J)))
    for step in range(3):
        acting.act(np.zeros(4), step)
    np.testing.assert_array_equal(seen, [[0, 0, 0, 0], [1, -1, 0, 0], [2, -2, 1, -1]])
    with pytest.raises(InvalidSettingError, match="each remembered command 2 more"):
        PolicyOf(ROBOT, LinearPolicy(np.zeros((J, 5)), np.zeros(J), np.ones(J)))


def test_the_servos_gains_and_delay_are_identified():
    policy = LinearPolicy(np.zeros((J, 4)), np.zeros(J), np.ones(J))
    trials = [lagging_trial(policy, seed=seed, spread=0.4) for seed in range(3)]
    layout = StateLayout(2 * J).remembering(J, 1)
    prior = velocity_mean(layout, J, DT)
    model = train_on_trials(
        trials,
        layout,
        prior,
        None,
        1,
        hyperprior="dimension_scaled",
        linear=servo_part(layout, J, DT),
    )
    # Next velocity = gain u[k-1]; inputs are [positions, velocities, u[k-1], u].
    expected = np.zeros((J, 8))
    expected[:, 2:4] = -np.eye(J)
    expected[:, 4:6] = np.diag([0.8, 1.1])
    np.testing.assert_allclose(model.prior_mean[J:], expected, atol=0.02)
    np.testing.assert_allclose(model.prior_mean[:J, 4:6], DT * expected[:, 4:6], atol=0.02)


def test_what_is_not_known_of_the_coefficients_widens_predictions():
    rng = np.random.default_rng(4)
    inputs = rng.standard_normal((20, 3))
    part = LinearPart(np.array([[1, 2]]), np.array([[1.0, 0.5]]))
    targets = inputs[:, 1:2] + 0.01 * rng.standard_normal((20, 1))
    given = Hyperparameters(np.zeros((1, 3)), np.array([-3.0]), np.array([-2.0]), np.zeros(1))
    mean, S = np.array([0.3, 1.0, -2.0]), 0.01 * np.eye(3)
    spreads = []
    for count in (5, 20):
        data = inputs[:count], targets[:count]
        model = DynamicsModel.condition(*data, given, linear=part)
        plain = MomentMatching(model.posterior, model.prior_mean)
        known = plain.moments(mean, S, "first_order")[0].covariance
        spreads.append((model.predict(mean, S)[0].covariance - known).item())
        # The coefficients' own posterior: Bayesian regression beside the kernel.
        kernel = squared_exponential(data[0], data[0], np.ones(3), np.exp(-6.0))
        kernel += np.exp(-4.0) * np.eye(count)
        z = part.of(data[0], 0)
        C = np.linalg.inv(np.eye(2) + z.T @ np.linalg.solve(kernel, z)) * np.outer(
            [1, 0.5], [1, 0.5]
        )
        expected = mean[1:] @ C @ mean[1:] + np.sum(C * S[1:, 1:])
        assert spreads[-1] == pytest.approx(expected)
        theta = C @ (z / [1, 0.5]).T @ np.linalg.solve(kernel, data[1])
        np.testing.assert_allclose(model.prior_mean[0, 1:], theta[:, 0])
    assert spreads[0] > spreads[1]


@pytest.mark.parametrize("features", ["joints", "motion"])
def test_a_robot_that_lags_is_learned_in_three_iterations(features):
    features = JointPositions(J) if features == "joints" else JointMotion(J, 0.17)
    chosen = settings(policy="smooth_phase", options={"smooth_phase.count": 8})
    errors = []
    for iteration in apprenticeship(task(features=features), chosen, lagging_trial):
        off = iteration.trial.states - shown().states
        errors.append(float(np.sqrt(np.mean(off[2:, :J] ** 2))))
        if iteration.index == 3:
            break
    assert iteration.policy.state_size == 6
    assert iteration.predicted_means.shape == (H + 1, 2 * J)
    assert errors[0] > 0.05
    assert errors[-1] < 0.01


def test_evidence_with_further_parts_and_its_gradient():
    rng = np.random.default_rng(5)
    inputs, targets = rng.standard_normal((12, 3)), rng.standard_normal(12)
    linear = inputs[:, 1:] * [1.0, 0.5]
    groups = np.eye(4)[np.arange(12) % 4]
    grams = (linear @ linear.T, groups @ groups.T)
    parameters = 0.3 * rng.standard_normal(7)
    value, gradient = negative_log_evidence(inputs, targets, parameters, grams)
    signal, noise, scale, repeated = np.exp(2.0 * parameters[3:])
    K = squared_exponential(inputs, inputs, np.exp(parameters[:3]), signal)
    K += noise * np.eye(12) + scale * grams[0] + repeated * grams[1]
    assert value == pytest.approx(-multivariate_normal(np.zeros(12), K).logpdf(targets))
    for i in range(7):

        def along(h, i=i):
            moved = parameters + h * np.eye(7)[i]
            return negative_log_evidence(inputs, targets, moved, grams)[0]

        assert gradient[i] == pytest.approx(slope(along), rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("lag", [0, 1, 2])
def test_the_first_trial_tells_how_many_commands_matter(lag):
    chosen = settings(command_history=-1, prior_mean="identified", evaluations=2)
    policy = LinearPolicy(np.zeros((J, 4)), np.zeros(J), np.ones(J))
    trial = lagging_trial(policy, lag, spread=0.4)
    assert with_known_history(task(), chosen, [trial]).command_history == lag
    assert with_known_history(task(), settings(command_history=2), [trial]).command_history == 2
    found = learn(task(), chosen, [trial])
    assert found.policy.state_size == 2 * J + lag * J
    again = learn(task(), chosen, [trial, lagging_trial(found.policy, lag, seed=1)], found)
    assert again.policy.state_size == found.policy.state_size


def test_a_prior_mean_of_velocities_needs_every_joint_commanded():
    joints = Joints(("cart", "pole"), ("pole",), ("pole",))
    with pytest.raises(InvalidSettingError, match="set prior_mean: zero"):
        velocity_mean(joints.layout, 1, DT)


def test_an_iteration_is_written_and_read_with_its_linear_part():
    chosen = settings(policy="smooth_phase", options={"smooth_phase.count": 6}, evaluations=2)
    loop = apprenticeship(task(), chosen, lagging_trial)
    first, found = next(loop), next(loop)
    again = Iteration.from_arrays(found.to_arrays()).hyperparameters
    np.testing.assert_array_equal(again.log_linear, found.hyperparameters.log_linear)
    assert Iteration.from_arrays(first.to_arrays()).hyperparameters.log_linear is None
