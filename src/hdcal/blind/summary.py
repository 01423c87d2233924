"""The scores of a blind check, and all that its result folder holds."""

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
from hdcal.blind.scoring.scores import Scores
from hdcal.report.plain import as_json
from hdcal.report.write import Report


def scores_report(
    scores: Scores,
    labels: Sequence[Label] = (),
    answers: Mapping[str, Sequence[CaseAnswer]] | None = None,
    others: Mapping[str, Any] | None = None,
) -> Report[Scores]:
    """Return all that `hdcal blind open` leaves behind.

    Args:
        scores: of the answers.
        labels: the truth, where what was said of measured data is to be shown.
        answers: by diagnoser, in the order of the labels.
        others: content of other JSON files, by name.
    """

    def figures():
        return {
            "bar": bar_figure(scores.bar),
            "confusion": confusion_figure(scores.confusion),
            "reliability": reliability_figure(scores.reliability),
            "detection": detection_figure(scores.detection),
        }

    document = scores_document(scores, labels, answers)
    texts = [(name, as_json(content)) for name, content in (others or {}).items()]
    return Report(
        document,
        scores,
        "scores.json",
        figures,
        others=lambda: [(name, text.encode()) for name, text in texts],
    )
