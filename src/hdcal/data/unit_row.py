"""Units that stand below the headers, or elsewhere beside them."""

from collections.abc import Iterable, Iterator

from hdcal.data.header_words import guess_header
from hdcal.data.table_start import unit_in
from hdcal.data.units import known_unit
from hdcal.errors import quoted


def with_unit(header: str, unit: str) -> str:
    """Return a header with its unit, where it names none itself."""
    guess = guess_header(header)
    named = guess is not None and bool(guess.unit)
    return f"{header} [{unit_in(unit)}]" if unit and not named else header


def other_units(
    headers: Iterable[str], units: Iterable[str], row: int
) -> Iterator[tuple[int, str, str]]:
    """Yield what is wrong where a header and the row of units name two units."""
    for header, unit in zip(headers, units, strict=False):
        guess = guess_header(header)
        if guess is None or not guess.unit or not unit:
            continue
        if known_unit(guess.quantity, unit_in(unit)) != guess.unit:
            words = f"{quoted(header)} names {guess.unit}, and the row of units {unit}"
            yield row, words, "Leave one of them out"
