"""A fleet whose population is not sampled: answers to it are exact and quick."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

import hdcal
from hdcal.fleets.fleet import fleet_of
from hdcal.fleets.gear_table import QUANTITIES
from hdcal.fleets.model.line_fits import line_fits
from hdcal.fleets.model.population import FittedFleet
from hdcal.fleets.model.quantities import FleetGroups
from hdcal.fleets.reading.readings import FleetReadings, fleet_readings
from hdcal.fleets.result import Fleet
from hdcal.inference.checks import Check

CHAINS, DRAWS = 2, 200


def four_gears() -> FleetReadings:
    """Return the readings of gears of 199, 200, 201 and 180 N/mm."""
    x = np.tile(np.linspace(0.0, 0.5, 5), 4)
    stiffness = np.repeat([199.0, 200.0, 201.0, 180.0], 5)
    noise = 0.1 * np.tile([1.0, -1.0, 0.0, -1.0, 1.0], 4)
    force = stiffness * x + noise
    table = {"deformation_mm": x, "force_N": force, "gear": np.repeat(list("ABCD"), 5)}
    gear = {"wall_thickness_mm": 0.68, "radius_mm": 40.0, "length_mm": 70.0}
    return fleet_readings(hdcal.read_case(table, gear))


def fitted(
    readings: FleetReadings,
    odd: Mapping[str, Sequence[str]] | None = None,
    failed: str = "",
) -> FittedFleet:
    """Return a population with the lines of the gears as its gears.

    Args:
        readings: of the gears.
        odd: quantities in which gears are odd, by the gear.
        failed: words of a check that failed.
    """
    rng, count, case = np.random.default_rng(0), CHAINS * DRAWS, readings.case
    groups = FleetGroups.of(case, readings.sums.run)
    fits = line_fits(readings.sums, groups.rig, readings.step)
    slope = np.bincount(fits.gear, fits.slope) / np.bincount(fits.gear)
    centre = float(np.median(slope))
    draws = {
        "stiffness": rng.normal(centre, 0.0025 * centre, count),
        "zero": rng.normal(0.0, 0.1, count),
        "specimen_sd": rng.uniform(0.005, 0.01, count),
        "run_offset_sd": rng.uniform(0.5, 1.5, count),
        "sigma": rng.uniform(0.4, 0.6, count),
        "noise_spread": rng.uniform(0.0, 0.1, count),
    }
    for kind in ("", "zero_", "noise_"):
        draws[f"{kind}off_share"] = rng.uniform(0.0, 0.1, count)
        draws[f"{kind}off_ratio"] = rng.uniform(4.0, 8.0, count)
    named = {"lot": groups.lots, "rig": groups.rigs, "operator": groups.operators}
    for kind, names in named.items():
        if names:
            offsets = rng.normal(0.0, 0.001, (len(names), count))
            for place, offset in enumerate(offsets - offsets.mean(axis=0), 1):
                draws[f"{kind}_{place}"] = offset
            draws |= {f"{kind}_sd": np.abs(offsets[0]), f"{kind}_ratio": np.ones(count)}
    stiffness = slope + rng.normal(0.0, 0.3, (40, len(slope)))
    low, middle, high = np.quantile(stiffness, [0.025, 0.5, 0.975], axis=0)
    table = {"stiffness": middle, "stiffness_lo": low, "stiffness_hi": high}
    for name, end in (("percent", middle), ("lo", low), ("hi", high)):
        table[f"apart_{name}"] = 100.0 * (end / centre - 1.0)
    nothing = np.full(len(slope), np.nan)
    table |= {"distance_sd": middle / centre - 1.0, "zero_N": 0.0 * slope}
    table |= {"noise_sd_N": np.exp(fits.log_sd), "loop_N": nothing, "bend_N": nothing}
    for name in QUANTITIES:
        is_odd = [name in (odd or {}).get(gear, ()) for gear in case.specimen_labels]
        table[f"off_{name}"] = np.where(is_odd, 0.99, 0.01)
    outcome = "failed" if failed else "passed"
    return FittedFleet(
        draws=draws,
        gears=pd.DataFrame(table),
        stiffness=stiffness,
        groups=groups,
        fits=fits,
        unit=80.0,
        checks=(Check("chains agree", outcome, failed or "the largest R-hat is 1.0"),),
        settings={"seed": 0, "chains": CHAINS, "warmup": 500, "draws": DRAWS},
    )


def handmade(
    readings: FleetReadings | None = None,
    odd: Mapping[str, Sequence[str]] | None = None,
    failed: str = "",
    **asked: float,
) -> Fleet:
    """Return a fleet; by default four gears of which D is odd in its stiffness."""
    odd = {"D": ["stiffness"]} if readings is None and odd is None else odd
    readings = four_gears() if readings is None else readings
    return fleet_of(readings, fitted(readings, odd, failed), **asked)
