import numpy as np
import pytest
from block_checks import assert_close, golden_cases, random_gaussian, slope
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_models import toy_model

from irlpilco_ros.learning.costs import FeatureMatching, StateCost, saturating_loss
from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.gp.prior_mean import velocity_prior
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.moments.squashing import squash
from irlpilco_ros.learning.policies import LinearPhasePolicy, LinearPolicy, Policy, RbfPolicy
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.prediction.known_part import KnownPart
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.prediction.predicted_trajectory import predict_step, predict_trajectory
from irlpilco_ros.learning.state_layout import StateLayout


def indices(array):
    return tuple(int(i) - 1 for i in array.ravel())


def original_problem(given):
    """Return the objective and the policy of a golden case."""
    hyp = given["hyp"]
    model = DynamicsModel.condition(
        given["X"], given["Y"], Hyperparameters(hyp[:-2].T, hyp[-2], hyp[-1])
    )
    layout = StateLayout(
        len(given["m0"]),
        indices(given["angi"]),
        indices(given["dyni"]),
        indices(given["poli"]),
        indices(given["difi"]),
    )
    limit = given["maxU"].ravel()
    if str(given["pol"]) == "lin":
        policy: Policy = LinearPolicy(given["w"], given["b"].ravel(), limit)
    else:
        widths = given["phyp"][:-2].reshape(-1, len(limit), order="F").T
        policy = RbfPolicy(given["centers"], given["targets"], widths, limit)
    cost = StateCost(
        JointPositions(layout.state_size),
        given["z"].ravel(),
        given["W"],
        discount=float(given["gamma"].item()),
    )
    start = Gaussian(given["m0"].ravel(), given["S0"])
    horizon = int(given["H"].item())
    return Objective(model, start, horizon, layout, cost, "exact"), policy


def free(policy):
    """Return which of the original's parameters are not fixed: its RBF has two widths too many."""
    if isinstance(policy, LinearPolicy):
        return np.full(policy.parameters.size, True)
    outputs, inputs = policy.targets.shape[1], policy.state_size
    widths = np.repeat([[True], [False]], [inputs, 2], axis=0).repeat(outputs, axis=1)
    rest = np.full(policy.centres.size + policy.targets.size, True)
    return np.concatenate([widths.ravel(order="F"), rest])


def original_gradient(gradient, policy):
    """Return our gradient in the original's order: fields by name, each column by column."""
    if isinstance(policy, LinearPolicy):
        size = policy.weights.size
        weights = gradient[:size].reshape(policy.weights.shape)
        return np.concatenate([gradient[size:], weights.ravel(order="F")])
    sizes = np.cumsum([policy.centres.size, policy.targets.size])
    centres, targets, widths = np.split(gradient, sizes)
    widths = widths.reshape(policy.log_widths.shape).T
    fixed = np.zeros((2, widths.shape[1]))
    return np.concatenate(
        [
            np.vstack([widths, fixed]).ravel(order="F"),
            centres.reshape(policy.centres.shape).ravel(order="F"),
            targets.reshape(policy.targets.shape).ravel(order="F"),
        ]
    )


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("traj")))
def test_trajectory_and_gradient_agree_with_the_original(case, given, expected):
    objective, policy = original_problem(given)
    evaluation = objective.evaluate(policy)
    tolerance = 1e-6 if "rbf" in case else 1e-8
    np.testing.assert_allclose(
        evaluation.trajectory.means.T, expected["M"], rtol=tolerance, atol=tolerance
    )
    covariances = np.moveaxis(evaluation.trajectory.covariances, 0, 2)
    scale = np.abs(expected["Sigma"]).max()
    np.testing.assert_allclose(covariances, expected["Sigma"], atol=tolerance * scale)
    assert evaluation.value == pytest.approx(expected["J"].item(), rel=tolerance)
    gradient = original_gradient(evaluation.gradient(), policy)
    wanted = expected["dJdtheta"].ravel()
    exactness = 1e-3 if case == "traj_rbf_04" else 1e-5  # its gram matrix is ill-conditioned
    np.testing.assert_allclose(gradient, wanted, atol=exactness * np.abs(wanted).max())
    differences = expected["dJdtheta_fd"].ravel()
    np.testing.assert_allclose(gradient, differences, atol=1e-3 * np.abs(wanted).max())
    assert evaluation.value == pytest.approx(expected["J_nograd"].item(), rel=tolerance)
    np.testing.assert_array_equal(
        original_gradient(policy.parameters, policy)[free(policy)],
        expected["theta"].ravel()[free(policy)],
    )


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("traj")))
def test_cost_of_every_state_agrees_with_the_original(case, given, expected):
    W = 0.5 * (given["W"] + given["W"].T)
    states = zip(expected["M"].T, np.moveaxis(expected["Sigma"], 2, 0), strict=True)
    losses = [saturating_loss(Gaussian(m, S), given["z"].ravel(), W)[0] for m, S in states]
    np.testing.assert_allclose(losses, expected["cost"].ravel(), rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("traj")))
def test_one_step_and_its_derivatives_agree_with_the_original(case, given, expected):
    objective, policy = original_problem(given)
    known = KnownPart.of(objective.layout, len(policy.control_limit))
    step = predict_step(
        objective.model,
        policy,
        objective.start,
        0,
        objective.layout,
        known,
        np.zeros(len(objective.layout.policy_inputs)),
        objective.approximation,
    )
    tolerance = 1e-6 if "rbf" in case else 1e-8
    scale = np.abs(expected["step_S"]).max()
    np.testing.assert_allclose(step.state.mean, expected["step_m"].ravel(), atol=tolerance)
    np.testing.assert_allclose(step.state.covariance, expected["step_S"], atol=tolerance * scale)
    rng, size = np.random.default_rng(0), len(step.state.mean)
    mean_bar, covariance_bar = rng.standard_normal(size), rng.standard_normal((size, size))
    covariance_bar = covariance_bar + covariance_bar.T
    found = list(step.pullback(mean_bar, covariance_bar))
    found[2] = original_gradient(found[2], policy)
    for value, argument in zip(found, "msp", strict=True):
        wanted = expected[f"dMd{argument}"].T @ mean_bar
        wanted = wanted + expected[f"dSd{argument}"].T @ covariance_bar.ravel(order="F")
        if argument == "s":
            wanted = wanted.reshape(size, size)
            wanted = 0.5 * (wanted + wanted.T)
        exactness = 1e-3 if case == "traj_rbf_04" and argument == "p" else max(tolerance, 1e-7)
        np.testing.assert_allclose(value, wanted, atol=exactness * np.abs(wanted).max())


def toy_objective(approximation, policy_kind):
    rng = np.random.default_rng(4)
    layout = StateLayout(4, angles=(1,), dynamics_inputs=(0, 2, 3, 4, 5), policy_inputs=(0, 1, 4))
    model = toy_model(5 + 2, 4)
    limit = np.array([1.0, 0.5])
    if policy_kind == "linear_phase":
        policy: Policy = LinearPhasePolicy(
            0.3 * rng.standard_normal((2, 3)), rng.standard_normal((2, 3)), 4, limit
        )
    else:
        policy = RbfPolicy(
            rng.standard_normal((5, 3)), rng.standard_normal((5, 2)), np.zeros((1, 3)), limit
        )
    cost = FeatureMatching(
        JointPositions(3), rng.standard_normal((5, 3)), np.array([0.2, 0.5, 1.0]), 0.7, 0.9
    )
    start = random_gaussian(rng, 4, 0.2)
    return Objective(model, start, 4, layout, cost, approximation), policy


@pytest.mark.parametrize("approximation", ["linearised", "first_order", "exact"])
@pytest.mark.parametrize("policy_kind", ["linear_phase", "rbf"])
def test_gradient_agrees_with_finite_differences(approximation, policy_kind):
    objective, policy = toy_objective(approximation, policy_kind)
    _, gradient = objective.value_and_gradient(policy)
    rng = np.random.default_rng(0)
    for _ in range(3):
        change = 0.1 * rng.standard_normal(gradient.shape)

        def along(h, change=change):
            moved = policy.with_parameters(policy.parameters + h * change)
            return objective.evaluate(moved, gradient=False).value

        assert_close(gradient @ change, slope(along, 1e-2), np.abs(gradient * change).sum())


def test_mean_sensitivities_are_exact_without_spread():
    objective, policy = toy_objective("first_order", "linear_phase")
    start = Gaussian(objective.start.mean, 1e-14 * np.eye(4))
    model = toy_model(7, 4, points=60)

    def means(parameters):
        moved = policy.with_parameters(parameters)
        return predict_trajectory(model, moved, start, 2, objective.layout).means

    trajectory = predict_trajectory(model, policy, start, 2, objective.layout)
    change = 0.1 * np.random.default_rng(1).standard_normal(policy.parameters.shape)
    moved = [means(policy.parameters + h * change) for h in (1e-4, -1e-4)]
    found = (moved[0] - moved[1])[1] / 2e-4
    np.testing.assert_allclose(trajectory.mean_sensitivities()[1] @ change, found, atol=1e-6)


def test_value_alone_is_the_same():
    objective, policy = toy_objective("exact", "rbf")
    alone = objective.evaluate(policy, gradient=False)
    assert alone.value == pytest.approx(objective.evaluate(policy).value, rel=1e-12)


def test_against_monte_carlo_of_a_linear_system():
    """With a linear model moment matching is exact, squashing apart: compare with samples."""
    rng = np.random.default_rng(2)
    layout, limit = StateLayout(2), np.array([0.5])
    policy = LinearPolicy(np.array([[-0.4, -0.2]]), np.array([0.1]), limit)
    A = np.array([[0.0, 0.3, 0.2], [-0.1, -0.2, 0.5]])
    hyperparameters = Hyperparameters(np.zeros((2, 3)), np.full(2, -12.0), np.full(2, -14.0))
    model = DynamicsModel.condition(
        np.zeros((1, 3)), np.zeros((1, 2)), hyperparameters, prior_mean=A
    )
    start = Gaussian(np.array([0.3, -0.2]), 0.01 * np.eye(2))
    trajectory = predict_trajectory(model, policy, start, 8, layout)
    x = rng.multivariate_normal(start.mean, start.covariance, 100_000)
    for _ in range(8):
        u = squash(x @ policy.weights.T + policy.bias, limit)
        x = x + np.hstack([x, u]) @ A.T
    errors = x.std(axis=0) / np.sqrt(len(x))
    assert (np.abs(x.mean(axis=0) - trajectory.means[-1]) < 5 * errors + 1e-4).all()
    np.testing.assert_allclose(np.cov(x.T), trajectory.covariances[-1], rtol=0.03, atol=1e-5)


def test_a_model_that_returns_nonsense_is_reported():
    objective, policy = toy_objective("first_order", "linear_phase")

    class Nonsense:
        def predict(self, mean, covariance, approximation="first_order", gradient=True, step=None):
            moments, pullback = objective.model.predict(mean, covariance, approximation, gradient)
            moments.mean[0] = np.nan
            return moments, pullback

    with pytest.raises(NumericalError, match="step 1 of 4"):
        predict_trajectory(Nonsense(), policy, objective.start, 4, objective.layout)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10_000),
    joints=st.integers(1, 3),
    horizon=st.integers(1, 4),
    points=st.integers(1, 20),
    log_lengthscale=st.floats(-5.0, 6.0),
    log_spread=st.one_of(st.just(-np.inf), st.floats(-15.0, 3.0)),
    log_gain=st.floats(-5.0, 4.0),
    kind=st.sampled_from(["linear", "linear_phase", "rbf"]),
    approximation=st.sampled_from(["linearised", "first_order", "exact"]),
)
def test_never_a_bad_number(
    seed, joints, horizon, points, log_lengthscale, log_spread, log_gain, kind, approximation
):
    """From one joint and one step to a start spread far wider than the data."""
    rng, size = np.random.default_rng(seed), 2 * joints
    inputs = rng.standard_normal((points, size + joints))
    inputs[points // 2 :] = inputs[: points - points // 2]
    hyperparameters = Hyperparameters(
        np.full((size, size + joints), log_lengthscale), np.full(size, -1.0), np.full(size, -5.0)
    )
    targets = 0.1 * rng.standard_normal((points, size))
    model = DynamicsModel.condition(
        inputs, targets, hyperparameters, velocity_prior(joints, 0.5) if seed % 2 else None
    )
    gain, limit = np.exp(log_gain), np.ones(joints)
    policy = {
        "linear": LinearPolicy(rng.standard_normal((joints, size)), np.zeros(joints), limit),
        "linear_phase": LinearPhasePolicy(
            rng.standard_normal((joints, size)), rng.standard_normal((joints, 2)), horizon, limit
        ),
        "rbf": RbfPolicy(
            rng.standard_normal((4, size)),
            rng.standard_normal((4, joints)),
            np.zeros((1, size)),
            limit,
        ),
    }[kind]
    policy = policy.with_parameters(gain * policy.parameters)
    root = np.exp(log_spread) * rng.standard_normal((size, size))
    start = Gaussian(rng.standard_normal(size), root @ root.T)
    cost = FeatureMatching(JointPositions(joints), np.zeros((horizon + 1, joints)), np.ones(joints))
    evaluation = Objective(model, start, horizon, StateLayout(size), cost, approximation).evaluate(
        policy
    )
    assert np.isfinite(evaluation.value)
    assert np.isfinite(evaluation.gradient()).all()
    assert np.isfinite(evaluation.curvature()).all()
    for covariance in evaluation.trajectory.covariances:
        values = np.linalg.eigvalsh(covariance)
        assert values.min() >= -1e-9 * max(values.max(), 1e-300)
