"""No table that hdcal writes runs in a spreadsheet, and hdcal reads it back."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from hdcal.data.formula_cells import with_formula, without_formula
from hdcal.data.measurements.measurements import read_measurements
from hdcal.report.table_files import columns_csv

FORMULAS = [
    "=1+1",
    '=HYPERLINK("http://example.invalid")',
    "+cmd|' /C calc'!A0",
    "-2+3",
    "@SUM(1)",
    "＝1+1",
    "＋1+x",
    "－x",
    "＠SUM(1)",
]
# A spreadsheet may take another character for the end of a cell than the one that was
# written, quoted or not.
WITHIN = {
    "\t=1": "'\t'=1",
    "\r=1": "'\r'=1",
    "x;=1+1": "x;'=1+1",
    "x\t=1+2": "x\t'=1+2",
    "x,@SUM(1);-a": "x,'@SUM(1);'-a",
    "x|＝1": "x|'＝1",
    "x;'=1": "x;''=1",
    "1;-2;=3": "1;-2;'=3",
    "x; =1": "x; =1",
}
RUNNING = [*FORMULAS, *WITHIN]
TEXTS = [*RUNNING, *(f"'{text}" for text in RUNNING), *(f"''{t}" for t in RUNNING)]
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
    assert table == f'label\n"a{end}\'=1+1"\n'


@pytest.mark.parametrize("text", WITHIN)
def test_no_formula_begins_a_cell_of_another_separator(text: str):
    assert without_formula(text) == WITHIN[text]
    table = columns_csv({"label": np.array([text, "a"], object), text: np.ones(2)})
    header, first, _ = csv.reader(io.StringIO(table, newline=""))
    assert (header[1], first[0]) == (WITHIN[text], WITHIN[text])


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
    assert read_measurements(tmp_path / "data.csv").runs[1] == tuple(labels)
