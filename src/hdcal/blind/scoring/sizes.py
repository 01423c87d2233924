"""How near estimated sizes come: of amplitudes, of gaps and of what is closed."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from hdcal.blind.label import Quantiles
from hdcal.blind.scoring.estimates import Estimate, median, share
from hdcal.blind.scoring.scored_case import Cases


@dataclass(frozen=True)
class Sizes:
    """Median relative error, and how often the 95 % interval holds the truth."""

    error: Estimate
    held: Estimate


def amplitude_sizes(cases: Cases) -> Sizes:
    """Compare amplitudes, wherever truth and answer speak of the same parameter."""
    return _compare(
        (true, case.answer.amplitude[name])
        for case in cases
        for name, true in case.label.amplitude.items()
        if name in case.answer.amplitude
    )


def gap_sizes(cases: Cases) -> Sizes:
    """Compare the size of the gap with the root mean square of what was put in."""
    return _compare(
        (_rms(case.label.curve), case.answer.gap)
        for case in cases
        if case.label.curve and case.answer.gap is not None
    )


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(math.fsum(v * v for v in values) / len(values))


def _compare(rows: Iterable[tuple[float, Quantiles]]) -> Sizes:
    # An unfinished answer holds None or NaN, and of nothing there is no relative error.
    kept = [
        (true, span)
        for true, span in rows
        if true and all(v is not None and math.isfinite(v) for v in span)
    ]
    return Sizes(
        median([abs(span[0] - true) / abs(true) for true, span in kept]),
        share(span[1] <= true <= span[2] for true, span in kept),
    )


def closed_errors(cases: Cases, closures: Mapping[str, float]) -> Estimate:
    """Return the median error of the closed share where the true effect is named."""
    return median(
        [
            abs(case.answer.closed[0] - closures[case.label.case])
            for case in cases
            if case.plain_effect
            and case.answer.effect == case.label.truth[0]
            and case.answer.closed is not None
            and case.answer.closed[0] is not None
            and math.isfinite(case.answer.closed[0])
            and case.label.case in closures
        ]
    )
