"""What the readings of one gear alone say of each cause."""

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from hdcal.data.case import Case
from hdcal.data.records import Records
from hdcal.data.scatter import require_scatter
from hdcal.diagnosis.model_posterior import carried, log_priors
from hdcal.diagnosis.weighing import weigh
from hdcal.errors import Finding, Findings, quoted
from hdcal.evidence.case_evidence import UNKNOWN, CaseEvidence
from hdcal.evidence.row_features import take_rows

# No draws say less of whether an effect carries the gap.
_LEAST_CHANCE = 1e-3
# Fewer rows than a line with a zero for each mounting leaves tell noise, or causes, by
# luck only.
_FEWEST_LEFT = 8


class Weight(NamedTuple):
    """What the readings of a gear say of a cause.

    Attributes:
        log_evidence: up to a constant of the gear [nat].
        log_prior: log of its probability before them.
    """

    log_evidence: float
    log_prior: float


def gears_of(case: Case, seed: int = 0) -> list[Case]:
    """Return each gear's rows as a case of its own, whose mountings have one zero.

    Args:
        case: readings of all of them.
        seed: of the error that these zeros have.
    """
    gears = range(len(case.specimen_labels))
    return [_one_gear(case, one, np.random.default_rng([seed, one])) for one in gears]


def saying_little(gears: Sequence[Case]) -> dict[str, Finding]:
    """Return those of the gears whose readings tell no cause, each with why."""
    bad = {}
    for gear in gears:
        wrong, rows, runs = Findings(), len(gear.records.force), len(gear.run_labels)
        needed = _FEWEST_LEFT + 1 + runs
        if rows < needed:
            words = (
                f"has {rows} rows in {runs} run{'s' * (runs > 1)}, too few for a cause"
            )
            remedy = f"Read it {needed} times or more, or leave it out"
            wrong.append(Finding(gear.name, words, remedy))
        else:
            wrong.attempt(require_scatter, gear)
        bad |= {gear.specimen_labels[0]: wrong[0]} if wrong else {}
    return bad


def _one_gear(case: Case, gear: int, rng: np.random.Generator) -> Case:
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
            force=_at_one_zero(records, run, rng),
            run=run,
            specimen=np.zeros(len(run), int),
            known=records.known - {"run", "runs", "specimen", "specimens"},
        ),
        run_labels=tuple(case.run_labels[one] for one in kept),
        specimen_labels=(label,),
        lots=(),
        operators=(),
        rigs=(),
        dates=(),
    )


def _at_one_zero(
    records: Records, run: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Return forces as if all mountings had one zero, beside a line of the gear.

    What is left about a fitted zero is tied together, as if it were less: each mounting
    gets another zero of as much error as the fitted one has, so that noise that is
    independent stays so.
    """
    x, y = np.asarray(records.deformation), np.asarray(records.force)
    rows = np.bincount(run)
    mean_x, mean_y = (np.bincount(run, values) / rows for values in (x, y))
    about_x, about_y = x - mean_x[run], y - mean_y[run]
    slope = np.sum(about_x * about_y) / np.sum(about_x**2)
    free = max(len(y) - len(rows) - 1, 1)
    noise_sd = np.sqrt(np.sum((about_y - slope * about_x) ** 2) / free)
    zero = mean_y - slope * mean_x
    zero -= noise_sd / np.sqrt(rows) * rng.standard_normal(len(rows))
    return y - (zero - np.average(zero, weights=rows))[run]


# As in a diagnosis threads would only wait for each other.
@threadpool_limits.wrap(limits=1, user_api="blas")
def weigh_gear(place: int, gear: Case, library: Mapping, seed: int):
    """Return the place of a gear, and what its readings say of each cause.

    Args:
        place: of the gear among all.
        gear: its rows.
        library: effects to consider, by name.
        seed: of the draws of shares.
    """
    rng = np.random.default_rng(seed)
    evidence = weigh(gear, library, rng).evidence
    return place, _by_cause(evidence)


def _by_cause(evidence: CaseEvidence) -> dict[str, Weight]:
    names = list(evidence.table)
    prior = log_priors(names, evidence.on_noise)
    carries = carried(evidence)
    parts: dict[str, list[tuple[float, float]]] = {}
    for name, before in zip(names, prior.tolist(), strict=True):
        leading = _leading(name, evidence.on_noise, carries)
        of_readings = float(np.logaddexp.reduce(evidence.table[name]))
        for cause, share in leading.items():
            each = before - np.log(len(leading)), of_readings + np.log(share)
            parts.setdefault(cause, []).append(each)
    return {cause: _mixed(np.array(each)) for cause, each in parts.items()}


def _mixed(parts: np.ndarray) -> Weight:
    """Return the evidence of hypotheses of log priors and log evidences, (h, 2)."""
    joint, prior = np.logaddexp.reduce(np.stack([parts.sum(axis=1), parts[:, 0]]), 1)
    return Weight(float(joint - prior), float(prior))


def _leading(
    hypothesis: str, on_noise: Container[str], carries: Mapping[str, float]
) -> dict[str, float]:
    """Return the causes that may lead, and how much more the readings speak for each.

    Before them all are as probable. What acts beside one is not asked: of two effects
    either leads, and which one it is the other gears tell; an effect beside something
    unknown leads where it carries the gap. What shapes the noise leads where nothing
    moves the mean.
    """
    parts = hypothesis.split("+")
    parts = [part for part in parts if part not in on_noise] or parts
    if len(parts) == 1 or UNKNOWN not in parts:
        return dict.fromkeys(parts, 1.0)
    effect = next(part for part in parts if part != UNKNOWN)
    chance = np.clip(carries[effect], _LEAST_CHANCE, 1.0 - _LEAST_CHANCE)
    return {effect: 2.0 * float(chance), UNKNOWN: 2.0 * float(1.0 - chance)}
