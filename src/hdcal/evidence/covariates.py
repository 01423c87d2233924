"""Covariates of ordered rows: what effects need, and smooth functions of them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from hdcal.data.records import Records
from hdcal.evidence.row_features import half_cycles, place_in_run, scale_to_unit
from hdcal.physics.effect import Effect

# What must be measured for a need of an effect. The other needs (unloading,
# cycles, …) are features of the loading: without them an effect has a prediction, but
# may look like another one.
_COLUMNS = {
    "temperature": "temperature",
    "time": "time",
    "rates": "time",
    "holds or rates": "time",
    "angle": "angle",
    "runs": "run",
    "specimens": "specimen",
    "bare_rig": "bare_rig",
}
# AR(1) coefficients of the noise that are always integrated over.
_CORRELATIONS = (0.0, 0.2, 0.4, 0.6)
# Noise may be correlated over a fifth of a half cycle, at most by 0.98; larger
# coefficients are added where they reach this far at least.
_SPANS, _LARGEST, _WORTHWHILE = 5.0, 0.98, 0.75


@dataclass(frozen=True)
class Predicting:
    """Effects of a library by what the rows tell about them.

    Attributes:
        effects: those that predict something for these rows, by name.
        lacking: columns that each of the others needs and that were not measured.
    """

    effects: dict[str, type[Effect]]
    lacking: dict[str, list[str]]


def predicting(library: Mapping[str, type[Effect]], records: Records) -> Predicting:
    """Sort the effects of a library by what these rows tell about them."""
    needed = {name: effect.needs - records.known for name, effect in library.items()}
    columns = {
        name: sorted({_COLUMNS[need] for need in needs if need in _COLUMNS})
        for name, needs in needed.items()
    }
    lacking = {
        name: missing
        for name, found in columns.items()
        if (missing := [column for column in found if column not in records.known])
    }
    effects = {n: effect for n, effect in library.items() if n not in lacking}
    return Predicting(effects, lacking)


def half_cycle_rows(records: Records) -> float:
    """Return the median number of rows of a half cycle."""
    return float(np.median(np.bincount(half_cycles(records))))


def noise_correlations(records: Records) -> Float[np.ndarray, " r"]:
    """Return the AR(1) coefficients of the noise that are integrated over.

    Where half cycles have many rows two larger coefficients are added, up to the one
    whose correlation lasts for a fifth of a half cycle.
    """
    longest = min(np.exp(-_SPANS / half_cycle_rows(records)), _LARGEST)
    if longest < _WORTHWHILE:
        return np.array(_CORRELATIONS)
    middle = np.exp(-np.sqrt(np.log(_CORRELATIONS[-1]) * np.log(longest)))
    return np.array([*_CORRELATIONS, middle, longest])


def cosines(x: Float[np.ndarray, " n"], count: int) -> Float[np.ndarray, "k n"]:
    """Return cosines of 1, 2, … half waves over a covariate from −1 to 1."""
    return np.cos(np.pi * np.arange(1, count + 1)[:, None] * (x + 1.0) / 2.0)


def tolerance_functions(records: Records) -> Float[np.ndarray, "j n"]:
    """Return smooth functions by which the shape of an effect may deviate.

    Their mean squares sum to one, so that a coefficient's prior sd is the relative sd
    of the shape at a typical row.
    """
    table = np.concatenate(
        [
            cosines(scale_to_unit(records.deformation), 3),
            cosines(place_in_run(records.run), 2),
            np.asarray(records.sense, float)[None],
            scale_to_unit(records.temperature)[None],
            scale_to_unit(np.abs(records.rate))[None],
        ]
    )
    return table / np.sqrt(np.sum(np.mean(table**2, axis=1)))
