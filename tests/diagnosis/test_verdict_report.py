"""The report of a diagnosis says what its numbers mean, and why one is missing."""

from dataclasses import replace

from verdicts import KINDS, named

from hdcal.diagnosis.document import verdict_document
from hdcal.diagnosis.overview import overview_document, verdicts_answer
from hdcal.diagnosis.summary import verdict_answer
from hdcal.diagnosis.verdict import Verdict
from hdcal.report.document import Table
from hdcal.report.html import html_page


def page(verdict: Verdict) -> str:
    """Return the text of the report, its figures empty."""
    images = {name: b"" for name in ("where", "which", "shrink")}
    return html_page(verdict_document(verdict_answer(verdict), verdict.case), images)


def test_where_nothing_is_suspected_no_run_is_proposed():
    verdict = replace(KINDS["none"](), next_test=named().next_test)
    found = verdict_answer(verdict)
    assert found.next_step is None


def test_outside_the_library_the_next_step_is_a_gap():
    found = verdict_answer(replace(KINDS["unknown"](), next_test=()))
    assert found.next_step
    assert verdict_answer(replace(named(), next_test=())).next_step is None


def test_what_stands_in_backticks_is_code_and_nothing_else_is():
    words = page(replace(named(), next_test=(), no_run="see `a <b>` and <i>"))
    assert "see <code>a &lt;b&gt;</code> and &lt;i&gt;." in words


def test_what_is_not_seen_has_a_dash_for_its_size():
    document = overview_document(
        verdicts_answer({"a": verdict_answer(KINDS["none"]())})
    )
    (table,) = document.sections[0].blocks
    assert isinstance(table, Table)
    assert [row[table.columns.index("gap")] for row in table.rows] == ["–"]
