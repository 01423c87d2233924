"""A decision keeps its rule, at its boundaries too, and its risks are closed forms."""

import numpy as np
import pytest
from mirrored import mirrored
from posteriors import batch, single
from scipy import stats
from test_margin_budget import exact

import hdcal
from hdcal.errors import InputError
from hdcal.prediction.budget.inputs import scatter_law
from hdcal.prediction.budget.risk import global_false_accept
from hdcal.prediction.margin.decision import decide

SIGMA = 1.5


@pytest.mark.parametrize(
    ("rule", "limit", "statement", "guard"),
    [
        ("guarded", 12.0, "conforms", 2.0),
        ("guarded", np.nextafter(12.0, 0.0), "undecided", 2.0),
        ("guarded", 10.0, "undecided", 2.0),
        ("guarded", 9.0, "undecided", 2.0),
        ("guarded", np.nextafter(9.0, 0.0), "does not conform", 2.0),
        ("simple", 10.0, "conforms", 0.0),
        ("simple", np.nextafter(10.0, 0.0), "does not conform", 0.0),
    ],
)
def test_the_rule_at_its_boundaries(rule, limit, statement: str, guard: float):
    assert decide(rule, limit, 10.0, 9.0, 12.0) == (statement, guard)


def test_the_risks_are_those_of_a_normal():
    posterior = exact(sigma=SIGMA)
    middle = hdcal.margin(posterior, 0.4).estimate_N
    for above in (-4.0, -1.0, 0.0, 1.0, 2.9, 2.95, 6.0):
        found = hdcal.margin(posterior, 0.4, limit_force=middle + above).decision
        risk = stats.norm.sf(above, scale=SIGMA)
        assert found.false_accept_risk == pytest.approx(risk, rel=1e-6)
        assert found.probability_of_conformity == pytest.approx(1.0 - risk, rel=1e-6)
        assert found.guard_band_N == pytest.approx(1.959964 * SIGMA, rel=1e-4)
        assert found.acceptance_limit_N == found.limit_N - found.guard_band_N
        expected = "conforms" if above > 1.96 * SIGMA else "undecided"
        expected = "does not conform" if above < -1.96 * SIGMA else expected
        assert found.statement == expected
        assert found.global_false_accept_risk is None
        # The guard band keeps the risk of what is accepted at 2.5 %.
        assert found.statement != "conforms" or risk < 0.025


def test_the_simple_rule_looks_at_the_estimate_alone():
    posterior = exact(sigma=SIGMA)
    middle = hdcal.margin(posterior, 0.4).estimate_N
    for above, expected in ((-0.01, "does not conform"), (0.01, "conforms")):
        asked = {"limit_force": middle + above, "rule": "simple"}
        found = hdcal.margin(posterior, 0.4, **asked).decision
        assert (found.rule, found.guard_band_N) == ("simple", 0.0)
        assert found.statement == expected
        assert found.false_accept_risk == pytest.approx(0.5, abs=0.01)


def test_a_gear_that_is_pulled_has_the_same_decision():
    pressed = single(size=400)
    for limit in (70.0, 81.0, 90.0):
        one = hdcal.margin(pressed, 0.4, limit_force=limit).decision
        other = hdcal.margin(mirrored(pressed), -0.4, limit_force=limit).decision
        assert one.statement == other.statement
        assert one.guard_band_N == pytest.approx(other.guard_band_N)
        assert one.words == other.words


@pytest.mark.thorough
def test_of_gears_there_is_a_global_risk():
    found = hdcal.margin(batch(6, 400), 0.4, limit_force=90.0).decision
    assert 0.0 < found.global_false_accept_risk < found.false_accept_risk


@pytest.mark.thorough
def test_the_global_risk_knows_how_little_six_gears_say():
    """It is the mean over what their scatter may be, not that of one scatter."""
    gears = batch(6, 400)
    found = hdcal.margin(gears, 0.4, limit_force=100.0, rule="simple")
    lines = {line.component: line.contribution_N for line in found.budget}
    between = lines.pop("gear to gear")
    rest = np.linalg.norm([*lines.values()])
    spread = gears.draws["specimen_sd"]
    load = between / scatter_law(spread**2)[0]
    each = [
        global_false_accept(found.estimate_N, load * sd, rest, 100.0, 100.0)
        for sd in spread
    ]
    risk = found.decision.global_false_accept_risk
    assert risk == pytest.approx(np.mean(each), rel=0.1)
    one = global_false_accept(found.estimate_N, between, rest, 100.0, 100.0)
    assert risk > 1.5 * one


@pytest.mark.thorough
def test_tolerances_make_gears_differ_and_no_measurement():
    """Accepted by its estimate, a gear exceeds the limit if its sizes make it stiff."""
    about = {"limit_force": 90.0, "rule": "simple"}
    plain = hdcal.margin(batch(6, 400), 0.4, **about).decision
    thick = {"wall_thickness_mm": 0.02}
    wide = hdcal.margin(batch(6, 400), 0.4, tolerances=thick, **about)
    lines = {line.component: line.contribution_N for line in wide.budget}
    own = [lines.pop(name) for name in ("gear to gear", "wall thickness δ")]
    rest, found = np.linalg.norm([*lines.values()]), wide.decision
    assert found.global_false_accept_risk > 1.5 * plain.global_false_accept_risk
    # As an error of the measurement they would hardly count.
    risks = [
        global_false_accept(wide.estimate_N, *sds, 90.0, 90.0)
        for sds in (
            (np.linalg.norm(own), rest),
            (own[0], np.linalg.norm([own[1], rest])),
        )
    ]
    assert risks[0] > 1.1 * risks[1]


def test_without_a_limit_nothing_is_decided():
    assert hdcal.margin(single(size=200), 0.4).decision is None
    with pytest.raises(InputError, match="rule: decides nothing without a limit"):
        hdcal.margin(single(size=200), 0.4, rule="simple")
    with pytest.raises(
        InputError, match=r"'strict' is unknown\. Use guarded or simple"
    ):
        hdcal.margin(single(size=200), 0.4, limit_force=90.0, rule="strict")
