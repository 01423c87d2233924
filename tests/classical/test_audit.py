"""The audit computes the known numbers, and its verdicts follow the readings."""

from dataclasses import replace

import numpy as np
import pytest

from hdcal.classical.audit.article import Claim, cubic
from hdcal.classical.audit.audit import audit
from hdcal.classical.audit.data_claims import data_claims
from hdcal.classical.audit.summary import audit_answer
from hdcal.data.reading import read_case
from hdcal.data.resources import datasets_folder
from hdcal.report.plain import as_plain


@pytest.fixture(scope="module")
def claims() -> tuple[Claim, ...]:
    return audit()


@pytest.fixture(scope="module")
def case():
    return read_case(str(datasets_folder() / "xb1-100-80"))


# Point, part of the claim, name, number, and half a unit of its last digit.
NUMBERS = [
    (1, "multiplied", "S_squared", 0.01365, 5e-6),
    (1, "multiplied", "factor", 73.2, 0.05),
    (1, "multiplied", "castigliano_N_per_mm", 80.905, 5e-4),
    (2, "newtons", "factor", 70, 1e-9),
    (3, "theoretical slope", "printed_per_length_N_per_mm2", 0.015781, 5e-7),
    (3, "theoretical slope", "printed_times_length_N_per_mm", 1.10467, 5e-6),
    (3, "theoretical slope", "corrected_N_per_mm", 80.905, 5e-4),
    (3, "theoretical slope", "needed_wall_thickness_mm", 1.848, 1e-3),
    (3, "theoretical slope", "needed_radius_mm", 14.71, 5e-3),
    (3, "theoretical slope", "needed_modulus_GPa", 4218, 0.5),
    (3, "theoretical slope", "needed_length_mm", 1406, 0.5),
    (4, "Poisson", "change_by_poisson", 0.0, 1e-12),
    (5, "lists the theoretical", "slope_N_per_mm", 1625.2, 0.05),
    (5, "lists the theoretical", "spread", 0.0, 1e-9),
    (5, "goes on", "rows_beyond", 2, 0),
    (5, "closely aligns", "error_at_0.1_mm", 0.135, 5e-4),
    (6, "Table 4", "thickness_exponent_low", 3.464, 5e-4),
    (6, "Table 4", "thickness_exponent_high", 3.446, 5e-4),
    (6, "Table 4", "radius_exponent_low", -3.160, 5e-4),
    (6, "Table 4", "radius_exponent_high", -2.616, 5e-4),
    (6, "Table 4", "implied_slope_N_per_mm", 1770.8, 0.05),
    (7, "within 5%", "rule_of_table_3_N", 84.5, 0.05),
    (7, "within 5%", "table_4_N", 92.1, 0.05),
    (7, "within 5%", "measured_N", 78.4, 1e-9),
    (7, "within 5%", "error", 0.17, 0.005),
    (8, "linear fit", "slope_with_intercept_N_per_mm", 209.41, 5e-3),
    (8, "linear fit", "slope_through_origin_N_per_mm", 198.02, 5e-3),
    (8, "fitted equation", "below", 13, 0),
    (8, "fitted equation", "rms_N", 3.77, 5e-3),
    (8, "fitted equation", "r2", 0.98759, 5e-6),
    (8, "are linear", "F", 34.2, 0.05),
    (8, "are linear", "p_value", 1.1e-4, 5e-6),
    (8, "are linear", "curvature_N_per_mm2", 58.58, 5e-3),
    (8, "third degree", "p_value", 0.76, 5e-3),
    (9, "precisely", "on_tick", 12, 0),
    (9, "precisely", "high_over_line_N", 1.93, 5e-3),
    (9, "precisely", "high_over_parabola_N", 1.55, 5e-3),
    (10, "influence", "K_article_with_intercept", 0.1289, 5e-5),
    (10, "influence", "K_article_through_origin", 0.1218, 5e-5),
    (10, "teeth", "K_ring_with_intercept", 2.59, 5e-3),
    (10, "teeth", "K_ring_through_origin", 2.45, 5e-3),
    (11, "teeth", "one_rising_ramp", 1, 0),
]


def find(claims, point: int, part: str) -> Claim:
    (found,) = (c for c in claims if c.point == point and part in c.claim)
    return found


@pytest.mark.parametrize(("point", "part", "name", "value", "digit"), NUMBERS)
def test_the_known_numbers_are_computed(claims, point, part, name, value, digit):
    numbers = find(claims, point, part).numbers
    assert numbers[name] == pytest.approx(value, abs=digit, rel=0.0)


def test_every_point_is_there_and_two_claims_hold(claims):
    assert {claim.point for claim in claims} == set(range(1, 12))
    held = [claim.claim for claim in claims if claim.verdict == "holds"]
    assert len(held) == 2
    assert "K₂ = 210.41" in held[0] and "K = K₂/K₁" in held[1]
    assert find(claims, 7, "within 5%").verdict == "does not hold"
    assert find(claims, 11, "teeth").verdict == "cannot be checked"


def test_the_prediction_at_the_design_deformation_leaves_the_claim_out(claims):
    numbers = find(claims, 7, "within 5%").numbers
    assert numbers["prediction_lo_N"] < numbers["measured_N"]
    assert numbers["measured_N"] < numbers["prediction_hi_N"] < 84.5


def with_forces(case, force):
    return replace(case, records=replace(case.records, force=force))


def test_readings_that_bear_the_article_out_would_turn_the_verdicts(case):
    x = case.records.deformation
    noise = np.random.default_rng(0).normal(0.0, 0.05, len(x))
    obedient = list(data_claims(with_forces(case, cubic(x) + noise)))
    assert find(obedient, 8, "fitted equation").verdict == "holds"
    assert find(obedient, 9, "precisely").verdict == "holds"
    straight = list(data_claims(with_forces(case, 230.0 * x + noise)))
    assert find(straight, 7, "within 5%").verdict == "holds"
    assert find(straight, 8, "are linear").verdict == "holds"
    assert find(straight, 8, "linear fit").verdict == "does not hold"
    bent = list(data_claims(with_forces(case, 200.0 * x + 300.0 * x**3 + noise)))
    assert find(bent, 8, "third degree").verdict == "holds"


def test_the_plain_data_hold_the_fits_of_table_2(claims):
    found = as_plain(audit_answer(claims))
    assert sum(found["count"].values()) == len(claims)
    r2 = {one["model"]: round(one["r2"], 5) for one in found["fits"]}
    assert r2["a ω"] == 0.99396
    assert r2["c + a ω + b ω²"] == 0.99949
    assert r2["the article's cubic"] == 0.98759
