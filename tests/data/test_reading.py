"""A good table is read as what it says, whatever program wrote it."""

import codecs
import math
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hdcal.data.reading import read_case
from hdcal.data.resources import datasets_folder
from hdcal.data.tables.cells import (
    CellError,
    mark_thousands,
    read_number,
    read_numbers,
)

ROWS = [(0.0, 1.5), (0.1, 20.0), (0.2, 41.25), (0.3, 60.5), (0.4, 82.0), (0.5, 101.0)]


def text(separator=",", decimal=".", end="\n", header="deformation_mm{}force_N"):
    lines = [header.format(separator)]
    lines += [
        separator.join(str(cell).replace(".", decimal) for cell in r) for r in ROWS
    ]
    return end.join(lines) + end


def read(folder, content, **options):
    raw = content if isinstance(content, bytes) else content.encode()
    (folder / "data.csv").write_bytes(raw)
    return read_case(folder, **options)


@pytest.mark.parametrize(
    "content",
    [
        text(),
        text("\t"),
        text(";", ","),
        text("\t", ","),
        text(end="\r"),
        text(end="\r\n\r\n"),
        text(" ; ", ","),
        text().rstrip("\n"),
        "\n" + text() + "\n\n \n,\n",
        codecs.BOM_UTF8 + text().encode(),
        text().encode("utf-16"),
        codecs.BOM_UTF16_BE + text("\t", end="\r\n").encode("utf-16-be"),
        text(header='"Deformation_mm"{} FORCE_N '),
        text().replace("20.0", '"20.0"').replace("60.5", "+6.05e1"),
    ],
)
def test_every_spelling_of_the_same_table(folder, content):
    records = read(folder, content).records
    assert np.array_equal(records.deformation, [row[0] for row in ROWS])
    assert np.array_equal(records.force, [row[1] for row in ROWS])
    assert records.force.dtype == np.float64


@settings(max_examples=200, deadline=None)
@given(st.text("0123456789+-.eExX_, naif'", min_size=1, max_size=8))
@example("1_0")
@example("1.042,5")
@example("0x10")
@example("1.5,")
@example("1e")
@example("Infinity")
def test_plain_numbers_are_read_as_cells_are_one_by_one(cell):
    for comma in (False, True):
        numbers, faults = read_numbers(np.array([cell], object), comma)
        if comma and mark_thousands(np.array([cell], object)):
            assert numbers[0] == float(cell.replace(".", "").replace(",", "."))
            continue
        with suppress(CellError):
            assert numbers[0] == read_number(cell, comma) and not faults
            continue
        assert np.isnan(numbers[0]) and faults
    for exponent in (-300, 0, 300):
        number = math.pi * 10.0**exponent
        assert read_numbers(np.array([repr(number)], object), False)[0][0] == number


@pytest.mark.parametrize(
    ("header", "name", "value"),
    [
        ("temperature_F", "temperature", -10 / 9),
        ("temperature_K", "temperature", -243.15),
        ("time_min", "time", 1800.0),
        ("angle_deg", "angle", np.pi / 6),
        ("force_sd_kgf", "force_sd", 294.1995),
    ],
)
def test_optional_columns_convert_and_become_known(folder, header, name, value):
    lines = text(header="deformation_um{}force_kN").splitlines()
    lines = [f"{lines[0]},{header}", *(f"{line},30" for line in lines[1:])]
    records = read(folder, "\n".join(lines)).records
    assert getattr(records, name) == pytest.approx(np.full(6, value))
    assert name in records.known
    assert records.deformation[1] == pytest.approx(1e-4)
    assert records.force[1] == pytest.approx(2e4)


def test_labels_become_indices_in_order_of_appearance(folder):
    content = "deformation_mm;force_N;run;specimen\n" + "".join(
        f"0.{i};{i}.5;{run};{gear}\n"
        for i, (run, gear) in enumerate(zip("BBAACC", "xxyyxx", strict=True))
    )
    case = read(folder, content)
    assert case.run_labels == ("B", "A", "C")
    assert case.specimen_labels == ("x", "y")
    assert case.records.run.tolist() == [0, 0, 1, 1, 2, 2]
    assert case.records.specimen.tolist() == [0, 0, 1, 1, 0, 0]
    assert case.records.known >= {"run", "runs", "specimen"}
    assert "specimens" not in case.records.known
    # The same label on two gears is two runs.
    case = read(folder, content.replace("A", "B").replace("C", "B"))
    assert case.run_labels == ("x/B", "y/B")


LOTS = """specimen,Charge,lot,Bediener,run,deformation_mm,force_N
A,9,L1,Kern,1,0.1,10
A,9,L1,Kern,1,0.2,20
A,9,,Moss,2,0.1,10
A,9,L1,Moss,2,0.2,21
B,9,,Kern,1,0.1,11
B,9,,Kern,1,0.2,23
"""


def test_lots_are_those_of_gears_and_operators_those_of_mountings(folder):
    case = read(folder, LOTS)
    assert (case.specimen_labels, case.lots) == (("A", "B"), ("L1", "not stated"))
    assert case.run_labels == ("A/1", "A/2", "B/1")
    assert case.operators == ("Kern", "Moss", "Kern")
    # A number that stays the same is no force, whatever Charge means in French.
    assert case.records.force[-1] == 23.0
    case = read(folder, LOTS.replace("A,9,L1,Moss,2,0.2", "A,9,L2,Kern,2,0.2"))
    assert (case.lots, case.operators) == ((), ())
    assert "the column lot is not used: specimen 'A' has several values" in case.notes


@pytest.mark.parametrize(
    ("header", "mapped"),
    [
        ("Load", "Load [ kgf ]"),
        ("Load[kgf]", "Load[kgf]"),
        ("Load_kgf", "Load_kgf"),
        ('"Load, measured"', "Load, measured[kgf]"),
        ("force_N", "2[kgf]"),
    ],
)
def test_a_mapped_column(folder, header, mapped):
    content = text(header=f"deformation_mm{{}}{header}")
    case = read(folder, content, columns={"force": mapped})
    assert case.records.force[1] == pytest.approx(196.133)


def test_the_articles_table():
    case = read_case(str(datasets_folder() / "xb1-100-80"))
    assert case.name == "xb1-100-80"
    x, y = case.records.deformation, case.records.force
    slope = (x @ y) / (x @ x)
    spread = np.sqrt(np.sum((y - slope * x) ** 2) / 13)
    assert slope == pytest.approx(198.02, abs=5e-3)
    assert spread == pytest.approx(2.727, abs=5e-4)
    assert case.notes == (
        "2 of 14 forces are not multiples of the stated resolution of 0.98 N",
    )
    assert np.array_equal(case.records.direction, np.ones(14))
    assert case.gear.geometry.load_height == 62.0


def test_absent_covariates_are_neutral(folder):
    gear = folder / "gear.toml"
    gear.write_text(gear.read_text() + "reference_temperature_C = 23.5\n")
    records = read_case(folder).records
    assert np.array_equal(records.temperature, np.full(6, 23.5))
    for name in ("time", "angle", "rate", "force_sd", "run", "specimen"):
        assert not getattr(records, name).any()
    assert records.known == frozenset()


def test_the_load_cell_of_nist():
    case = read_case(str(datasets_folder() / "nist-pontius"))
    assert case.records.run.tolist() == [0] * 20 + [1] * 20
    slope = np.polyfit(case.records.deformation, case.records.force, 1)[0]
    g = case.gear.geometry
    series = (np.pi**2 - 8) / 16
    shape = g.length * g.wall_thickness**3 / g.radius**3
    nominal = np.pi * case.gear.priors["E0"].numbers[0] * shape / (24 * series)
    assert slope == pytest.approx(nominal, rel=2e-3)
