"""Table of the gears of a fleet, gears.csv, and the gears that are flagged in it."""

from typing import Literal, get_args

import numpy as np
import pandas as pd

from hdcal.data.theory_names import SPRING
from hdcal.fleets.model.population import FittedFleet
from hdcal.fleets.reading.readings import FleetReadings
from hdcal.inference.distributions import moments
from hdcal.report.item import TAILS, Interval, Item, Probability, Words, quantity

QuantityName = Literal["stiffness", "zero", "noise", "loop", "bend"]
QUANTITIES = get_args(QuantityName)


class Flagged(Item):
    """A gear with the quantities in which it is flagged, and its probability there.

    The centre is that of the lot if lots are distinguished.
    """

    gear: Words = quantity("gear")
    quantities: dict[QuantityName, Probability]
    apart_percent: Interval = quantity("distance from the centre", "%")
    zero_N: float = quantity("zero", "N")
    noise_sd_N: float = quantity("noise of a reading", "N")
    loop_N: float | None = quantity("loop", "N")
    bend_N: float | None = quantity("bend", "N")


class GearLeftOut(Item):
    """A gear that is in none of the numbers."""

    gear: Words
    why: Words


def gear_table(readings: FleetReadings, fit: FittedFleet) -> pd.DataFrame:
    """Return what is known of each gear, one row a gear."""
    case, sums, gears = readings.case, readings.sums, fit.gears
    ratio = 1.0 if readings.size_ratio is None else readings.size_ratio
    flagged = np.stack([fit.flagged(name) for name in QUANTITIES], axis=1)
    off = gears[[f"off_{name}" for name in QUANTITIES]]
    columns = {
        "gear": case.specimen_labels,
        **({"lot": case.lots} if case.lots else {}),
        "rows": np.bincount(sums.gear, sums.rows).astype(int),
        "runs": np.bincount(sums.gear),
        "stiffness_N_per_mm": ratio * gears["stiffness"],
        "stiffness_lo": ratio * gears["stiffness_lo"],
        "stiffness_hi": ratio * gears["stiffness_hi"],
        **({} if readings.size_ratio is None else {"size_ratio": ratio}),
        **_influence(readings, fit),
    }
    names = ["apart_percent", "apart_lo", "apart_hi", "distance_sd"]
    names += ["zero_N", "noise_sd_N", "loop_N", "bend_N"]
    return pd.DataFrame({**columns, **gears[names], **off}).assign(
        probability_off=off.max(axis=1),
        flagged=flagged.any(axis=1),
        flagged_in=[", ".join(np.array(QUANTITIES)[each]) for each in flagged],
        status="failed" if fit.failed else "ok",
    )


def _influence(readings: FleetReadings, fit: FittedFleet) -> dict[str, np.ndarray]:
    """Return K of every gear: the data determine its product with the modulus only."""
    gear = readings.case.gear
    if gear.theory == SPRING:
        return {}
    mean, sd = moments(gear.priors["E0"], "E0")
    rng = np.random.default_rng(int(fit.settings["seed"]))
    modulus = 1.0 + sd / mean * rng.standard_normal((len(fit.stiffness), 1))
    low, middle, high = np.quantile(fit.stiffness / (fit.unit * modulus), TAILS, axis=0)
    return {"K": middle, "K_lo": low, "K_hi": high}


def ranked(table: pd.DataFrame, first: str = "flagged") -> pd.DataFrame:
    """Return gears with a mark first, then the most probable outliers first."""
    order = [first, "probability_off"]
    return table.sort_values(order, ascending=False, kind="stable")


def flagged_gears(table: pd.DataFrame) -> tuple[Flagged, ...]:
    """Return the flagged gears: in stiffness first, then the most probable first."""
    found = table.loc[table["flagged"]]
    found = found.assign(first=found["flagged_in"].str.contains("stiffness"))
    found = ranked(found, "first").astype(object).replace({np.nan: None})
    names = ["gear", "zero_N", "noise_sd_N", "loop_N", "bend_N"]
    return tuple(
        Flagged(
            **{name: row[name] for name in names},
            quantities={n: row[f"off_{n}"] for n in row["flagged_in"].split(", ")},
            apart_percent=Interval(
                median=row["apart_percent"], lo=row["apart_lo"], hi=row["apart_hi"]
            ),
        )
        for row in found.to_dict("records")
    )
