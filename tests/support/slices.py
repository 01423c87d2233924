"""Which parameters `make test` looks at; `make thorough` looks at the others."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def slice_of(values: Iterable[Any], quick: Collection[Any]) -> list[Any]:
    """Return all values as parameters, those that are not quick marked thorough."""
    thorough = pytest.mark.thorough
    return [v if v in quick else pytest.param(v, marks=thorough) for v in values]
