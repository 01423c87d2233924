"""The uncertainty budget of a margin against closed forms and sampling."""

from dataclasses import replace

import numpy as np
import pytest
from gauged import SDS, certified, told
from posteriors import (
    batch,
    compensated,
    plain_draws,
    ramp_case,
    stiffer,
    written_posterior,
)
from scipy import stats

import hdcal
from hdcal.data.priors import Prior


def exact(size: int = 400, sigma: float = 1.5):
    """Return one gear of which all is known but the noise."""
    case = ramp_case(compensated())
    draws = plain_draws(case)
    known = {name: np.full(size, values.mean()) for name, values in draws.items()}
    # The product of the means is not the mean of the product.
    unit = draws["stiffness"][0] / (draws["K"][0] * draws["E0"][0])
    known["K"] = known["stiffness"] / (known["E0"] * unit)
    return written_posterior(case, known | {"sigma": np.full(size, sigma)})


def by_component(found) -> dict:
    return {row.component: row for row in found.budget}


def check(found) -> None:
    """Check that the rows add up, and that each is its u times its sensitivity."""
    total = found.combined_standard_uncertainty_N**2
    shares = [row.share for row in found.budget]
    assert sum(shares) == pytest.approx(1.0, abs=1e-12)
    assert shares == sorted(shares, reverse=True) and min(shares) > 0.0
    for row in found.budget:
        assert row.share == pytest.approx(row.contribution_N**2 / total)
    half = 0.5 * (found.worst.member_N.hi - found.worst.member_N.lo)
    assert found.expanded_uncertainty_N == pytest.approx(half)
    assert found.coverage_factor == pytest.approx(half / total**0.5)


def test_every_source_has_a_row():
    gears = batch(6, 400)
    models = [(0.6, gears), (0.4, stiffer(gears, 1.05))]
    asked = {"tolerances": {"wall_thickness_mm": 0.02}, "temperature": 60.0}
    found = hdcal.margin(models, 0.9, **asked)
    check(found)
    rows = by_component(found)
    for name in (
        "calibration (stiffness, zeros, effects)",
        "reading noise",
        "which effect acts",
        "scatter between mountings",
        "scatter between gears",
        "tolerance of the wall thickness",
        "curvature that the readings do not exclude",
        "zero drift of the gauge with temperature",
        "expansion of the rig with temperature",
    ):
        assert rows[name].share > 0.0, name
    types = {name: row.type_ for name, row in rows.items()}
    assert types["reading noise"] == types["scatter between gears"] == "A"
    assert types["zero drift of the gauge with temperature"] == "B"
    zero = rows["zero drift of the gauge with temperature"].contribution_N
    assert zero == pytest.approx(0.1 * 40.0, rel=0.1)
    frame = rows["expansion of the rig with temperature"]
    assert (frame.unit, frame.distribution) == ("mm", "normal")
    assert frame.standard_uncertainty == pytest.approx(0.04, rel=0.02)
    stiffness = 205.0 * 1.02 * (1.0 - 40.0 * 3e-4)
    assert frame.sensitivity_N_per_unit == pytest.approx(stiffness, rel=0.1)


def test_the_uncertainty_is_the_sd_of_one_member():
    """By sampling members of both models."""
    gears, rng = batch(6, 2000), np.random.default_rng(7)
    pair = [(0.5, gears), (0.5, stiffer(gears, 1.03))]
    found = hdcal.margin(pair, 0.4)
    check(found)
    drawn = []
    for factor in (1.0, 1.03):
        d, count = gears.draws, 2000
        gear, mounting, noise = rng.normal(size=(3, count, 100))
        centre = rng.normal(size=(2, count, 1)) / 6.0**0.5
        load = factor * d["stiffness"] * (0.4 - d["deformation_offset"])
        force = load[:, None] * (1.0 + d["specimen_sd"][:, None] * (gear + centre[0]))
        force += d["force_offset"][:, None]
        force += d["run_offset_sd"][:, None] * (mounting + centre[1])
        drawn.append(force + d["sigma"][:, None] * noise)
    sd = np.std(drawn)
    assert found.combined_standard_uncertainty_N == pytest.approx(sd, rel=0.03)
    assert found.estimate_N == pytest.approx(np.mean(drawn), rel=2e-3)


def test_certificates_are_inputs_of_a_load_with_their_sensitivities():
    case, rng = ramp_case(certified()), np.random.default_rng(3)
    gauges = {name: rng.normal(0.0, sd, 2000) for name, sd in SDS.items()}
    draws = told({**plain_draws(case, 2000), "sigma": np.full(2000, 0.5)}, **gauges)
    stated = written_posterior(case, draws)
    by_prior = {
        name: replace(stated.diagnoses["alpha"], driven_by="prior") for name in gauges
    }
    stated = replace(stated, diagnoses={**stated.diagnoses, **by_prior})
    found = hdcal.margin(stated, 0.4, quantity="load", temperature=20.0)
    check(found)
    rows, load = by_component(found), abs(found.estimate_N)
    for name, site, slope in (
        ("force gauge, certificate", "force_gain", -load),
        ("displacement gauge, certificate", "deformation_gain", load),
        ("thermometer, certificate", "temperature_offset", -3e-4 * load),
    ):
        row = rows[name]
        assert row.type_ == "B" and row.distribution == "normal"
        assert row.standard_uncertainty == pytest.approx(SDS[site], rel=0.05)
        assert row.sensitivity_N_per_unit == pytest.approx(slope, rel=0.15)


def with_zeros(contact_sd: float, **stated: Prior):
    """Return a gear whose reading at 0.4 mm is known, and of both zeros the sum."""
    case, rng = ramp_case(), np.random.default_rng(4)
    case = replace(case, gear=replace(case.gear, priors=case.gear.priors | stated))
    draws = plain_draws(case)
    contact = rng.normal(0.0, contact_sd, len(draws["K"]))
    gauge = -1.0 - 0.4 * (draws["stiffness"] - 205.0) + draws["stiffness"] * contact
    zeros = {"deformation_offset": contact, "force_offset": gauge}
    known = written_posterior(case, draws | zeros)
    driven = "force_offset" if stated else "deformation_offset"
    by_prior = {driven: replace(known.diagnoses["alpha"], driven_by="prior")}
    return replace(known, diagnoses=known.diagnoses | by_prior)


def test_an_unstated_zero_of_a_load_is_that_of_first_contact():
    found = hdcal.margin(with_zeros(0.02), 0.4, quantity="load")
    check(found)
    rows = by_component(found)
    contact, gauge = rows["position of first contact"], rows["zero of the force gauge"]
    assert (contact.type_, contact.unit, contact.distribution) == ("B", "mm", "prior")
    assert contact.standard_uncertainty == pytest.approx(0.02, rel=0.05)
    assert contact.sensitivity_N_per_unit == pytest.approx(-205.0, rel=0.05)
    assert contact.share == found.budget[0].share > 0.9
    assert gauge.type_ == "A"
    assert gauge.standard_uncertainty == pytest.approx(0.4 * 1.5, rel=0.1)
    assert gauge.sensitivity_N_per_unit == pytest.approx(-1.0, rel=0.1)
    assert "Read the gauge" in found.lines("next_step")[0]


def test_a_stated_zero_is_not_asked_for_again():
    zero = Prior("normal", (0.0, 2.0), "N", "read out of contact")
    stated = with_zeros(0.01, force_offset=zero)
    found = hdcal.margin(stated, 0.4, quantity="load")
    assert found.budget[0].component == "zero of the force gauge"
    assert found.budget[0].type_ == "B"
    assert not found.lines("next_step")
    short = hdcal.margin(stated, 0.4, quantity="load", limit_force=80.0)
    advice = short.lines("next_step")[0]
    assert "Provide a capacity" in advice and "Read the gauge" not in advice


@pytest.mark.parametrize("sigma", [0.01, 1.5, 40.0])
def test_noise_alone_is_a_normal(sigma: float):
    found = hdcal.margin(exact(sigma=sigma), 0.1)
    check(found)
    noise = by_component(found)["reading noise"]
    assert noise.standard_uncertainty == pytest.approx(sigma, rel=1e-9)
    if sigma > 1.0:
        combined = found.combined_standard_uncertainty_N
        assert combined == pytest.approx(sigma, rel=0.02)
        assert found.coverage_factor == pytest.approx(1.96, abs=0.02)


# Student's t at 97.5 % for ν degrees of freedom (JCGM 100:2008, Table G.2).
@pytest.mark.parametrize(("dof", "printed"), [(3.0, 3.18), (5.0, 2.57), (10.0, 2.23)])
def test_few_readings_have_the_expanded_uncertainty_of_student(dof, printed):
    """σ known from ν degrees of freedom: the predictive law is a t."""
    count = 4000
    known = exact(count)
    levels = (np.random.default_rng(2).permutation(count) + 0.5) / count
    sigma = 1.5 * np.sqrt(dof / stats.chi2.ppf(levels, dof))
    few = written_posterior(known.case, {**known.draws, "sigma": sigma})
    found = hdcal.margin(few, 0.1)
    assert found.expanded_uncertainty_N == pytest.approx(1.5 * printed, rel=0.01)
