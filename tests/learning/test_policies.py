from dataclasses import dataclass

import numpy as np
import pytest
from block_checks import (
    assert_close,
    check_golden_block,
    check_monte_carlo,
    check_pullback,
    contract,
    golden_cases,
    random_bars,
    random_gaussian,
    reference_bars,
    slope,
)

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.moments.radial_basis import bumps_moments, fit_bumps
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import (
    REGISTRY,
    LinearPhasePolicy,
    LinearPolicy,
    OpenLoopPolicy,
    Policy,
    RbfPolicy,
    control_limit,
    from_arrays,
    parameter,
)
from irlpilco_ros.learning.policies.linear_phase import phase_features
from irlpilco_ros.learning.policies.rbf import RIDGE, VARIANCE_FLOOR

D, F, H = 4, 2, 6
LIMIT = np.array([1.5, 0.4])


def make(kind):
    rng = np.random.default_rng(0)
    if kind == "linear":
        return LinearPolicy(rng.standard_normal((F, D)), rng.standard_normal(F), LIMIT)
    if kind == "linear_phase":
        return LinearPhasePolicy(rng.standard_normal((F, D)), rng.standard_normal((F, 3)), H, LIMIT)
    if kind == "open_loop":
        return OpenLoopPolicy(rng.uniform(-0.4, 0.4, (H, F)), LIMIT, D)
    rows = {"rbf": F, "rbf_shared": 1}[kind]
    return RbfPolicy(
        rng.standard_normal((7, D)),
        rng.standard_normal((7, F)),
        rng.uniform(0.0, 0.8, (rows, D)),
        LIMIT,
    )


ALL = ["linear", "linear_phase", "open_loop", "rbf", "rbf_shared"]


@pytest.mark.parametrize("kind", ALL)
def test_acting_is_the_mean_control_without_spread(kind):
    policy, state = make(kind), np.array([0.1, -0.5, 0.9, 0.2])
    moments, pullback = policy.moments(Gaussian(state, np.zeros((D, D))), 2, gradient=False)
    assert pullback is None
    np.testing.assert_allclose(policy.act(state, 2), moments.mean, rtol=1e-14)
    assert (np.abs(policy.act(100 * state, 2)) <= LIMIT * (1 + 1e-12)).all()


@pytest.mark.parametrize("kind", ["linear", "linear_phase"])
def test_moments_against_monte_carlo(kind):
    policy, state = make(kind), random_gaussian(np.random.default_rng(1), D, 0.3)
    moments, _ = policy.moments(state, 2)
    check_monte_carlo(
        moments, state, lambda x: np.stack([policy.act(row, 2) for row in x]), samples=20_000
    )


@pytest.mark.parametrize("kind", ALL)
def test_gradient_by_the_state(kind):
    policy = make(kind)
    check_pullback(lambda at: policy.moments(at, 3), random_gaussian(np.random.default_rng(2), D))


@pytest.mark.parametrize("kind", ALL)
def test_gradient_by_the_parameters(kind):
    rng = np.random.default_rng(3)
    policy, state = make(kind), random_gaussian(np.random.default_rng(2), D)
    moments, pullback = policy.moments(state, 3)
    bars = random_bars(rng, moments)
    gradient = pullback(*bars)[2]
    for _ in range(4):
        change = 0.1 * rng.standard_normal(gradient.shape)

        def along(h, change=change):
            moved = policy.with_parameters(policy.parameters + h * change)
            return contract(moved.moments(state, 3)[0], bars)

        if kind == "open_loop":
            change *= 0.0
            change[6:8] = 0.01
        assert_close(gradient @ change, slope(along), np.abs(gradient * change).sum())


@pytest.mark.parametrize("kind", ALL)
def test_mean_sensitivity_without_spread_is_exact(kind):
    policy, state = make(kind), Gaussian(np.array([0.1, -0.5, 0.9, 0.2]), np.zeros((D, D)))
    _, pullback = policy.moments(state, 3)
    nothing = np.zeros((F, F)), np.zeros((F, D))
    expected = np.stack([pullback(row, *nothing)[2] for row in np.eye(F)])
    np.testing.assert_allclose(policy.mean_sensitivity(state, 3), expected, atol=1e-12)


@pytest.mark.parametrize("kind", ["linear", "linear_phase"])
def test_spread_curvature_is_the_hessian_of_priced_gains(kind):
    """At a mean where squashing is nearly linear, the control's spread is quadratic in W."""
    policy = make(kind)
    policy = policy.with_parameters(1e-3 * policy.parameters)
    state = Gaussian(np.zeros(D), random_gaussian(np.random.default_rng(4), D).covariance)
    cost_weight = np.array([[2.0, 0.3], [0.3, 1.0]])
    other = Gaussian(state.mean, 2.0 * state.covariance)
    curvature = policy.spread_curvature([state, other], [2, 1], np.stack([cost_weight] * 2))
    change = np.zeros_like(policy.parameters)
    change[: F * D] = 1e-3 * np.random.default_rng(5).standard_normal(F * D)

    def priced(h):
        moved = policy.with_parameters(policy.parameters + h * change)
        both = moved.moments(state, 2)[0].covariance + moved.moments(other, 1)[0].covariance
        return float(np.sum(cost_weight * both))

    second = priced(1.0) - 2.0 * priced(0.0) + priced(-1.0)
    assert change @ curvature @ change == pytest.approx(second, rel=1e-3)


@pytest.mark.parametrize("kind", ["linear", "linear_phase"])
def test_change_metric_is_the_mean_square_of_the_change_before_squashing(kind):
    """Near zero, squashing multiplies by 3/2 of the limit; the control's mean square tells."""
    zero = make(kind)
    zero = zero.with_parameters(0.0 * zero.parameters)
    state = random_gaussian(np.random.default_rng(6), D)
    change = 1e-4 * np.random.default_rng(7).standard_normal(zero.parameters.shape)
    states, steps = [state, random_gaussian(np.random.default_rng(8), D)], [2, 0]
    expected = 0.0
    for each, step in zip(states, steps, strict=True):
        control, _ = zero.with_parameters(change).moments(each, step)
        second = control.mean**2 + np.diagonal(control.covariance)
        expected += float((second / (1.5 * zero.control_limit) ** 2).sum())
    assert change @ zero.change_metric(states, steps) @ change == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("kind", ALL)
def test_round_trip_through_arrays(kind):
    policy = make(kind)
    again = from_arrays(policy.to_arrays())
    state = np.array([0.1, -0.5, 0.9, 0.2])
    assert type(again) is type(policy)
    np.testing.assert_array_equal(again.act(state, 1), policy.act(state, 1))
    np.testing.assert_array_equal(again.parameters, policy.parameters)


@pytest.mark.parametrize("kind", ALL)
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_no_policy_holds_a_number_that_is_not_finite(kind, bad):
    policy = make(kind)
    parameters = policy.parameters.copy()
    parameters[1] = bad
    with pytest.raises(InvalidSettingError, match="finite"):
        policy.with_parameters(parameters)
    arrays = dict(policy.to_arrays())
    arrays["control_limit"] = np.array([1.0, bad])
    with pytest.raises(InvalidSettingError, match="control_limit"):
        from_arrays(arrays)


def test_refusals_name_what_is_wrong():
    arrays = make("linear").to_arrays()
    with pytest.raises(InvalidSettingError, match="valid: linear"):
        from_arrays(arrays | {"kind": "quadratic"})
    with pytest.raises(InvalidSettingError, match="missing: bias"):
        from_arrays({k: v for k, v in arrays.items() if k != "bias"})
    with pytest.raises(InvalidSettingError, match="unknown: colour"):
        from_arrays(arrays | {"colour": 1.0})
    with pytest.raises(InvalidSettingError, match=r"bias .* shape \(3,\)"):
        from_arrays(arrays | {"bias": np.zeros(3)})
    with pytest.raises(InvalidSettingError, match="at least 0"):
        from_arrays(arrays | {"control_limit": -LIMIT})
    with pytest.raises(InvalidSettingError, match="parameters"):
        make("linear").with_parameters(np.zeros(3))
    with pytest.raises(InvalidSettingError, match="limit is"):
        OpenLoopPolicy(np.ones((H, F)), LIMIT, D)
    with pytest.raises(InvalidSettingError, match="at least 1"):
        from_arrays(make("linear_phase").to_arrays() | {"horizon": 0})
    with pytest.raises(InvalidSettingError, match="log_widths"):
        from_arrays(make("rbf").to_arrays() | {"log_widths": np.zeros((3, D))})


@dataclass(frozen=True)
class Undeclared(Policy):
    weights: Array = parameter("F D", "Gains.")
    gain: float = 1.0


@dataclass(frozen=True)
class Limitless(Policy):
    weights: Array = parameter("F D", "Gains.")


@dataclass(frozen=True)
class Blind(Policy):
    bias: Array = parameter("F", "Control.")
    control_limit: Array = control_limit()


@dataclass(frozen=True)
class Ambiguous(Policy):
    weights: Array = parameter("F D", "Gains.")
    table: Array = parameter("K L", "Both sizes are anybody's guess.")
    control_limit: Array = control_limit()


@pytest.mark.parametrize(
    ("cls", "message"),
    [
        (Undeclared, "the field gain of Undeclared is not declared"),
        (Limitless, "Limitless has no control_limit"),
        (Blind, "no array of Blind has a size D"),
        (Ambiguous, "the shape K L of Ambiguous.table has two sizes that are new"),
        (Policy, "Policy is no dataclass"),
    ],
)
def test_a_policy_that_does_not_declare_what_it_should_is_not_registered(cls, message):
    with pytest.raises(InvalidSettingError, match=message):
        REGISTRY.register("unsound")(cls)
    assert "unsound" not in REGISTRY.names()


@pytest.mark.parametrize(
    ("kind", "change", "message"),
    [
        ("linear_phase", {"horizon": np.inf}, "expected a whole number"),
        ("linear_phase", {"horizon": 2.5}, "expected a whole number"),
        ("linear_phase", {"horizon": "many"}, "expected a whole number"),
        ("linear", {"weights": [[1.0], [1.0, 2.0]]}, "holds something else than numbers"),
        ("linear", {"weights": "much"}, "holds something else than numbers"),
    ],
)
def test_what_is_no_number_is_refused(kind, change, message):
    with pytest.raises(InvalidSettingError, match=message):
        from_arrays(make(kind).to_arrays() | change)


def test_shapes_follow_from_flat_lists_by_their_symbols():
    policy = make("rbf")
    arrays = policy.to_arrays()
    flat = {name: np.ravel(value).tolist() for name, value in arrays.items() if name != "kind"}
    again = RbfPolicy.from_lists(flat, {"F": F, "D": D})
    for name, value in again.to_arrays().items():
        np.testing.assert_array_equal(value, arrays[name])
    with pytest.raises(InvalidSettingError, match=r"targets has 12 values; expected 14 .*N = 7"):
        RbfPolicy.from_lists(flat | {"targets": flat["targets"][2:]}, {"F": F, "D": D})
    with pytest.raises(
        InvalidSettingError, match="centres has 27 values; expected a multiple of 4"
    ):
        RbfPolicy.from_lists(flat | {"centres": flat["centres"][1:]}, {"F": F, "D": D})


def test_open_loop_stands_still_after_its_end():
    np.testing.assert_array_equal(make("open_loop").act(np.zeros(D), H), np.zeros(F))


@pytest.mark.parametrize(("count", "horizon"), [(1, 5), (4, 1), (8, 16), (16, 16)])
def test_phase_features_sum_to_one(count, horizon):
    for t in range(horizon + 2):
        phase = phase_features(t, count, horizon)
        assert phase.shape == (count,)
        assert phase.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("conlin")))
def test_linear_agrees_with_the_original(case, given, expected):
    policy = LinearPolicy(given["w"], given["b"].ravel(), given["maxU"].ravel())
    state = Gaussian(given["m"].ravel(), given["S"])
    moments, pullback = policy.moments(state, 0)
    bars = check_golden_block(moments, pullback, expected, "sq")
    b_bar, w_bar = np.split(reference_bars(expected, bars, "sq", "p"), [len(policy.bias)])
    found = pullback(*bars)[2]
    size = policy.weights.size
    np.testing.assert_allclose(found[size:], b_bar, rtol=1e-8)
    w_bar = w_bar.reshape(policy.weights.shape, order="F").ravel()
    np.testing.assert_allclose(found[:size], w_bar, rtol=1e-8, atol=1e-8 * np.abs(w_bar).max())


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("congp")))
def test_rbf_agrees_with_the_original(case, given, expected):
    inputs = given["centers"].shape[1]
    policy = RbfPolicy(
        given["centers"], given["targets"], given["hyp"][:inputs].T, given["maxU"].ravel()
    )
    moments, pullback = policy.moments(Gaussian(given["m"].ravel(), given["S"]), 0)
    bars = check_golden_block(moments, pullback, expected, "sq", tolerance=1e-6)
    reference = reference_bars(expected, bars, "sq", "p")
    hyp_bar, centres_bar, targets_bar = np.split(
        reference, np.cumsum([given["hyp"].size, given["centers"].size])
    )
    hyp_bar = hyp_bar.reshape(given["hyp"].shape, order="F")[:inputs].T.ravel()
    centres_bar = centres_bar.reshape(given["centers"].shape, order="F").ravel()
    targets_bar = targets_bar.reshape(given["targets"].shape, order="F").ravel()
    wanted = np.concatenate([centres_bar, targets_bar, hyp_bar])
    np.testing.assert_allclose(
        pullback(*bars)[2], wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max()
    )


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("conlin")))
def test_linear_before_squashing_agrees_with_the_original(case, given, expected):
    """A limit so wide that nothing is squashed: limit * squash(v / limit) is v at its middle."""
    wide = 1e6
    weights, bias = given["w"] / wide, given["b"].ravel() / wide
    limit = np.full(len(bias), wide / 1.5)  # the slope of the squashing at 0 is 1.5
    policy = LinearPolicy(weights, bias, limit)
    moments, pullback = policy.moments(Gaussian(given["m"].ravel(), given["S"]), 0)
    check_golden_block(moments, pullback, expected, "", tolerance=1e-6)


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("congp")))
def test_rbf_before_squashing_agrees_with_the_original(case, given, expected):
    size, outputs = given["centers"].shape[1], given["targets"].shape[1]
    bumps, pull_fit = fit_bumps(
        given["centers"], given["targets"], given["hyp"][:size].T.copy(), RIDGE
    )
    raw, pull = bumps_moments(bumps, Gaussian(given["m"].ravel(), given["S"]))
    covariance = raw.covariance + VARIANCE_FLOOR * np.eye(outputs)
    bars = check_golden_block(
        Moments(raw.mean, covariance, raw.jacobian), pull, expected, "", tolerance=1e-6
    )
    centres_bar, targets_bar, widths_bar = pull_fit(pull(*bars)[2])
    fixed = np.zeros((2, outputs))
    parts = [np.vstack([widths_bar.T, fixed]), centres_bar, targets_bar]
    found = np.concatenate([part.ravel(order="F") for part in parts])
    wanted = reference_bars(expected, bars, "", "p")
    np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())
