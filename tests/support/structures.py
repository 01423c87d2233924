"""Structures of models that tests ask for, whatever the readings show."""

from dataclasses import replace

from hdcal.data.case import Case
from hdcal.inference.force_model.structure import (
    NONE_SHOWN,
    ModelStructure,
    decide_structure,
)


def form_of(case: Case, effects=(), with_gap: bool = False) -> ModelStructure:
    """Return a structure with correlated noise wherever its likelihood is known."""
    found = decide_structure(case, effects, with_gap)
    if found.why_independent != NONE_SHOWN:
        return found
    return replace(found, correlated=True, why_independent="")
