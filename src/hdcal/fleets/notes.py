"""What the reader of a fleet must know: on what it rests, and what it leaves out."""

from collections.abc import Iterator, Sequence

import numpy as np

from hdcal.data.bad_gears import left_out_words
from hdcal.data.cells import NOT_STATED
from hdcal.data.theory_names import SPRING
from hdcal.fleets.fleet import Fleet
from hdcal.fleets.groups import linked_rigs
from hdcal.fleets.misfit import misfit_words

RESTS_ON = (
    "Of each mounting a straight line is taken, with a zero of its own and noise that "
    "is independent from reading to reading: what bends it, a loop or a drift, is not "
    "modelled here. To see it diagnose one by itself, with `--specimen LABEL`."
)
ONE_MOUNTING = (
    "Every gear was mounted once: how much mountings scatter is told by the zeros "
    "alone, and what a mounting does to the slope counts as of the gear."
)

OF_SIZES = (
    "Gears are of several sizes: what is told of the population, of gears to come and "
    "of forces is of a gear of the gear file's sizes."
)
ONE_SIZE = (
    "All gears are taken to be of the gear file's sizes: what sizes differ in counts "
    "as scatter, and may hide one that is off. `--gears TABLE` states those of each."
)
FEW_GEARS = (
    "So few gears say little of how much ordinary ones scatter: only a gear very far "
    "out can be called off. Ten tell clearly more."
)
RIGS_APART = (
    "Not all rigs are linked by gears that several of them read: how far their gains "
    "lie apart is told by assuming that the gears of each are alike in the mean. A few "
    "gears that are read on every rig would tell it."
)
# Fewer gears than the first, and fewer groups than the second, say little of scatter.
FEW, _FEW_GROUPS = 8, 5


def notes_of(found: Fleet) -> Sequence[str]:
    """Return what the reader of a fleet must know."""
    scarce = [
        f"{len(names)} {kind} say little of how much {kind} scatter: its interval is "
        "mostly what was believed before."
        for kind, _, names in _kinds(found)
        if 0 < len(names) < _FEW_GROUPS
    ]
    once = [ONE_MOUNTING] if found.mountings.max() == 1 else []
    sized = [OF_SIZES] if found.at_one_size else [ONE_SIZE]
    sized = sized if found.case.gear.theory != SPRING else []
    few = [FEW_GEARS] if len(found.off) < FEW else []
    beside = misfit_words(found.misfit)
    untold = [*_untold(found)]
    why = found.case.left_out
    left_out = [left_out_words(why, len(why) + len(found.off))] if why else []
    of_data = [*left_out, *beside, *found.case.notes]
    return [*of_data, RESTS_ON, *sized, *few, *scarce, *untold, *once]


def _untold(found: Fleet) -> Iterator[str]:
    """Yield which lots, operators and rigs were read but not told apart, or hardly."""
    for kind, read, used in _kinds(found):
        if len(set(read)) > 1 and not used:
            yield (
                f"{len(set(read))} {kind} are too many to be told apart: they are "
                "taken for one."
            )
        if NOT_STATED in used:
            yield f"What names none of the {kind} is taken to be of one more."
    if found.rigs and len(np.unique(linked_rigs(found.readings.sums))) > 1:
        yield RIGS_APART


def _kinds(found: Fleet) -> Iterator[tuple[str, Sequence[str], Sequence[str]]]:
    """Yield kinds of groups, the labels that were read, and the names told apart."""
    case = found.case
    yield "lots", case.lots, found.lots
    yield "operators", case.operators, found.operators
    yield "rigs", case.rigs, found.rigs
