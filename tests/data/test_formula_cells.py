"""No table that hdcal writes runs in a spreadsheet, and hdcal reads it back."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from hdcal.data.formula_cells import with_formula, without_formula
from hdcal.data.measurements import read_measurements
from hdcal.report.csv_table import columns_csv

FORMULAS = [
    "=1+1",
    '=HYPERLINK("http://example.invalid")',
    "+cmd|' /C calc'!A0",
    "-2+3",
    "@SUM(1)",
    "\t=1",
    "\r=1",
]
TEXTS = [*FORMULAS, *(f"'{text}" for text in FORMULAS), *(f"''{t}" for t in FORMULAS)]
HARMLESS = ["1", "-1", "+2.5e3", "a=b", "", "'tis", "up", "40CrNiMoA", "−1"]


@pytest.mark.parametrize("text", FORMULAS)
def test_no_formula_begins_a_cell(text: str):
    table = columns_csv({"label": np.array([text, "a"], object), text: np.ones(2)})
    header, first, _ = csv.reader(io.StringIO(table, newline=""))
    assert first == ["'" + text, "1"]
    assert header == ["label", "'" + text]


@pytest.mark.parametrize("end", ["\r", "\n"])
def test_no_formula_begins_a_line_within_a_cell(end: str):
    table = columns_csv({"label": np.array([f"a{end}=1+1"], object)})
    assert table == f'label\n"a{end}=1+1"\n'


@pytest.mark.parametrize("text", HARMLESS)
def test_what_runs_nowhere_stays(text: str):
    assert without_formula(text) == with_formula(text) == text


@pytest.mark.parametrize("text", TEXTS)
def test_every_text_comes_back(text: str):
    assert with_formula(without_formula(text)) == text


def test_numbers_stay_numbers():
    values = np.array([-1.5, 2.0, -1e-300, np.nan])
    table = columns_csv({"force_N": values, "count": np.array([-1, 2, -3, 4])})
    assert table.splitlines()[1:] == ["-1.5,-1", "2,2", "-1e-300,-3", ",4"]


def test_labels_that_were_written_are_read_as_they_were(tmp_path: Path):
    # Such blanks are no part of a label that a file gave.
    inside = [text for text in TEXTS if not {"\t", "\r"} & {*text}]
    labels = [*inside, "-1", "a"]
    number = np.arange(float(len(labels)))
    columns = {"deformation_mm": number, "force_N": number}
    table = columns_csv(columns | {"run": np.array(labels, object)})
    (tmp_path / "data.csv").write_text(table, "utf-8")
    assert read_measurements(tmp_path / "data.csv").run.names == tuple(labels)
