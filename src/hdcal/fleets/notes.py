"""What the reader of a fleet must know: on what it rests, and what it leaves out."""

from collections.abc import Iterator, Sequence

import numpy as np

from hdcal.data.gear_file.certificates import GAINS
from hdcal.data.measurements.bad_gears import left_out_words
from hdcal.data.tables.cells import NOT_STATED
from hdcal.data.theory_names import SPRING
from hdcal.fleets.fleet import Fleet
from hdcal.fleets.fleet_problem import population_priors
from hdcal.fleets.groupings import group_offsets
from hdcal.fleets.groups import linked_rigs
from hdcal.fleets.misfit import misfit_words
from hdcal.report.intervals import credible_interval
from hdcal.report.words import estimate

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
    "of {load}s is of a gear of the gear file's sizes."
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
CERTIFICATES = (
    "What the gauges' certificates leave open is in none of these numbers: it is the "
    "same for all gears. `calibrate` and `margin` of one gear count it."
)
# Fewer gears than the first, and fewer groups than the second, say little of scatter.
FEW, _FEW_GROUPS = 8, 5
# Sds of what is believed beyond which a stiffness is not believed.
_FAR = 3.0


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
    beside = [*_far_from_theory(found), *misfit_words(found.misfit)]
    beside += _between_rigs(found)
    certified = [CERTIFICATES] if {*GAINS} & found.case.gear.priors.keys() else []
    untold = [*_untold(found)]
    why = found.case.left_out
    left_out = [left_out_words(why, len(why) + len(found.off))] if why else []
    of_data = [*left_out, *beside, *found.case.notes]
    of_model = [RESTS_ON, *sized, *few, *scarce, *untold, *once, *certified]
    return [*of_data, *of_model]


def _far_from_theory(found: Fleet) -> Iterator[str]:
    """Yield that gears are far stiffer or softer than the gear file lets expect."""
    expected = population_priors(found.case)[1]["stiffness"]
    if found.case.gear.theory == SPRING:
        return
    middle, log_sd = expected.numbers
    ratio = float(np.median(found.draws["stiffness"])) / middle
    if abs(np.log(ratio)) > _FAR * log_sd:
        times, way = (ratio, "stiffer") if ratio > 1.0 else (1.0 / ratio, "softer")
        yield (
            f"These gears are {times:.2g} times {way} than their theory lets expect of "
            f"their sizes ({middle:.3g} {{N/mm}}): are units, sizes and the way the "
            "deformation is read right?"
        )


def _between_rigs(found: Fleet) -> Iterator[str]:
    """Yield how far apart rigs surely read, and that nobody knows which is right."""
    if not found.rigs:
        return
    gains = 100.0 * np.asarray(group_offsets(found.draws, "rig"))
    named = [rig for rig, name in enumerate(found.rigs) if name != NOT_STATED]
    order = sorted(named, key=lambda rig: np.median(gains[rig]))
    low, high = order[0], order[-1]
    linked = linked_rigs(found.readings.sums)
    apart = credible_interval(gains[high] - gains[low])
    if linked[low] != linked[high] or not apart.lo > 0.0:
        return
    middle, span = estimate(apart)
    yield (
        f"Rig {found.rigs[high]} reads {middle} % ({span} %) more {{load}} of the same "
        f"gear than rig {found.rigs[low]}. Stiffness is told as they read it in the "
        "mean: which of them is right these readings do not tell; a gear of known "
        "stiffness, read on each, would."
    )


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
