"""By how much each parameter, run, specimen and discrepancy moves the mean reading."""

from collections.abc import Mapping
from dataclasses import dataclass

import jax
import numpy as np

from hdcal.data.gear_file.certificates import GAUGE_UNITS
from hdcal.data.records import Records
from hdcal.exported import jit
from hdcal.inference.discrepancy import Discrepancy, discrepancy_columns
from hdcal.inference.padding import pad_records
from hdcal.inference.problem import Problem
from hdcal.inference.values import predict_rows

# Parameters of the mean that are compared; sigma is not one of them, nor is any
# parameter of an effect on the noise.
_MEAN = ("K", "E0", "alpha", "force_offset", "deformation_offset", *GAUGE_UNITS)
_MOST_MEMBERS = 200


@dataclass(frozen=True)
class Linearisation:
    """The mean reading near one set of parameters, row by row.

    Attributes:
        sd: of the noise, rounding included [N], shape (n,).
        slopes: derivatives by parameter [N per unit of the parameter], shape (n,).
        members: contribution of each run, specimen and weight of the discrepancy per
            prior sd of its own [N], shape (n, m). Members by the hundred are left
            out: one by one none of them matters.
        place: where the members stand, in prior sds, shape (m,).
    """

    sd: np.ndarray
    slopes: dict[str, np.ndarray]
    members: np.ndarray
    place: np.ndarray


def linearise(
    problem: Problem, values: Mapping[str, np.ndarray], records: Records
) -> Linearisation:
    """Linearise the mean reading of the measured rows.

    Args:
        problem: structure.
        values: one set of parameters, in code units.
        records: the rows, not padded.
    """
    rows, padded = len(records.force), pad_records(records)
    columns = discrepancy_columns(problem.discrepancy, padded)
    sd, slopes, stiffening = jax.tree.map(
        lambda part: np.asarray(part)[:rows],
        _derivatives(
            problem,
            values,
            padded,
            columns,
            names=_free_parameters(problem, values),
        ),
    )
    columns = None if columns is None else columns[:rows]
    members, place = _members(problem, values, records, columns, stiffening)
    sd = np.sqrt(sd**2 + problem.step**2 / 12.0)
    return Linearisation(sd, slopes, members, place)


def _free_parameters(problem: Problem, values) -> tuple[str, ...]:
    """Return the parameters of the mean that are not fixed."""
    of_mean = {effect.name for effect in problem.effects if effect.stage != "noise"}
    sizes = [name for name in values if name.partition(".")[0] in of_mean]
    return tuple(
        name
        for name in (*_MEAN, *sizes)
        if name in values and problem.priors[name].family != "fixed"
    )


@jit(static_argnames=("names",))
def _derivatives(problem: Problem, values, records: Records, columns, *, names):
    """Return noise sd and derivatives of the mean: by name, by relative stiffness."""

    def mean(part):
        mean, noise = predict_rows(problem, {**values, **part}, records, columns)
        return mean, noise.sd[0]

    def stiffer(share):
        return mean({"K": values["K"] * (1.0 + share)})[0]

    slopes, sd = jax.jacfwd(mean, has_aux=True)({name: values[name] for name in names})
    return sd, slopes, jax.jvp(stiffer, (0.0,), (1.0,))[1]


def _members(problem: Problem, values, records: Records, columns, stiffening):
    """Return columns and places of runs, specimens and discrepancy."""
    table, place = [np.zeros((len(records.force), 0))], [np.zeros(0)]
    if 0 < problem.runs <= _MOST_MEMBERS:
        sd = values["run_offset_sd"]
        # Deviations from the mean of the tested ones, which is the zero itself.
        own = records.run[:, None] == np.arange(problem.runs)
        table.append(sd * (own - 1.0 / problem.runs))
        place.append(values["run_offset"] / sd)
    if 0 < problem.specimens <= _MOST_MEMBERS:
        sd = values["specimen_sd"]
        own = records.specimen[:, None] == np.arange(problem.specimens)
        table.append(sd * stiffening[:, None] * own)
        place.append(values["specimen_deviation"] / sd)
    if columns is not None:
        own = problem.discrepancy, values["gap_sd"], values["gap_length"]
        scale = np.asarray(_prior_sd(*own))
        table.append(columns * scale)
        place.append(values["gap_weights"] / scale)
    return np.concatenate(table, axis=1), np.concatenate(place)


@jit
def _prior_sd(discrepancy: Discrepancy, sd, length):
    return discrepancy.prior_sd(sd, length)
