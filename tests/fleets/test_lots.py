"""Lots and operators of simulated fleets: their intervals hold the truth."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from fleets import handmade

import hdcal
from hdcal.fleets.groupings import group_offsets
from hdcal.fleets.summary import fleet_answer, fleet_report, gear_columns
from hdcal.report.document import Table
from hdcal.report.write import write_numbers

GEARS, LOTS, OPERATORS, FLEETS = 16, 4, 3, 12
MOVED = np.linspace(0.05, 0.5, 6)


def simulated(rng: np.random.Generator):
    """Return a fleet's table, its lots as shares and its operators [N]."""
    gears_sd, mounting_sd = rng.uniform(0.005, 0.04), rng.uniform(0.1, 1.5)
    lots = gears_sd * rng.uniform(0.0, 2.0) * rng.standard_normal(LOTS)
    operators = mounting_sd * rng.uniform(0.0, 2.0) * rng.standard_normal(OPERATORS)
    table: dict[str, list] = {
        name: []
        for name in ("specimen", "lot", "operator", "run", "deformation_mm", "force_N")
    }
    for gear in range(GEARS):
        share = lots[gear % LOTS] + gears_sd * rng.standard_normal()
        for run in range(2):
            operator = int(rng.integers(OPERATORS))
            zero = operators[operator] + mounting_sd * rng.standard_normal()
            force = 200.0 * (1.0 + share) * MOVED + zero
            force = force + 0.4 * rng.standard_normal(len(MOVED))
            about = f"G{gear}", f"L{gear % LOTS}", f"O{operator}", run
            for x, y in zip(MOVED, force, strict=True):
                for name, value in zip(table, (*about, x, y), strict=True):
                    table[name].append(value)
    return table, lots, operators


def held(drawn: np.ndarray, truth: np.ndarray, narrowed: float = 1.0) -> np.ndarray:
    """Tell which 95 % intervals hold the truth, narrowed about their middles."""
    low, middle, high = np.quantile(drawn, [0.025, 0.5, 0.975], axis=1)
    inside = middle + narrowed * (low - middle) <= truth
    return inside & (truth <= middle + narrowed * (high - middle))


def test_a_gear_that_is_off_is_off_from_its_lot():
    """In a stiff lot a soft gear may be stiffer than the centre of all."""
    found = handmade()
    case = replace(found.case, lots=("low", "low", "high", "high"))
    draws = dict(found.draws) | {"lot_sd": np.full(400, 0.1), "lot_ratio": np.ones(400)}
    draws |= {"lot_1": np.full(400, 0.1), "lot_2": np.full(400, -0.1)}
    readings = replace(found.readings, case=case)
    # The lots are ten percent below and above the mean of both.
    apart = found.stiffness / np.array([180.0, 180.0, 220.0, 220.0]) - 1.0
    told = {"draws": draws, "lots": ["high", "low"], "apart": apart}
    lots = replace(found, readings=readings, **told)
    # 180 of a lot of 220 N/mm.
    assert "18.14 %" in fleet_answer(lots).headline
    assert gear_columns(lots)["lot"].tolist() == ["low", "low", "high", "high"]


@pytest.mark.parametrize("lots", [("=low", "=low", "high", "high"), tuple("ABCD")])
def test_the_lot_of_each_gear_stands_in_its_row(lots, tmp_path):
    """Also of so many lots that they are not told apart."""
    found = handmade()
    case = replace(found.case, lots=lots)
    report = fleet_report(replace(found, readings=replace(found.readings, case=case)))
    write_numbers(report, tmp_path)
    for table in (
        pd.read_csv(tmp_path / "gears.csv").replace("'=low", "=low"),
        pd.read_parquet(tmp_path / "gears.parquet"),
    ):
        assert table["lot"].tolist() == [*lots]
    (shown,) = (
        block
        for section in report.document.sections
        for block in section.blocks
        if isinstance(block, Table) and block.columns[0] == "gear"
    )
    each = {row[0]: row[2] for row in shown.rows}
    assert shown.columns[2] == "lot"
    assert each == dict(zip("ABCD", lots, strict=True))


def test_without_lots_no_row_has_one():
    report = fleet_report(handmade())
    assert "lot" not in report.tables()["gears.csv"]


@pytest.mark.thorough
def test_intervals_of_lots_and_operators_hold_the_truth():
    """Of 84 due 80; 72 or fewer would hold once in 1000. Halved ones hold fewer."""
    rng = np.random.default_rng(19)
    hold, hold_halved = [], []
    for seed in range(FLEETS):
        table, lots, operators = simulated(rng)
        found = hdcal.fleet(hdcal.read_case(table, theory="spring"), seed=seed)
        assert not found.reasons
        centres = found.draws["stiffness"] * (
            1.0 + np.asarray(group_offsets(found.draws, "lot"))
        )
        zeros = np.asarray(group_offsets(found.draws, "operator"))
        truths = (
            (centres, 200.0 * (1.0 + lots)),
            (zeros, operators - operators.mean()),
        )
        for drawn, truth in truths:
            hold += held(drawn, truth).tolist()
            hold_halved += held(drawn, truth, 0.5).tolist()
    assert len(hold) == FLEETS * (LOTS + OPERATORS) == 84
    assert sum(hold) > 72
    assert sum(hold_halved) <= 72
