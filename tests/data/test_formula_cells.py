"""No table that hdcal writes runs in a spreadsheet, and hdcal reads it back."""

import csv
import io

import numpy as np
import pytest

from hdcal.data.measurements.measurements import read_measurements
from hdcal.data.tables.cells import with_formula, without_formula
from hdcal.report.table_files import columns_csv

FORMULAS = ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(1)", "＝1+1", "＠SUM(1)"]
HARMLESS = ["1", "-1", "+2.5e3", "a=b", "", "'tis", "40CrNiMoA"]


@pytest.mark.parametrize("text", FORMULAS)
def test_no_formula_begins_a_cell_and_every_text_comes_back(text: str):
    guarded = f"'{text}"
    table = columns_csv({"label": np.array([text, "a"], object), text: np.ones(2)})
    header, first, _ = csv.reader(io.StringIO(table, newline=""))
    assert (header[1], first[0]) == (guarded, guarded)
    assert all(without_formula(h) == with_formula(h) == h for h in HARMLESS)
    for written in (text, f"'{text}", f"''{text}"):
        assert with_formula(without_formula(written)) == written


def test_labels_that_were_written_are_read_as_they_were(tmp_path):
    labels = [*FORMULAS, *(f"'{text}" for text in FORMULAS), "-1", "a"]
    number = np.arange(float(len(labels)))
    columns = {"deformation_mm": number, "force_N": number}
    table = columns_csv(columns | {"run": np.array(labels, object)})
    (tmp_path / "data.csv").write_text(table, "utf-8")
    assert read_measurements(tmp_path / "data.csv").runs[1] == tuple(labels)
