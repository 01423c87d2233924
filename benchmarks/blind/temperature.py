"""The temperature of the decision, compared on an opened learning round.

Log evidences of hypotheses are divided by it. All hypotheses of each case are
evaluated once, and decided at each temperature: answers at one do not tell those at
another, since several hypotheses may be one explanation.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

import hdcal
from benchmarks.blind.answers import OPENED, completed
from benchmarks.blind.calibration import calibration_error
from benchmarks.blind.diagnosers import Library, answer_of
from benchmarks.blind.estimates import RESAMPLES, SEED, Estimate
from benchmarks.blind.label import Answer
from benchmarks.blind.opening import shown
from benchmarks.blind.scored_case import STATED, ScoredCase
from benchmarks.blind.scores import class_statements, log_score, right
from benchmarks.blind.sealed_set import read_key, read_set, refusal
from hdcal.diagnosis.decision import decide
from hdcal.evidence.search import search

TEMPERATURES = 1.15 ** np.arange(-2.0, 11.0)


def at_each(case: hdcal.Case, library: Library) -> list[Answer]:
    """Answer a case at each temperature."""
    searched = search(case, library)
    return [
        answer_of(case.name, decide(searched, temperature=value), library)
        for value in TEMPERATURES
    ]


def best_temperature(log_scores: Float[np.ndarray, "t n"]) -> Estimate:
    """Return the temperature with the best mean log score, with its interval.

    Args:
        log_scores: at each of `TEMPERATURES` of each case.
    """
    n = log_scores.shape[1]
    if not n:
        return Estimate(None, None, None, 0)
    rng = np.random.default_rng(SEED)
    counts = rng.multinomial(n, np.full(n, 1.0 / n), size=RESAMPLES)
    drawn = TEMPERATURES[np.argmax(log_scores @ counts.T, axis=0)]
    low, high = np.quantile(drawn, [0.025, 0.975])
    best = TEMPERATURES[np.argmax(log_scores.sum(axis=1))]
    return Estimate(float(best), float(low), float(high), n)


def compare_temperatures(folder: Path, key: Path, jobs: int) -> str:
    """Return the scores of an opened set at each temperature, and the best one.

    Raises:
        InputError: the set was not opened, or anything is missing or was changed.
    """
    found = read_set(folder)
    if not (folder / OPENED).exists():
        raise refusal(folder, "is still sealed", "Answer and open it first")
    labels = read_key(found, key).labels
    tasks = found.manifest.cases
    answers = {each[0].case: each for each in completed(found, tasks, at_each, jobs)}
    lines = ["| temperature | log score | calibration error | stated, right | stated |"]
    lines.append("|---" * 5 + "|")
    scores: list[list[float]] = []
    for index, value in enumerate(TEMPERATURES):
        cases = [ScoredCase(label, answers[label.case][index]) for label in labels]
        scores.append([c.log_score for c in cases if c.truth is not None])
        cells = [
            f"{value:.2f}",
            shown(log_score(cases), "nat")[0],
            shown(calibration_error(class_statements(cases)))[0],
            shown(right(cases, STATED))[0],
            f"{right(cases, STATED).n}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    number, span = shown(best_temperature(np.array(scores)), "factor")
    return "\n".join([*lines, "", f"best log score: temperature {number} ({span})"])
