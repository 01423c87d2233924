"""What the scores of a blind check leave behind: numbers, pictures and the report."""

from collections.abc import Mapping, Sequence
from pathlib import Path
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
from hdcal.report.write import Report, write_report


def write_result(
    target: Path | str,
    scores: Scores,
    labels: Sequence[Label] = (),
    answers: Mapping[str, Sequence[CaseAnswer]] | None = None,
    others: Mapping[str, Any] | None = None,
) -> None:
    """Write scores.json, the pictures and report.html; an older result is replaced.

    Args:
        target: the folder to make.
        scores: of the answers.
        labels: the truth, where what was said of measured data is to be shown.
        answers: by diagnoser, in the order of the labels.
        others: content of other JSON files, by name.

    Raises:
        InputError: as `write_report`.
    """

    def figures():
        return {
            "bar": bar_figure(scores.bar),
            "confusion": confusion_figure(scores.confusion),
            "reliability": reliability_figure(scores.reliability),
            "detection": detection_figure(scores.detection),
        }

    def save(folder: Path) -> None:
        for name, content in (others or {}).items():
            (folder / name).write_text(as_json(content), "utf-8")

    document = scores_document(scores, labels, answers)
    report = Report(document, scores, "scores.json", figures, save=save)
    write_report(report, target, force=True)
