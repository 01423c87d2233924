"""How far an effect's own form could have closed a gap whose truth is now known."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from hdcal.blind.files import GET_AGAIN, refusal
from hdcal.blind.label import CaseAnswer, Label
from hdcal.blind.rival_methods import own_form_closure
from hdcal.blind.sealed_set import CASES, GEAR, MATERIAL, SEALED, BlindSet
from hdcal.data.reading import read_case
from hdcal.physics.registry import EFFECTS

# Of smaller gaps the share that closes is hardly to be told.
_SMALLEST = 0.5


def closures(
    found: BlindSet, labels: Sequence[Label], answers: Iterable[CaseAnswer]
) -> dict[str, float]:
    """Return the largest share of the gap that the true effect's own form can close.

    Data come from other physics than the library's: even the right name does not
    close all of it. Only cases whose effect was answered rightly are looked at.

    Args:
        found: the set.
        labels: the truth.
        answers: in the order of the labels.

    Raises:
        InputError: a label says nothing of its readings.
    """
    result = {}
    for label, answer in zip(labels, answers, strict=True):
        if label.kind != "effect" or label.r < _SMALLEST or answer.closed is None:
            continue
        if (answer.effect,) != label.truth or answer.effect not in EFFECTS:
            continue
        table = found.folder / CASES / f"{label.case}.csv"
        own = None if found.manifest.not_bound else found.folder / MATERIAL
        case = read_case(table, found.folder / GEAR, material=own)
        if len(label.clean) != len(case.records.force) or not label.sigma:
            words = f"holds a label of '{label.case}' that does not fit its readings"
            raise refusal(found.folder / SEALED, words, GET_AGAIN)
        clean = replace(case.records, force=np.asarray(label.clean))
        closed = own_form_closure(
            replace(case, records=clean), answer.effect, EFFECTS, label.sigma
        )
        if closed is not None:
            result[label.case] = closed
    return result
