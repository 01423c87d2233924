"""What the scores of a blind check leave behind: numbers, pictures and the report."""

from collections.abc import Mapping, Sequence
from typing import Any

from hdcal.blind.document import scores_document
from hdcal.blind.figure import (
    bar_figure,
    confusion_figure,
    detection_figure,
    reliability_figure,
)
from hdcal.blind.label import CaseAnswer, Label
from hdcal.report.plain import as_json, as_plain
from hdcal.report.write import report_files


def score_files(
    found: Mapping[str, Any],
    labels: Sequence[Label] = (),
    answers: Mapping[str, Sequence[CaseAnswer]] | None = None,
) -> dict[str, bytes]:
    """Return scores.json, the pictures and report.html by the names of the files.

    Args:
        found: from `hdcal.blind.scoring.scores.score`.
        labels: the truth, where what was said of measured data is to be shown.
        answers: by diagnoser, in the order of the labels.
    """
    plain = as_plain(found)
    figures = {
        "bar": bar_figure(plain["bar"]),
        "confusion": confusion_figure(plain["confusion"]),
        "reliability": reliability_figure(plain["reliability"]),
        "detection": detection_figure(plain["detection"]),
    }
    files = report_files(scores_document(plain, labels, answers), figures)
    return {"scores.json": as_json(plain).encode("utf-8"), **files}
