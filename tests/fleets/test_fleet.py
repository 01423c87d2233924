"""Which gear is off, how much gears scatter, and what the next one will be."""

import json
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from commands import Hdcal
from matplotlib.figure import Figure
from schema_checks import obeys

import hdcal
from hdcal.errors import InputError
from hdcal.fleets.answer import FleetAnswer
from hdcal.fleets.next_gear import next_gear, stiffness_bounds
from hdcal.fleets.off_in import FALSE_CALLS, called_off
from hdcal.fleets.summary import fleet_answer, fleet_report, gear_columns
from hdcal.inference.checks import Check

MEAN, SPREAD, ZERO_SD, NOISE = 200.0, 0.01, 1.0, 0.5
SIZES = {"wall_thickness_mm": 0.68, "radius_mm": 40.0, "length_mm": 70.0}
NAMED = SIZES | {"material": "steel", "deformation": "radial"}


def measured(seed=3, gears=10, off=0.85, runs=2, rows=30, spread=SPREAD):
    """Return the readings of gears of which the seventh is off, and all stiffnesses."""
    rng = np.random.default_rng(seed)
    stiffness = MEAN * (1.0 + spread * rng.standard_normal(gears))
    if off is not None:
        stiffness[6] = off * MEAN
    x = np.linspace(0.02, 0.5, rows)
    parts = [
        pd.DataFrame(
            {
                "gear": f"G{gear + 1:02d}",
                "run": run,
                "deformation_mm": x,
                "force_N": stiffness[gear] * x
                + rng.normal(0.0, ZERO_SD)
                + rng.normal(0.0, NOISE, rows),
            }
        )
        for gear in range(gears)
        for run in range(runs)
    ]
    return pd.concat(parts, ignore_index=True), stiffness


@pytest.fixture(scope="module")
def found():
    frame, stiffness = measured()
    # Draws enough that ends of intervals vary little from seed to seed.
    case = hdcal.read_case(frame, gear=NAMED)
    return hdcal.fleet(case, draws=2000), stiffness


def test_bounds_keep_their_share_of_gears_and_their_confidence(found):
    fleet, _ = found
    rng, many, content = np.random.default_rng(0), 100_000, 0.9
    rows = rng.choice(len(fleet.draws["sigma"]), 50, replace=False)
    few = {name: values[rows] for name, values in fleet.draws.items()}
    ends = []
    for row in range(len(rows)):
        one = {name: values[[row]] for name, values in few.items()}
        low, high = stiffness_bounds(one, content)
        drawn = next_gear({n: np.full(many, v[0]) for n, v in one.items()}, rng)
        assert np.mean(drawn > low) == pytest.approx(content, abs=5e-3)
        assert np.mean(drawn < high) == pytest.approx(content, abs=5e-3)
        ends.append((low, high))
    lows, highs = np.transpose(ends)
    sure = np.quantile(lows, 0.05), np.quantile(highs, 0.95)
    assert stiffness_bounds(few, content) == pytest.approx(sure)


def test_the_soft_gear_is_named_and_no_other(found):
    fleet, stiffness = found
    answer = fleet_answer(fleet)
    assert (answer.status, answer.called_off) == ("ok", ("G07",))
    assert re.search(r"G07 .* 15\.\d %", answer.headline)
    # It does not widen what the others scatter by, nor move their centre.
    population = answer.population
    between = population.gear_sd_percent
    # By chance these nine scatter by more than the gears they were drawn from.
    others = np.delete(stiffness, 6)
    assert between.lo < 100.0 * np.std(others, ddof=1) / others.mean() < between.hi
    assert between.median < 2.5  # of all ten it were 5
    centre = population.stiffness_N_per_mm
    assert centre.lo < np.median(stiffness) < centre.hi
    assert population.mounting_sd_N.lo < ZERO_SD < population.mounting_sd_N.hi
    assert population.reading_sd_N.lo < NOISE < population.reading_sd_N.hi


def test_each_gear_is_within_its_interval(found):
    fleet, stiffness = found
    columns = gear_columns(fleet)
    held = (columns["stiffness_lo"] < stiffness) & (stiffness < columns["stiffness_hi"])
    assert held.sum() >= 8
    width = columns["stiffness_hi"] - columns["stiffness_lo"]
    assert np.all(width < 4.0)
    # Of K and the modulus the readings tell the product: its prior widens K.
    ratio = columns["stiffness_N_per_mm"] / columns["K"]
    np.testing.assert_allclose(ratio, fleet.unit, rtol=5e-3)
    modulus = fleet.case.gear.priors["E0"]
    loose = 3.92 * modulus.numbers[1] / modulus.numbers[0]
    relative = (columns["K_hi"] - columns["K_lo"]) / columns["K"]
    np.testing.assert_allclose(np.hypot(width / stiffness, loose), relative, rtol=0.15)
    np.testing.assert_allclose(columns["noise_sd_N"], NOISE, rtol=0.2)
    assert columns["distance_sd"][6] < -5.0


def test_it_shows_itself(found):
    fleet, _ = found
    assert repr(fleet).startswith("<Fleet: 9 of 10 gears")
    frame = fleet.to_frame()
    assert list(frame.gear[frame.called_off]) == ["G07"]
    axes = fleet.plot(Figure().add_subplot())
    assert axes.get_ylabel() == "stiffness as read [N/mm]"
    chart = fleet_report(fleet).charts()["gears"][0]
    odd = next(one for one in chart.series if "off in stiffness" in one.label)
    assert list(odd.y) == [np.median(fleet.stiffness[:, 6])]


def test_a_fleet_that_failed_its_checks_says_so(found):
    bad = Check("chains agree (R-hat)", "failed", "the largest R-hat is 1.2")
    failed = replace(found[0], checks=(bad,))
    answer = fleet_answer(failed)
    assert answer.status == "failed" and "1.2" in answer.reasons[0]
    assert set(gear_columns(failed)["status"]) == {"failed"}
    assert repr(failed) == "<Fleet: FAILED, do not use>"
    assert not fleet_report(failed).charts()


def test_gears_are_called_off_by_how_rare_ordinary_ones_are_there():
    """The k-th smallest chance of n is held against k/n of the share."""

    def called(kind: str, *chances: float) -> list[bool]:
        return called_off({kind: np.array(chances)})[kind].tolist()

    told = called("stiffness", 0.006, 0.4, 0.013, 0.8, 0.9)
    assert told == [True, False, True, False, False]
    # By itself neither is far enough out: a fifth of 0.035 is 0.007.
    assert not any(called("stiffness", 0.008, 0.4, 0.4, 0.8, 0.9))
    assert called("noise", 0.0009, 0.4, 0.4, 0.8, 0.9)[0]
    assert not any(called("zero", 0.0006, 0.4, 0.4, 0.8, 0.9))
    assert not any(called("shape", 0.0006, 0.4, 0.4, 0.8, 0.9))
    assert pytest.approx(0.05) == FALSE_CALLS


def test_what_is_no_fleet_is_refused():
    frame, _ = measured(gears=7)
    few = frame[frame.gear.isin(["G01", "G02"])]
    with pytest.raises(InputError, match=r"2 gears: .* takes 3 or more"):
        hdcal.fleet(hdcal.read_case(few, gear=NAMED))
    held = frame.assign(
        deformation_mm=np.where(frame.gear == "G03", 0.1, frame.deformation_mm)
    )
    with pytest.raises(InputError, match="gear 'G03' was read at one deformation"):
        hdcal.fleet(hdcal.read_case(held, gear=NAMED))


@pytest.mark.thorough
def test_the_command_leaves_a_folder(hdcal: Hdcal, tmp_path):
    frame, _ = measured()
    frame.to_csv(tmp_path / "line.csv", index=False)
    done = hdcal("fleet", "line.csv", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "line-fleet"
    names = {path.name for path in folder.iterdir()}
    assert {"gears.csv", "summary.json", "report.html", "gears.png"} <= names
    answer = json.loads((folder / "summary.json").read_text("utf-8"))
    obeys(answer, FleetAnswer)
    assert answer["called_off"] == ["G07"] and json.loads(done.stdout) == answer
    table = pd.read_csv(folder / "gears.csv")
    assert list(table.gear[table.called_off]) == ["G07"]
    few = frame[frame.gear == "G01"]
    few.to_csv(tmp_path / "one.csv", index=False)
    refused = hdcal("fleet", "one.csv", cwd=tmp_path)
    assert refused.returncode == 2 and "takes 3 or more" in refused.stderr
    assert not (tmp_path / "one-fleet").exists()


@pytest.mark.slow
def test_one_in_thirty_is_found_and_none_is_called_falsely():
    """A gear off by four sds of the population, and fleets in which none is."""
    right, wrong, fleets = 0, 0, 40
    for seed in range(fleets):
        frame, _ = measured(seed, gears=30, off=1.0 + 4.0 * 0.02, spread=0.02)
        found = hdcal.fleet(hdcal.read_case(frame), seed=seed)
        right += found.called[6]
        frame, _ = measured(1000 + seed, gears=30, off=None, spread=0.02)
        found = hdcal.fleet(hdcal.read_case(frame), seed=seed)
        wrong += found.called.any()
    assert right >= 0.9 * fleets - 2.0 * np.sqrt(0.09 * fleets)
    assert wrong <= 0.05 * fleets + 2.0 * np.sqrt(0.05 * fleets)


@pytest.mark.thorough
def test_a_few_readings_that_the_display_shows_on_a_line_scatter_by_its_steps():
    rng = np.random.default_rng(3)
    gears, x = 40, np.array([0.1, 0.2, 0.3, 0.4, 0.5])
    stiffness = MEAN * (1.0 + 0.03 * rng.standard_normal(gears))
    force = stiffness[:, None] * x + rng.normal(0.0, 0.1, (gears, len(x)))
    rows = {"deformation_mm": np.tile(x, gears), "force_N": np.round(force.ravel())}
    frame = pd.DataFrame({"gear": np.repeat(np.arange(gears), len(x)), **rows})
    straight = np.all(np.diff(np.round(force), 2) == 0.0, axis=1)
    assert straight.sum() >= 5
    found = hdcal.fleet(hdcal.read_case(frame, gear=NAMED))
    assert not found.reasons
    low, high = np.quantile(found.stiffness, [0.025, 0.975], axis=0)
    assert np.mean((low < stiffness) & (stiffness < high)) > 0.8
    sigma = np.quantile(found.draws["sigma"], [0.025, 0.975])
    # Noise and rounding: 0.31 N.
    assert sigma[0] < 0.31 < sigma[1]
