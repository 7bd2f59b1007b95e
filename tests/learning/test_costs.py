from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from block_checks import assert_close, golden_cases, random_gaussian, slope

from irlpilco_ros.learning.costs import (
    FeatureExpectations,
    FeatureMatching,
    StateCost,
    TrajectoryKl,
    quadratic_loss,
    saturating_loss,
)
from irlpilco_ros.learning.features import JointPositions, PositionsAndAngles
from irlpilco_ros.learning.moments.gaussian import Gaussian

H, D, K = 4, 4, 3
RNG = np.random.default_rng(0)
STATES = [random_gaussian(RNG, D) for _ in range(H + 1)]
MEANS = np.stack([state.mean for state in STATES])
COVARIANCES = np.stack([state.covariance for state in STATES])
REFERENCE = RNG.standard_normal((H + 1, K))
WEIGHTS = np.array([0.7, 0.1, 0.4])
FEATURES = PositionsAndAngles((0,), (2,))
SPREADS = np.stack([random_gaussian(RNG, K).covariance for _ in range(H + 1)])
PRECISION = random_gaussian(RNG, K).covariance * 5

COSTS: dict[str, Any] = {
    "feature_matching": FeatureMatching(FEATURES, REFERENCE, WEIGHTS, 0.6, 0.9),
    "feature_expectations": FeatureExpectations(FEATURES, REFERENCE, WEIGHTS, 0.9),
    "trajectory_kl": TrajectoryKl(FEATURES, REFERENCE, SPREADS, 0.01 * np.eye(K), 0.9),
    "saturating": StateCost(FEATURES, REFERENCE[0], PRECISION, discount=0.9),
    "quadratic": StateCost(FEATURES, REFERENCE[0], PRECISION, quadratic_loss, 0.9),
}


@pytest.mark.parametrize("name", COSTS)
def test_gradient(name):
    cost, rng = COSTS[name], np.random.default_rng(1)
    found = cost.evaluate(MEANS, COVARIANCES)
    change = rng.standard_normal(MEANS.shape)
    wider = 0.02 * rng.standard_normal(COVARIANCES.shape)
    wider = wider + np.swapaxes(wider, 1, 2)
    by_means = slope(lambda h: cost.evaluate(MEANS + h * change, COVARIANCES).value)
    by_spread = slope(lambda h: cost.evaluate(MEANS, COVARIANCES + h * wider).value)
    assert_close(np.sum(found.means_bar * change), by_means, 0.0)
    size = np.abs(found.covariances_bar * wider).sum()
    assert_close(np.sum(found.covariances_bar * wider), by_spread, size)


@pytest.mark.parametrize("name", COSTS)
def test_the_start_costs_nothing(name):
    found = COSTS[name].evaluate(MEANS, COVARIANCES)
    assert not found.means_bar[0].any()
    assert not found.covariances_bar[0].any()


@pytest.mark.parametrize(
    "name", ["feature_matching", "feature_expectations", "trajectory_kl", "quadratic"]
)
def test_curvature_root_is_the_hessian_of_linear_features(name):
    """With joint positions these costs are quadratic in the means: R'R is their Hessian."""
    cost = COSTS[name].__class__(**{**vars(COSTS[name]), "features": JointPositions(K)})
    change = 0.1 * np.random.default_rng(2).standard_normal(MEANS.shape)
    values = [cost.evaluate(MEANS + h * change, COVARIANCES).value for h in (-1.0, 0.0, 1.0)]
    root = cost.evaluate(MEANS, COVARIANCES).curvature_root(change[:, :, None])
    assert np.sum(root**2) == pytest.approx(values[0] - 2 * values[1] + values[2], rel=1e-6)


@pytest.mark.parametrize("loss", [saturating_loss, quadratic_loss])
def test_curvature_root_of_a_state_cost_is_its_hessian_at_the_target(loss):
    cost = StateCost(JointPositions(K), MEANS[0, :K], PRECISION, loss, 0.9)
    target, certain = np.tile(MEANS[0], (H + 1, 1)), np.zeros_like(COVARIANCES)
    change = 1e-3 * np.random.default_rng(2).standard_normal(MEANS.shape)
    values = [cost.evaluate(target + h * change, certain).value for h in (-1.0, 0.0, 1.0)]
    root = cost.evaluate(target, certain).curvature_root(change[:, :, None])
    assert np.sum(root**2) == pytest.approx(values[0] - 2 * values[1] + values[2], rel=1e-3)


def test_feature_matching_is_the_expected_square():
    cost = FeatureMatching(JointPositions(K), REFERENCE, WEIGHTS, 1.0, 0.9)
    rng, expected = np.random.default_rng(3), 0.0
    for t in range(1, H + 1):
        x = rng.multivariate_normal(MEANS[t], COVARIANCES[t], 100_000)[:, :K]
        expected += 1000 * 0.9**t * float(np.mean((x - REFERENCE[t]) ** 2, axis=0) @ WEIGHTS)
    assert cost.evaluate(MEANS, COVARIANCES).value == pytest.approx(expected, rel=0.01)


def test_no_deviation_and_no_spread_costs_nothing():
    features = JointPositions(K)
    reference, certain = MEANS[:, :K], np.zeros_like(COVARIANCES)
    for cost in (
        FeatureMatching(features, reference, WEIGHTS),
        FeatureExpectations(features, reference, WEIGHTS),
        TrajectoryKl(features, reference, np.tile(0.1 * np.eye(K), (H + 1, 1, 1)), 0.1 * np.eye(K)),
    ):
        assert cost.evaluate(MEANS, certain).value == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "loss"), [("lossSat", saturating_loss), ("lossQuad", quadratic_loss)]
)
def test_losses_agree_with_the_original(name, loss):
    for _, given, expected in golden_cases(name):
        state = Gaussian(given["m"].ravel(), given["S"])
        W = 0.5 * (given["W"] + given["W"].T)
        value, mean_bar, covariance_bar = loss(state, given["z"].ravel(), W)
        assert value == pytest.approx(expected["L"].item(), rel=1e-8)
        np.testing.assert_allclose(mean_bar, expected["dLdm"].ravel(), rtol=1e-8)
        wanted = expected["dLds"].reshape(W.shape)
        wanted = 0.5 * (wanted + wanted.T)
        np.testing.assert_allclose(
            covariance_bar, wanted, rtol=1e-8, atol=1e-8 * np.abs(wanted).max()
        )


def test_saturating_variance_and_covariance_agree_with_the_original():
    """Var exp(-d'Wd/2) needs E exp(-d'Wd), the same loss with twice the precision."""
    for _, given, expected in golden_cases("lossSat"):
        state, z = Gaussian(given["m"].ravel(), given["S"]), given["z"].ravel()
        value, mean_bar, _ = saturating_loss(state, z, given["W"])
        twice, _, _ = saturating_loss(state, z, 2.0 * given["W"])
        variance = (1.0 - twice) - (1.0 - value) ** 2
        assert variance == pytest.approx(expected["VarL"].item(), rel=1e-6)
        np.testing.assert_allclose(mean_bar, expected["C"].ravel(), rtol=1e-8)


def test_derivatives_of_the_saturating_variance_agree_with_the_original():
    for _, given, expected in golden_cases("lossSat"):
        state, z = Gaussian(given["m"].ravel(), given["S"]), given["z"].ravel()
        W = 0.5 * (given["W"] + given["W"].T)
        value, *slopes = saturating_loss(state, z, W)
        _, *twice = saturating_loss(state, z, 2.0 * W)
        by_mean, by_spread = (2 * (1 - value) * a - b for a, b in zip(slopes, twice, strict=True))
        np.testing.assert_allclose(by_mean, expected["dVdm"].ravel(), rtol=1e-6, atol=1e-9)
        wanted = expected["dVds"].reshape(W.shape)
        np.testing.assert_allclose(by_spread, 0.5 * (wanted + wanted.T), rtol=1e-6, atol=1e-9)


def test_quadratic_covariance_agrees_with_the_original():
    """By Stein's lemma cov(x, loss) = S E[d loss / dx], which is the derivative by the mean."""
    for _, given, expected in golden_cases("lossQuad"):
        W = 0.5 * (given["W"] + given["W"].T)
        state, z = Gaussian(given["m"].ravel(), given["S"]), given["z"].ravel()
        _, mean_bar, _ = quadratic_loss(state, z, W)
        np.testing.assert_allclose(mean_bar, expected["C"].ravel(), rtol=1e-8)
        # The variance of a quadratic form, from the same derivatives.
        variance = 2.0 * np.trace(W @ state.covariance @ W @ state.covariance)
        variance += mean_bar @ state.covariance @ mean_bar
        assert variance == pytest.approx(expected["VarL"].item(), rel=1e-8)


def test_cart_pole_loss_agrees_with_the_original():
    """Squared distance of the pole's tip from upright, over (x, sin, cos), saturating."""
    ((_, given, expected),) = golden_cases("losscp")
    length, width = given["plen"].item(), given["width"].item()
    to_tip = np.array([[1.0, length, 0.0], [0.0, 0.0, length]]) / width
    cost = StateCost(PositionsAndAngles((0,), (3,)), np.array([0.0, 0.0, -1.0]), to_tip.T @ to_tip)
    means = np.stack([given["m"].ravel()] * 2)
    found = cost.evaluate(means, np.stack([given["S"]] * 2))
    assert found.value == pytest.approx(expected["L"].item(), rel=1e-8)
    twice = replace(cost, precision=2.0 * cost.precision)
    doubled = twice.evaluate(means, np.stack([given["S"]] * 2)).value
    variance = (1.0 - doubled) - (1.0 - found.value) ** 2
    assert variance == pytest.approx(expected["VarL"].item(), rel=1e-6)
    np.testing.assert_allclose(found.means_bar[1], expected["dLdm"].ravel(), rtol=1e-7, atol=1e-9)
    wanted = expected["dLds"].reshape(4, 4)
    np.testing.assert_allclose(
        found.covariances_bar[1], 0.5 * (wanted + wanted.T), rtol=1e-7, atol=1e-9
    )


def test_kl_against_monte_carlo():
    features = JointPositions(K)
    cost = TrajectoryKl(features, REFERENCE[:2], SPREADS[:2], 0.02 * np.eye(K))
    value = cost.evaluate(MEANS[:2], COVARIANCES[:2]).value
    expert = np.random.default_rng(6).multivariate_normal(REFERENCE[1], SPREADS[1], 100_000)

    def log_density(x, mean, covariance):
        d = x - mean
        exponent = np.einsum("ni,ij,nj->n", d, np.linalg.inv(covariance), d)
        return -0.5 * (exponent + np.linalg.slogdet(covariance)[1])

    seen = COVARIANCES[1][:K, :K] + 0.02 * np.eye(K)
    ratio = log_density(expert, REFERENCE[1], SPREADS[1]) - log_density(expert, MEANS[1, :K], seen)
    assert value == pytest.approx(ratio.mean(), abs=5 * ratio.std() / np.sqrt(len(ratio)))
