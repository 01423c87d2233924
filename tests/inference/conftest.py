"""Records on which every effect can be seen."""

from effect_records import (  # noqa: F401
    base,
    gear,
    loading,
    reading,
    scattered,
)
