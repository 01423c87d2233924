"""Polynomials as they are written."""

from collections.abc import Sequence


def model_name(powers: Sequence[int]) -> str:
    """Return a polynomial as it is written: c + a ω + b ω² + d ω³ …."""
    terms = ["c", "a ω", *(f"{'bdefghij'[p - 2]} {omega(p)}" for p in range(2, 10))]
    return " + ".join(terms[power] for power in powers)


def omega(power: int) -> str:
    """Return a power of the deformation as it is written: ω²."""
    return "ω" if power == 1 else f"ω{'⁰¹²³⁴⁵⁶⁷⁸⁹'[power]}"
