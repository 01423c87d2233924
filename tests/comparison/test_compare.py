"""Results side by side: differences of known size, and what may not be compared."""

import re
from dataclasses import replace

import numpy as np
import pytest
from commands import Hdcal
from matplotlib.figure import Figure
from posteriors import plain_draws, ramp_case, single, stiffer, written_posterior
from rigs import make_gear
from schema_checks import obeys
from scipy.stats import norm

import hdcal
from hdcal.comparison.compare import Comparison


def of(mean: float, sd: float, seed: int, sha: str = "", **gear):
    """Return a posterior whose stiffness is normal, of data of its own."""
    case = replace(ramp_case(make_gear(**gear)), data_sha256=sha or f"{seed:064d}")
    draws = plain_draws(case, 2000, seed)
    drawn = np.random.default_rng(seed).permutation(
        norm.ppf((np.arange(2000) + 0.5) / 2000, mean, sd)
    )
    scale = drawn / draws["stiffness"]
    names = {name: draws[name] * scale for name in ("K", "stiffness")}
    return written_posterior(case, draws | names)


def test_a_difference_is_that_of_independent_posteriors():
    """Of normal ones it is normal, with the root of the sum of their variances."""
    one, other = of(200.0, 1.0, 1), of(204.0, 2.0, 2)
    found = hdcal.compare({"old": one, "new": other}, tolerance=3.0)
    first, second = found.results
    sd = np.hypot(1.0, 2.0)
    assert second.difference_N_per_mm.median == pytest.approx(4.0, abs=0.15)
    assert second.difference_N_per_mm.lo == pytest.approx(4.0 - 1.96 * sd, abs=0.3)
    assert second.difference_N_per_mm.hi == pytest.approx(4.0 + 1.96 * sd, abs=0.3)
    assert second.probability_stiffer == pytest.approx(norm.cdf(4.0 / sd), abs=0.01)
    beyond = norm.sf(-1.0, 0.0, sd) + norm.cdf(-7.0, 0.0, sd)
    assert second.probability_differs == pytest.approx(beyond, abs=0.02)
    assert second.difference_percent.median == pytest.approx(2.0, abs=0.1)
    assert (first.difference_N_per_mm.hi, first.probability_stiffer) == (0.0, 0.5)
    assert first.stiffness_N_per_mm.median == pytest.approx(200.0, abs=0.05)
    assert second.stiffness_N_per_mm.hi == pytest.approx(204.0 + 3.92, abs=0.3)


def test_the_headline_begins_with_the_largest_difference():
    three = {"A": of(200.0, 1.0, 1), "B": of(200.5, 1.0, 2), "C": of(180.0, 1.0, 3)}
    found = hdcal.compare(three)
    assert re.match(
        r"C is (9\.9|10\.0)\d* % softer than A \(95 %: 8\.[5-9]", found.headline
    )
    assert [one.differs for one in found.ranked] == [True, False]
    frame = found.to_frame()
    assert frame.gear.tolist() == ["A", "B", "C"]
    assert {"stiffness_lo", "difference_percent_hi"} <= {*frame.columns}
    assert "probability_differs" not in frame.columns
    assert frame.difference_N_per_mm[2] == pytest.approx(-20.0, abs=0.3)
    obeys(found.to_dict(), Comparison)
    axes = found.plot(Figure().add_subplot())
    assert axes.get_ylabel() == "stiffness as read [N/mm]"


def test_several_models_of_one_result_count_as_they_are_probable():
    plain = single(size=2000)
    mixed = [(0.75, plain), (0.25, stiffer(plain, 1.1))]
    found = hdcal.compare({"plain": plain, "mixed": mixed})
    share = np.mean(found.stiffness[1] > 1.05 * np.median(found.stiffness[0]))
    assert share == pytest.approx(0.25, abs=0.02)
    assert any("same data" in note for note in found.notes)


def test_what_else_may_part_them_is_said():
    warm = of(200.0, 1.0, 2)
    gear = replace(warm.case.gear, reference_temperature=40.0)
    warm = replace(warm, case=replace(warm.case, gear=gear))
    found = hdcal.compare({"A": of(200.0, 1.0, 1), "B": warm})
    assert any("B: 40 °C" in note for note in found.notes)
    assert not any("same data" in note for note in found.notes)


def test_what_cannot_be_compared_is_refused():
    one = of(200.0, 1.0, 1)
    with pytest.raises(hdcal.InputError, match="2 to 1000 results"):
        hdcal.compare({"one": one})
    with pytest.raises(hdcal.InputError, match="tolerance"):
        hdcal.compare({"A": one, "B": of(200.0, 1.0, 2)}, tolerance=-1.0)
    for nothing in ([], "B/run", [1, 2], 3.0, None):
        with pytest.raises(hdcal.InputError):
            hdcal.compare({"A": one, "B": nothing})
    with pytest.raises(hdcal.InputError, match="by their names"):
        hdcal.compare({1: one, "1": of(200.0, 1.0, 2)})
    with pytest.raises(hdcal.InputError, match="not of the same data"):
        hdcal.compare({"A": one, "B": [(0.5, one), (0.5, of(210.0, 1.0, 2))]})
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
    assert done.returncode == 0, done.stderr
    assert re.search(r"after is 5\.0\d* % softer than before", done.stdout)
    kept = {path.name for path in (tmp_path / "side").iterdir()}
    assert {"summary.json", "gears.csv", "report.html", "results.png"} <= kept
    page = (tmp_path / "side" / "report.html").read_text("utf-8")
    assert "before" in page
    for wrong in (
        ["before"],
        ["before", "before"],
        ["before", "./before/"],
        ["before", "before/posterior.nc"],
        ["before", "nowhere"],
        ["before", "after", "--out", "before", "--force"],
    ):
        done = here("compare", *wrong)
        assert done.returncode == 2 and "Traceback" not in done.stderr
    assert (tmp_path / "before" / "posterior.nc").exists()
    done = here("compare", "before", "side")
    assert done.returncode == 2
