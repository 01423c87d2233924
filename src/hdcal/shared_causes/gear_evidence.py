"""What the readings of one gear alone say of each cause."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdcal.data.case import Case
from hdcal.data.records import Records
from hdcal.data.scatter import require_scatter
from hdcal.diagnosis.model_posterior import log_priors
from hdcal.diagnosis.repeats import without_repeats
from hdcal.diagnosis.weighing import weigh
from hdcal.errors import Finding, Findings, quoted
from hdcal.evidence.case_evidence import UNKNOWN
from hdcal.evidence.row_features import take_rows
from hdcal.physics.effect import Effect

# Two effects at once, whichever.
SEVERAL = "several"
# Fewer rows tell a bend from a loop by luck only.
FEWEST_ROWS = 6

Weight = Mapping[str, tuple[float, float]]


def gears_of(case: Case) -> list[Case]:
    """Return each gear's rows as a case of its own, whose mountings have one zero."""
    return [_one_gear(case, gear) for gear in range(len(case.specimen_labels))]


def saying_little(case: Case) -> dict[str, Finding]:
    """Return gears whose readings tell no cause, each with why."""
    bad = {}
    for label, gear in zip(case.specimen_labels, gears_of(case), strict=True):
        wrong, rows = Findings(), len(gear.records.force)
        if rows < FEWEST_ROWS:
            words = f"has {rows} row{'s' * (rows > 1)}, too few for a cause"
            remedy = f"Read it {FEWEST_ROWS} times or more, or leave it out"
            wrong.append(Finding(gear.name, words, remedy))
        else:
            wrong.attempt(require_scatter, gear)
        bad |= {label: wrong[0]} if wrong else {}
    return bad


def _one_gear(case: Case, gear: int) -> Case:
    """Return the rows of one gear, all of its mountings at one zero.

    By how much mountings differ is told of the fleet. Of one gear with two of them it
    would be evidence of something unknown, a little in each gear and much in all.
    """
    records = take_rows(case.records, np.flatnonzero(case.records.specimen == gear))
    kept, run = np.unique(records.run, return_inverse=True)
    label = case.specimen_labels[gear]
    return replace(
        case,
        name=f"{case.name}, gear {quoted(label)}",
        records=replace(
            records,
            force=_at_one_zero(records, run),
            run=run,
            specimen=np.zeros(len(run), int),
            known=records.known - {"run", "runs", "specimen", "specimens"},
        ),
        run_labels=tuple(case.run_labels[one] for one in kept),
        specimen_labels=(label,),
        lots=(),
        operators=(),
        dates=(),
    )


def _at_one_zero(records: Records, run: np.ndarray) -> np.ndarray:
    """Return forces as if all mountings had one zero, beside a line of the gear."""
    x, y = np.asarray(records.deformation), np.asarray(records.force)
    rows = np.bincount(run)
    mean_x, mean_y = (np.bincount(run, values) / rows for values in (x, y))
    about_x = x - mean_x[run]
    slope = np.sum(about_x * y) / np.sum(about_x**2)
    zero = mean_y - slope * mean_x
    return y - (zero - np.average(zero, weights=rows))[run]


def weigh_gear(place: int, gear: Case, library: Mapping, seed: int):
    """Return the place of a gear and, of each cause, its probability after and before.

    Args:
        place: of the gear among all.
        gear: its rows.
        library: effects to consider, by name.
        seed: of the draws of shares.
    """
    return place, _weight(gear, library, seed)


def _weight(gear: Case, library: Mapping[str, type[Effect]], seed: int) -> Weight:
    weighed = weigh(without_repeats(gear)[0], library, np.random.default_rng(seed))
    names = list(weighed.evidence.table)
    prior = np.exp(log_priors(names, weighed.evidence.on_noise))
    found: dict[str, tuple[float, float]] = {}
    for name, before in zip(names, prior.tolist(), strict=True):
        cause = _cause(name)
        so_far = found.get(cause, (0.0, 0.0))
        after = weighed.posterior.probabilities[name]
        found[cause] = so_far[0] + after, so_far[1] + before
    return found


def _cause(hypothesis: str) -> str:
    """Return the cause that a hypothesis tells; what lies beside one is not asked."""
    parts = [part for part in hypothesis.split("+") if part != UNKNOWN]
    if not parts:
        return UNKNOWN
    return parts[0] if len(parts) == 1 else SEVERAL
