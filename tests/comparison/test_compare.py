"""Differences of known size, and results that may not be compared."""

from dataclasses import replace

import numpy as np
import pytest
from commands import Hdcal
from posteriors import (
    plain_draws,
    ramp_case,
    single,
    stiffer,
    with_discrepancy,
    written_posterior,
)
from rigs import make_gear
from schema_checks import obeys
from scipy.stats import norm

import hdcal
from hdcal.comparison.compare import Comparison


def of(mean: float, sd: float, seed: int, **gear):
    """Return a posterior of separate data whose stiffness is normal."""
    case = replace(ramp_case(make_gear(**gear)), data_sha256=f"{seed:064d}")
    draws, places = plain_draws(case, 2000, seed), (np.arange(2000) + 0.5) / 2000
    drawn = np.random.default_rng(seed).permutation(norm.ppf(places, mean, sd))
    scale = drawn / draws["stiffness"]
    names = {name: draws[name] * scale for name in ("K", "stiffness")}
    return written_posterior(case, draws | names)


def test_a_difference_is_that_of_independent_posteriors():
    """The difference of normal ones is normal; the variances add."""
    results = {"old": of(200.0, 1.0, 1), "new": of(204.0, 2.0, 2)}
    found = hdcal.compare(results, tolerance=3.0)
    first, second = found.results
    apart, law = second.difference_N_per_mm, norm(4.0, np.hypot(1.0, 2.0))
    assert apart.median == pytest.approx(4.0, abs=0.15)
    assert (apart.lo, apart.hi) == pytest.approx(law.interval(0.95), abs=0.3)
    assert second.probability_stiffer == pytest.approx(law.sf(0.0), abs=0.01)
    beyond = law.sf(3.0) + law.cdf(-3.0)
    assert second.probability_differs == pytest.approx(beyond, abs=0.02)
    assert first.stiffness_N_per_mm.median == pytest.approx(200.0, abs=0.05)
    obeys(found.to_dict(), Comparison)


def test_models_count_as_they_are_probable_and_resolved_differences_come_first():
    plain = single(size=2000)
    mixed = [(0.75, plain), (0.25, stiffer(plain, 1.1))]
    found = hdcal.compare({"A": plain, "B": mixed, "C": stiffer(plain, 1.2)})
    share = np.mean(found.stiffness[1] > 1.05 * np.median(found.stiffness[0]))
    assert share == pytest.approx(0.25, abs=0.02)
    assert found.headline.startswith("C is ") and len(found.notes) == 2
    assert found.to_frame().gear.tolist() == ["A", "B", "C"]


def test_other_ranges_and_discrepancies_are_noted():
    plain, other = of(200.0, 1.0, 1), with_discrepancy(400)
    records = other.case.records
    wider = replace(records, deformation=1.5 * records.deformation)
    other = replace(other, case=replace(other.case, records=wider, data_sha256="1"))
    assert not hdcal.compare({"A": plain, "B": of(200.0, 1.0, 2)}).ranges_differ
    found = hdcal.compare({"A": plain, "B": other})
    assert found.ranges_differ and len(found.notes) == 3


def test_results_that_cannot_be_compared_are_refused():
    one = of(200.0, 1.0, 1)
    with pytest.raises(hdcal.InputError, match="two or more"):
        hdcal.compare({"one": one})
    across = of(200.0, 1.0, 2, reading="diametral")
    with pytest.raises(hdcal.InputError, match="A is radial, B is diametral"):
        hdcal.compare({"A": one, "B": across})
    check = replace(one.checks[0], outcome="failed")
    with pytest.raises(hdcal.NotUsable):
        hdcal.compare({"A": one, "B": replace(one, checks=(check,))})


def test_the_command_writes_a_folder_and_refuses_one_result(here: Hdcal, tmp_path):
    for name, mean in (("before", 200.0), ("after", 190.0)):
        (tmp_path / name).mkdir()
        of(mean, 1.0, int(mean)).save(tmp_path / name / "posterior.nc")
    done = here("compare", "before", "after", "--tolerance", "2", "--out", "side")
    assert done.returncode == 0 and "% softer than before" in done.stdout
    assert (tmp_path / "side" / "gears.csv").exists()
    for wrong in (["before"], ["before", "nowhere"], ["before", "side"]):
        assert here("compare", *wrong).returncode == 2
