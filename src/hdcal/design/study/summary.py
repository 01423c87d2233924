"""A study as an answer and as a report."""

from hdcal.design.study.answer import StudyAnswer
from hdcal.design.study.document import (
    study_document,
    study_headline,
    study_words,
)
from hdcal.design.study.study import Study
from hdcal.design.summary import in_words, origin
from hdcal.report.write import Report


def study_answer(found: Study) -> StudyAnswer:
    """Return a study as an answer, ready for JSON, its table by column."""
    told = StudyAnswer(
        **origin(found.basis, found.interval, found.interval_kind),
        varied=found.varied,
        columns={n: tuple(column.tolist()) for n, column in found.columns.items()},
        assumptions=found.assumptions,
        warnings=found.warnings,
    )
    return in_words(told, study_headline(told), study_words(told))


def study_report(found: Study, command: str = "") -> Report[StudyAnswer]:
    """Return all that `hdcal study` leaves behind."""

    def figures():
        from hdcal.design.study.figure import study_figure

        return {"study": study_figure(found)}

    def charts():
        from hdcal.design.study.chart import study_chart

        # Two sizes make a map, and one picture holds every design.
        mapped = len({*found.varied} - {"material"}) > 1
        return {} if mapped else {"study": [study_chart(found)]}

    answer = study_answer(found)
    return Report(
        study_document(answer, command),
        answer,
        "study.json",
        figures,
        tables=lambda: {"study.csv": found.columns},
        charts=charts,
    )
