"""Numbers, findings and charts of a calibration follow from its posterior."""

from dataclasses import replace

import numpy as np
import pytest
from posteriors import (
    batch,
    plain_draws,
    ramp_case,
    regressed,
    single,
    spring,
    with_discrepancy,
    written_posterior,
)
from rigs import make_gear

from hdcal.calibration.calibration import (
    Calibration,
    calibration_of,
)
from hdcal.data.prior import Prior
from hdcal.inference.checks import PLAUSIBLE, Check
from hdcal.report.charts.chart_spec import Band, Line, Points

X = np.linspace(0.02, 0.54, 60)


def of_force(
    shape: np.ndarray, deformation=X, sense: np.ndarray | float = 1.0
) -> Calibration:
    """Return the calibration of a straight line to readings with some shape."""
    rng, size = np.random.default_rng(1), len(deformation)
    force = 200.0 * deformation + shape + rng.normal(0.0, 0.3, size)
    posterior = regressed(deformation, force, rng, 400)
    moved = {name: np.full(size, sense) for name in ("sense", "direction")}
    records = replace(posterior.case.records, **moved)
    case = replace(posterior.case, records=records)
    return calibration_of(replace(posterior, case=case))


def test_estimates_are_quantiles_of_the_draws_in_shown_units():
    posterior = single()
    found = calibration_of(posterior)
    assert found.parameters["E0"].unit == "GPa"
    lo, median, hi = np.quantile(posterior.draws["E0"] / 1e3, [0.025, 0.5, 0.975])
    E0 = found.parameters["E0"]
    assert (E0.lo, E0.median, E0.hi) == pytest.approx((lo, median, hi))
    frame = found.to_frame().set_index("name")
    assert frame.index[0] == "stiffness"
    assert frame["median"]["stiffness"] == np.median(posterior.draws["stiffness"])
    ring = found.K_by_theory["ring"]
    assert ring and ring.median == pytest.approx(frame["median"]["K"])


def test_a_fixed_parameter_has_no_sampling_quality():
    case = ramp_case(make_gear(K=Prior("fixed", (2.6,))))
    posterior = written_posterior(case, plain_draws(case))
    sampled = {n: d for n, d in posterior.diagnoses.items() if n != "K"}
    found = calibration_of(replace(posterior, diagnoses=sampled))
    assert list(found.parameters)[-1] == "K"
    K = found.to_dict()["parameters"]["K"]
    assert K["rhat"] is K["ess_bulk"] is None
    assert (K["driven_by"], K["contraction"]) == ("prior", 0.0)


def test_each_of_several_specimens_has_its_stiffness():
    posterior = batch()
    found = calibration_of(posterior)
    draws = posterior.draws
    for i, name in enumerate(posterior.case.specimen_labels):
        each = draws["stiffness"] * (1.0 + draws["specimen_deviation"][:, i])
        assert found.specimens[name].median == pytest.approx(np.median(each))
    assert "6 gears" in found.headline
    assert found.steps[0] == "several specimens"


def test_checks_become_warnings_remarks_and_reasons():
    outcomes = ("passed", "note", "warning", "failed")
    checks = tuple(Check("by hand", outcome, f"is {outcome}") for outcome in outcomes)
    found = calibration_of(replace(single(), checks=checks))
    assert found.status == "failed" and found.steps == ("failed",)
    assert found.reasons == ("by hand: is failed",)
    assert found.warnings == ("Is warning",)
    assert found.flat_directions == ("is note",)


def test_steps_are_ordered_and_each_has_a_sentence():
    posterior = single(size=200)
    plain = calibration_of(posterior)
    assert plain.steps == ("no unloading", "no specimen", "no temperature")
    check = Check(PLAUSIBLE, "warning", "K = 2e+03, expected 0.5 to 8")
    found = calibration_of(replace(posterior, checks=(check,)))
    assert found.steps == ("implausible", *plain.steps)
    assert found.next_step and found.next_step.startswith("Check the units")
    assert "discrepancy" in calibration_of(with_discrepancy()).steps


def test_a_shape_of_the_residuals_is_in_headline_and_steps():
    straight, bent = of_force(0.0 * X), of_force(20.0 * X**2)
    loop = np.concatenate([X, X[::-1]])
    sense = np.repeat([1.0, -1.0], len(X))
    looped = of_force(3.0 * sense, loop, sense)
    assert not straight.residuals and "curvature" in bent.shapes
    assert bent.steps[0] == "curvature" and "direction" in looped.steps
    ends = [found.headline.partition("as read.")[2] for found in (straight, bent)]
    assert ends[0] == "" and "straight line" in ends[1]
    assert "unloading" in looped.headline
    assert {"bend", "beside_a_loop"}.isdisjoint(bent.to_dict())


def test_charts_show_readings_bands_and_densities():
    posterior = with_discrepancy()
    found = calibration_of(posterior)
    charts = found.charts()
    top, below = charts["calibration"].panels
    (readings,) = (mark for mark in top.marks if isinstance(mark, Points))
    np.testing.assert_array_equal(readings.y, posterior.case.records.force)
    labels = {mark.label for mark in top.marks if isinstance(mark, Band)}
    assert {"mean force", "with the discrepancy"} <= labels
    (median,) = (m for m in below.marks if isinstance(m, Line) and m.dash == "solid")
    assert np.nanmax(np.abs(median.y)) == 0.0
    residual = [panel.x for panel in charts["residuals"].panels]
    assert residual == ["deformation as read [mm]", "row of the data"]
    assert len(charts["priors"].panels) == len(posterior.diagnoses)
    E0 = charts["priors"].panels[list(posterior.diagnoses).index("E0")]
    density = E0.marks[0]
    assert isinstance(density, Band)
    at = density.x[np.argmax(density.high)]
    assert at == pytest.approx(207.0, abs=1.5) and density.high.max() == 1.0


def test_a_spring_has_no_theories_and_its_K_is_the_stiffness():
    posterior = spring()
    found = calibration_of(posterior)
    assert found.K_by_theory == dict.fromkeys(("ring", "cup", "article"))
    assert found.parameters["K"].unit == "N/mm" and not found.theories
    assert "E0" in found.parameters and "E0" not in found.measured
    page = found.page()
    assert "K under each theory" not in page and ">nan<" not in page
