"""Margins: bounds, capacities, decisions, the inverse and the result itself."""

from dataclasses import replace
from datetime import date

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from posteriors import (
    batch,
    compensated,
    plain_draws,
    ramp_case,
    single,
    spring,
    stiffer,
    with_discrepancy,
    written_posterior,
)
from scipy import stats
from test_budget import exact

import hdcal
from hdcal.prediction.conditions import Conditions
from hdcal.prediction.joint import joint
from hdcal.prediction.margin.levels import decide
from hdcal.prediction.margin.result import Margin
from hdcal.prediction.simulate import simulate
from hdcal.quantities import TORQUE


@pytest.fixture(scope="module")
def gears():
    return batch()


@pytest.fixture(scope="module")
def one():
    return single(size=1000)


def drawn_members(posterior, at: float, count: int = 2000) -> np.ndarray:
    """Draw forces of new gears in new mountings, many for every draw [draw, member]."""
    rng, d = np.random.default_rng(3), posterior.draws
    found = simulate(joint(posterior), Conditions.of(at, 20.0), "specimens")
    # Centre and bend are those of the margin, the members are not.
    size = (len(d["K"]), count)
    load = d["stiffness"] * (at - d["deformation_offset"])
    load = load + found.common["bend"][:, 0]
    gear = d["specimen_sd"][:, None] * rng.normal(size=size)
    zero = d["run_offset_sd"][:, None] * rng.normal(size=size)
    noise = d["sigma"][:, None] * rng.normal(size=size)
    return found.centre + load[:, None] * gear + zero + noise


def test_the_numbers_are_those_of_brute_force(gears):
    found = hdcal.margin(gears, 0.4, limit_force=95.0, content=0.9)
    drawn, level = drawn_members(gears, 0.4), found.worst
    assert found.population == "specimens"
    needed = np.quantile(drawn, 0.9, axis=1)
    assert level.upper_bound_N == pytest.approx(np.quantile(needed, 0.95), rel=5e-3)
    lower = np.quantile(np.quantile(drawn, 0.1, axis=1), 0.05)
    assert level.lower_bound_N == pytest.approx(lower, rel=5e-3)
    ends = np.quantile(drawn, [0.025, 0.5, 0.975])
    got = [level.member_N.lo, level.member_N.median, level.member_N.hi]
    np.testing.assert_allclose(got, ends, rtol=5e-3)
    risk, above = level.exceedance, np.mean(drawn > 95.0, axis=1)
    assert risk.probability == pytest.approx(above.mean(), rel=0.03)
    assert risk.lo == pytest.approx(np.quantile(above, 0.025), abs=1e-3)
    assert risk.hi == pytest.approx(np.quantile(above, 0.975), rel=0.05)
    assert level.capacity_N == level.upper_bound_N
    assert level.capacity_median_N == pytest.approx(np.median(needed), rel=5e-3)


def test_a_capacity_meets_what_it_was_asked_to(gears):
    asked = hdcal.margin(gears, 0.4, content=0.999).worst
    risk = hdcal.margin(gears, 0.4, limit_force=asked.capacity_N).worst.exceedance
    assert risk.at_confidence == pytest.approx(1e-3, rel=1e-2)


def test_of_several_temperatures_the_worst_counts():
    """The rig does not drift: the gear alone is stiffer where it is cold."""
    found = hdcal.margin(single(compensated()), 0.4, temperature=[-20.0, 20.0, 80.0])
    assert found.worst == found.levels[0] and found.worst.temperature_C == -20.0
    bounds = [level.upper_bound_N for level in found.levels]
    drop = 205.0 * 0.4 * 3e-4 * 100.0
    assert bounds[0] - bounds[2] == pytest.approx(drop, abs=0.8)
    assert [level.tested for level in found.levels] == [False, True, False]
    frame = found.to_frame()
    assert frame["temperature_C"].tolist() == [-20.0, 20.0, 80.0]
    assert {"force_N", "force_lo", "force_hi", "upper_bound_N"} <= {*frame}
    assert list(found.charts()) == ["margin", "budget"]


def test_rounded_readings_have_half_a_step_more():
    step = 0.98
    plain, rounded = (
        hdcal.margin(exact_of(resolution), 0.1, limit_force=24.0)
        for resolution in (0.0, step)
    )
    half, one, other = 0.5 * step, plain.worst, rounded.worst
    for name, sign in (
        ("upper_bound_N", 1.0),
        ("lower_bound_N", -1.0),
        ("capacity_N", 1.0),
        ("capacity_median_N", 1.0),
    ):
        moved = getattr(other, name) - getattr(one, name)
        assert moved == pytest.approx(sign * half, abs=1e-6)
    # The interval of the share holds wherever the force lies in a step.
    most, least = (
        hdcal.margin(exact_of(0.0), 0.1, limit_force=24.0 + by).worst.exceedance
        for by in (-half, half)
    )
    assert other.exceedance.hi == pytest.approx(most.hi, rel=1e-9)
    assert other.exceedance.lo == pytest.approx(least.lo, rel=1e-9)
    assert least.probability < other.exceedance.probability < most.probability
    # The rounding is a uniform component of one member.
    sd = np.hypot(plain.combined_standard_uncertainty_N, step / 12.0**0.5)
    assert rounded.combined_standard_uncertainty_N == pytest.approx(sd)
    assert rounded.step_N == step
    rows = {row.component: row for row in rounded.budget}
    resolution = rows["resolution of the force reading"]
    assert resolution.distribution == "rectangular" and resolution.type_ == "B"
    assert resolution.contribution_N == pytest.approx(step / 12.0**0.5)
    load = hdcal.margin(exact_of(step), 0.1, quantity="load")
    assert load.step_N == 0.0


def exact_of(resolution: float):
    """Return the gear of `exact` with rounded readings."""
    known = exact()
    gear = replace(known.case.gear, force_resolution=resolution)
    case = replace(known.case, gear=gear)
    draws = {n: v for n, v in known.draws.items() if n != "noise_correlation"}
    return written_posterior(case, draws)


# --- decisions ---


@pytest.mark.parametrize(
    ("rule", "limit", "statement", "guard"),
    [
        ("guarded", 12.0, "conforms", 2.0),
        ("guarded", np.nextafter(12.0, 0.0), "undecided", 2.0),
        ("guarded", np.nextafter(9.0, 0.0), "does not conform", 2.0),
        ("simple", 10.0, "conforms", 0.0),
        ("simple", np.nextafter(10.0, 0.0), "does not conform", 0.0),
    ],
)
def test_the_rule_at_its_boundaries(rule, limit, statement: str, guard: float):
    found = decide(rule, limit, 10.0, 9.0, 12.0, 0.1)
    assert (found.statement, found.guard_band_N) == (statement, guard)
    assert found.acceptance_limit_N == limit - guard
    assert found.probability_of_conformity == 0.9


def test_the_risks_are_those_of_a_normal():
    known = exact(4000)
    middle = hdcal.margin(known, 0.1).estimate_N
    for above in (-4.0, -1.0, 0.0, 1.0, 2.9, 3.0, 6.0):
        found = hdcal.margin(known, 0.1, limit_force=middle + above).decision
        risk = stats.norm.sf(above, scale=1.5)
        assert found.false_accept_risk == pytest.approx(risk, rel=0.05)
        assert found.guard_band_N == pytest.approx(1.96 * 1.5, rel=0.02)
        expected = "conforms" if above > 2.95 else "undecided"
        assert found.statement == ("does not conform" if above < -2.95 else expected)
    simple = hdcal.margin(known, 0.1, limit_force=middle + 0.01, rule="simple").decision
    assert (simple.statement, simple.guard_band_N) == ("conforms", 0.0)
    assert hdcal.margin(known, 0.1).decision is None


# --- the inverse ---


def test_the_inverse_inverts(gears):
    found = hdcal.margin(gears, 0.4, given_force=80.0, content=0.9).reached
    # At the deformation that 90 % reach at least, 90 % need at most this force.
    again = hdcal.margin(gears, found.lower_bound_mm, content=0.9).worst
    assert again.upper_bound_N == pytest.approx(80.0, rel=4e-3)
    again = hdcal.margin(gears, found.upper_bound_mm, content=0.9).worst
    assert again.lower_bound_N == pytest.approx(80.0, rel=4e-3)
    again = hdcal.margin(gears, found.median_mm).worst
    assert again.force_N.median == pytest.approx(80.0, rel=1e-3)
    assert found.lower_bound_mm < found.lo_mm < found.median_mm
    assert found.median_mm < found.hi_mm < found.upper_bound_mm and found.tested
    assert found.searched_mm == pytest.approx((0.0, 1.08))
    far = hdcal.margin(gears, 0.4, given_force=600.0).reached
    assert far.median_mm is far.lower_bound_mm is None and not far.tested


# --- beyond the data, several models, other quantities ---


def test_a_fitted_discrepancy_is_in_the_force():
    posterior = with_discrepancy(1000)
    found = hdcal.margin(posterior, 0.3).worst.force_N
    bands = hdcal.predict(posterior, [0.3])
    assert (found.lo, found.hi) == pytest.approx(
        (bands.with_gap_lo_N[0], bands.with_gap_hi_N[0])
    )
    columns = posterior.problem.discrepancy.columns(np.array([0.3]), np.ones(1))
    draws = posterior.draws
    mean = draws["stiffness"] * (0.3 - draws["deformation_offset"])
    mean = mean + draws["force_offset"] + draws["gap_weights"] @ np.asarray(columns)[0]
    assert found.median == pytest.approx(np.median(mean), rel=1e-6)


def test_models_are_averaged_by_their_probability(gears):
    other = stiffer(gears, 1.1)
    both = hdcal.margin([(3.0, gears), (1.0, other)], 0.4)
    each = [hdcal.margin(p, 0.4) for p in (gears, other)]
    low, high = (found.worst.upper_bound_N for found in each)
    assert low < both.worst.upper_bound_N < high
    mean = 0.75 * each[0].estimate_N + 0.25 * each[1].estimate_N
    assert both.estimate_N == pytest.approx(mean, rel=2e-3)
    # Twice the same model is that model.
    twice = hdcal.margin([(0.3, gears), (0.7, gears)], 0.4)
    assert twice.worst.upper_bound_N == pytest.approx(low, rel=5e-3)
    assert twice.causes == {"none": 1.0}


def test_effects_of_other_models_are_null_in_each():
    """A cause of one model has no part in the noise and the drift of another."""
    case = ramp_case()
    plain = written_posterior(case, plain_draws(case))
    wild = plain_draws(case) | {"outliers.fraction": np.full(2000, 0.05)}
    wild = written_posterior(
        case, wild | {"outliers.ratio": np.full(2000, 20.0)}, effects=["outliers"]
    )
    pair, both = [(0.5, plain), (0.5, wild)], {"limit_force": 83.0}
    one, other, mixed = (hdcal.margin(p, 0.4, **both) for p in (plain, wild, pair))
    risks = [found.worst.exceedance.probability for found in (one, other, mixed)]
    assert risks[2] == pytest.approx(np.mean(risks[:2]), rel=0.05)
    drifting = plain_draws(case) | {"thermal_zero_drift.slope": np.zeros(2000)}
    drifting = written_posterior(case, drifting, effects=["thermal_zero_drift"])
    each, mixed = (
        joint(pair).drifts["zero_drift"][1]
        for pair in (plain, [(0.5, plain), (0.5, drifting)])
    )
    assert mixed.tolist() == [*each, *np.zeros(2000)]


# --- the result ---


def test_the_result_describes_itself(gears):
    asked = {"limit_force": 140.0, "temperature": [20.0, 60.0]}
    found = hdcal.margin(gears, 0.6, **asked)
    answer = found.to_dict()
    assert answer["schema"] == "hdcal.margin/3" and answer["status"] == "ok"
    assert answer["worst"] == answer["levels"][1]
    assert answer["data"]["sha256"] == gears.case.data_sha256
    assert found.budget_frame()["share"].sum() == pytest.approx(1.0)
    assert len(found.to_frame()) == 2
    assert found.plot().get_xlabel() == "temperature [°C]"
    page = found.page("hdcal margin RUN")
    assert "<script" in page and "hdcal margin RUN" in page


def test_a_torque_has_its_own_units():
    pressed = spring()
    twisted = replace(pressed, case=replace(pressed.case, units=TORQUE))
    found = hdcal.margin(twisted, 0.4, limit_force=90.0, given_force=60.0)
    answer = found.to_dict()
    Draft202012Validator(Margin.json_schema(found.units)).validate(answer)
    assert found.part == "part" and "angle_rad" in answer
    assert answer["reached"]["median_rad"] == pytest.approx(61.0 / 205.0, rel=0.02)
    assert "upper_bound_N_m" in answer["worst"] and "torque_N_m" in answer["worst"]
    assert not any(key.endswith(("_N", "_mm")) for key in answer)
    assert {"torque_N_m", "upper_bound_N_m"} <= {*found.to_frame()}
    assert {"contribution_N_m", "sensitivity_N_m_per_unit"} <= {*found.budget_frame()}
    for text in (found.text(), found.certificate(date(2026, 1, 2))):
        assert "N·m" in text and "force" not in text
    assert "torque [N·m]" in (found.plot().get_ylabel(), found.plot().get_xlabel())
