"""Where a gap lies, in words: above 0.4 mm, on unloading, after 300 s."""

from collections.abc import Iterator, Sequence

from hdcal.diagnosis.answer import WhereAnswer
from hdcal.diagnosis.gap import Cell
from hdcal.quantities import Quantities
from hdcal.report.words import known, with_unit

_PREPOSITIONS = {
    "direction": "on {}",
    "run": "in {}",
    "specimen": "on {}",
}
_SIDES = {"time": ("after", "before")}


def places(where: WhereAnswer, units: Quantities) -> Iterator[tuple[str, float]]:
    """Yield the two worst places in words, each with the bias there [N]."""
    plain = [cell for cell in where.regions if "×" not in cell.covariate]
    worst: dict[str, Cell] = {}
    for cell in plain or where.regions:
        worst.setdefault(cell.covariate, cell)
    for covariate, cell in list(worst.items())[:2]:
        if not (known(cell.from_) and known(cell.to)) or "×" in covariate:
            words = _PREPOSITIONS.get(covariate, "for {}").format(cell.label)
            yield words, cell.bias_N.median
            continue
        joined = _stretch(cell, where.regions)
        biases = [other.bias_N.median for other in joined]
        yield _range(covariate, joined, where, units), max(biases, key=abs)


def _range(
    covariate: str, joined: list[Cell], where: WhereAnswer, units: Quantities
) -> str:
    low, high = min(c.from_ for c in joined), max(c.to for c in joined)
    cells = [c for c in where.cells if c.covariate == covariate]
    starts = [c.from_ for c in cells if known(c.from_)]
    stops = [c.to for c in cells if known(c.to)]
    unit = joined[0].unit
    above, below = _SIDES.get(covariate, ("above", "below"))
    if low == high:
        return f"at {with_unit(_round(low), unit)}"
    if low <= min(starts) and high >= max(stops):
        return f"at every {units.name(covariate)}"
    if high >= max(stops):
        return f"{above} {with_unit(_round(low), unit)}"
    if low <= min(starts):
        return f"{below} {with_unit(_round(high), unit)}"
    return f"from {_round(low)} to {with_unit(_round(high), unit)}"


def _round(value: float) -> str:
    return f"{value:.3g}" if abs(value) < 1000.0 else f"{value:.0f}"


def _stretch(cell: Cell, regions: Sequence[Cell]) -> list[Cell]:
    """Return a region with those of its sign that join on to it."""
    joined, sign = [cell], cell.bias_N.median > 0.0
    waiting = [
        other
        for other in regions
        if other.covariate == cell.covariate
        and known(other.from_)
        and known(other.to)
        and (other.bias_N.median > 0.0) == sign
    ]
    slack = 1e-6 * (abs(cell.from_) + abs(cell.to))
    for part in joined:  # grows while it is walked along
        touching = [
            other
            for other in waiting
            if other not in joined
            and other.from_ <= part.to + slack
            and other.to >= part.from_ - slack
        ]
        joined += touching
    return joined
