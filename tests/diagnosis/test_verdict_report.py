"""The report of a diagnosis says what its numbers mean, and why one is missing."""

from dataclasses import replace

from verdicts import KINDS, named

from hdcal.diagnosis.answer import Refit
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


def test_k_is_said_with_its_formula():
    assert "K by the ring formula, at the prior&#39;s mean modulus, is 1.87" in page(
        named()
    )


def test_k_is_said_with_what_it_is_fitted_beside():
    words = page(named())
    assert "It is fitted beside hysteresis; a calibration with other effects" in words
    nothing = page(KINDS["none"]())
    assert "It is fitted beside no effect" in nothing
    found = verdict_answer(named())
    several = [Refit("hysteresis", 0.8), Refit("none", 0.2)]
    images = {name: b"" for name in ("where", "which", "shrink")}
    for refits, whose in (
        (several, "the average over the 2 models under “The corrected model”"),
        (several[:1], "that of the model with hysteresis; a calibration with other"),
    ):
        shown = verdict_document(replace(found, refits=tuple(refits)), named().case)
        assert f"It is {whose}" in html_page(shown, images)


def test_where_nothing_is_suspected_no_run_is_proposed():
    verdict = replace(KINDS["none"](), next_test=named().next_test)
    found = verdict_answer(verdict)
    assert found.next_step is None
    assert not any("Next run" in words for words in found.answer)
    words = page(verdict)
    assert "None is proposed: no gap is seen." in words
    assert "What to do next" not in words and "tells apart" not in words


def test_outside_the_library_the_next_step_is_a_gap():
    found = verdict_answer(replace(KINDS["unknown"](), next_test=()))
    assert found.next_step is not None
    assert found.next_step.startswith("Calibrate with a gap")
    assert verdict_answer(replace(named(), next_test=())).next_step is None


def test_what_stands_in_backticks_is_code_and_nothing_else_is():
    words = page(replace(named(), next_test=(), no_run="see `a <b>` and <i>"))
    assert "see <code>a &lt;b&gt;</code> and &lt;i&gt;." in words


def test_an_effect_alone_is_told_from_one_with_its_pairs():
    words = page(named())
    assert "An effect stands here alone; the answer&#39;s percentage counts" in words


def test_without_a_run_the_true_reason_stands():
    words = page(replace(named(), next_test=(), no_run="fewer than two are left"))
    assert "No run is proposed: fewer than two are left." in words
    assert "predicts nothing and is left out" not in words
    assert "predicts nothing and is left out" in page(named())


def test_what_is_not_seen_has_a_dash_for_its_size():
    words = page(KINDS["none"]())
    assert "0 … 0 N" not in words and "of full scale" not in words
    assert "of what is not seen there is no size" in words
    document = overview_document(
        verdicts_answer({"a": verdict_answer(KINDS["none"]())})
    )
    (table,) = document.sections[0].blocks
    assert isinstance(table, Table)
    assert [row[table.columns.index("gap")] for row in table.rows] == ["–"]


def test_rounding_is_told_apart_from_the_gate():
    gap = replace(named().gap, rounding_N=2.0)
    words = page(replace(named(), gap=gap))
    assert "in steps of 2 N; nothing else is seen" in words


def test_the_noise_of_means_is_called_so():
    assert "standard deviation of a mean of 3 readings" in page(
        replace(named(), averaged_rows=3)
    )


def test_the_likeliest_pair_is_told_as_a_pair():
    verdict = KINDS["ambiguous"]()
    chances = {
        "progressive_stiffening+seating_slack": 0.7,
        "outliers+progressive_stiffening+seating_slack": 0.1,
        "unknown": 0.2,
    }
    which = replace(
        verdict.which,
        second_effect="seating_slack",
        set=("progressive_stiffening", "seating_slack", "unknown"),
        probabilities=chances,
        inclusion={"progressive_stiffening": 0.8, "seating_slack": 0.8},
    )
    told = " ".join(verdict_answer(replace(verdict, which=which)).answer)
    assert "progressive stiffening and seating slack together (80 %)." in told
    assert "Or it may be something outside the library (20 %)." in told
    assert "Adding progressive stiffening and seating slack removes" in told
