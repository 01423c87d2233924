"""A verdict without a single number is still written, and says that it failed."""

import json
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from schema_checks import obeys
from slices import slice_of
from verdicts import KINDS

from hdcal.data.case import Case
from hdcal.diagnosis.answer import VerdictAnswer
from hdcal.diagnosis.document import verdict_document
from hdcal.diagnosis.overview import overview_document, verdicts_answer
from hdcal.diagnosis.summary import write_verdict
from hdcal.diagnosis.verdict import Verdict
from hdcal.report.terminal import terminal_lines


def hollow(value):
    """Return a value with NaN instead of every number in it."""
    if isinstance(value, float | np.ndarray):
        return value * np.nan
    if isinstance(value, dict):
        return {key: hollow(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return tuple(map(hollow, value))
    if is_dataclass(value) and not isinstance(value, Case):
        parts = {f.name: hollow(getattr(value, f.name)) for f in fields(value)}
        return replace(value, **parts)
    return value


@pytest.mark.parametrize("kind", slice_of(KINDS, ["failed"]))
def test_without_numbers_everything_is_written(kind: str, tmp_path: Path):
    verdict = hollow(KINDS[kind]())
    assert isinstance(verdict, Verdict)
    assert np.isnan(verdict.where.cells[0].bias_N.median)
    found = write_verdict(replace(verdict, reasons=("not finite",)), tmp_path)
    obeys(json.loads((tmp_path / "verdict.json").read_text()), VerdictAnswer)
    assert all(path.stat().st_size > 100 for path in tmp_path.iterdir())
    assert list(terminal_lines(verdict_document(found), "there"))
    many = overview_document(verdicts_answer({kind: found}))
    assert list(terminal_lines(many, "there"))


@pytest.mark.usefixtures("undrawn")
def test_without_cells_or_rungs_everything_is_written(tmp_path: Path):
    verdict = KINDS["none"]()
    where = replace(verdict.where, cells=())
    shrink = replace(verdict.shrink, ladder=())
    write_verdict(replace(verdict, where=where, shrink=shrink), tmp_path)
    assert (tmp_path / "report.html").stat().st_size > 100
