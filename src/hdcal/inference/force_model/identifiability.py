"""Sensitivities of the readings, and parameters that only the prior determines."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import jax
import numpy as np
from scipy.sparse.csgraph import connected_components

from hdcal.data.gear_file.certificates import GAUGE_UNITS
from hdcal.data.prior import Prior
from hdcal.data.records import Records
from hdcal.inference.checks import Check, listed
from hdcal.inference.distributions import moments
from hdcal.inference.force_model.discrepancy import discrepancy_columns
from hdcal.inference.force_model.padding import pad_records
from hdcal.inference.force_model.problem import Problem
from hdcal.inference.force_model.values import (
    MEMBER_SD,
    MEMBERS,
    predict_rows,
    rounding_variance,
)

# Parameters of the mean besides those of effects; sigma is not one of them.
_MEAN = ("K", "E0", "alpha", "force_offset", "deformation_offset", *GAUGE_UNITS)
# A parameter that moves the mean by fewer noise sds over its whole prior has no effect.
_NO_EFFECT = 1e-3
# Smallest share of a parameter in a flat direction that is named.
_SHARE = 0.3


@dataclass(frozen=True)
class Linearisation:
    """The mean reading near one set of parameters, row by row."""

    # Of the noise, rounding included [N], (n,).
    sd: np.ndarray
    # Derivatives by parameter [N per unit of the parameter], (n,) each.
    slopes: dict[str, np.ndarray]
    # Of runs, specimens and weights of the discrepancy: the contribution of each per
    # prior sd [N], (n, m), and its value in prior sds, (m,).
    members: np.ndarray
    scores: np.ndarray

    def sensitivities(self) -> dict[str, np.ndarray]:
        """Return the slopes in noise sds, less what the members can explain.

        The squared length of each is the information on its parameter with the members
        integrated out, their unit priors included.
        """
        members = self.members / self.sd[:, None]
        columns = (np.reshape([*self.slopes.values()], (-1, len(self.sd))) / self.sd).T
        products = np.eye(members.shape[1]) + members.T @ members
        taken = np.linalg.solve(products, members.T @ columns)
        rest = np.concatenate([columns - members @ taken, -taken])
        return dict(zip(self.slopes, rest.T, strict=True))


def linearise(
    problem: Problem, values: Mapping[str, np.ndarray], records: Records
) -> Linearisation:
    """Linearise the mean reading of rows, not padded, near one set of parameters."""
    rows, padded = len(records.force), pad_records(records)
    columns = discrepancy_columns(problem.discrepancy, padded)
    of_mean = {effect.name for effect in problem.effects if effect.stage != "noise"}
    names = tuple(
        name
        for name in (*_MEAN, *(n for n in values if n.partition(".")[0] in of_mean))
        if name in values and problem.priors[name].family != "fixed"
    )
    kinds = [kind for kind, site in MEMBERS.items() if site in values]
    names += tuple(MEMBERS[kind] for kind in kinds)
    parts = _derivatives(problem, values, padded, columns, names=names)
    sd, slopes = jax.tree.map(lambda part: np.asarray(part)[:rows], parts)
    members, scores = [np.zeros((rows, 0))], [np.zeros(0)]
    for kind in kinds:
        site = MEMBERS[kind]
        if kind == "discrepancy" and problem.discrepancy is not None:
            sizes = values["gap_sd"], values["gap_length"]
            scale = np.asarray(problem.discrepancy.prior_sd(*sizes))
            root = np.diag(scale)
        else:
            # Members are deviations from the mean of the tested ones.
            scale, count = values[MEMBER_SD[kind]], len(values[site])
            root = scale * (np.eye(count) - 1.0 / count)
        members.append(slopes.pop(site) @ root)
        scores.append(values[site] / scale)
    sd = np.sqrt(sd**2 + rounding_variance(problem.step))
    return Linearisation(sd, slopes, np.hstack(members), np.concatenate(scores))


@jax.jit(static_argnames=("names",))
def _derivatives(problem: Problem, values, records: Records, columns, *, names):
    """Return noise sd and derivatives of the mean reading by name."""

    def mean(part):
        mean, noise = predict_rows(problem, {**values, **part}, records, columns)
        return mean, noise.sd[0]

    slopes, sd = jax.jacfwd(mean, has_aux=True)({name: values[name] for name in names})
    return sd, slopes


def identification_checks(
    sensitivities: Mapping[str, np.ndarray], priors: Mapping[str, Prior]
) -> tuple[Check, ...]:
    """Report parameters, and combinations of them, that only the priors determine.

    A direction v is flat where the data have less information than the priors:
    ‖J v‖² < ‖v/S‖² with J the sensitivities in noise sds and S the prior sds.
    """
    # In units of its prior sd every parameter has prior precision one.
    scaled = {n: s * moments(priors[n], n)[1] for n, s in sensitivities.items()}
    length = {name: float(np.linalg.norm(column)) for name, column in scaled.items()}
    changes = "every parameter changes the readings"
    apart = "parameters are distinguishable"
    notes = [
        Check(changes, "note", f"{n}: does not change these readings, prior-dominated")
        for n in scaled
        if length[n] < _NO_EFFECT
    ] or [Check(changes, "passed", "each one changes the predicted readings")]
    flat = [
        f"{name} hardly changes the readings: prior-dominated"
        for name in scaled
        if _NO_EFFECT <= length[name] < 1.0
    ]
    for names in _inseparable({n: c for n, c in scaled.items() if length[n] >= 1.0}):
        words = "in combination, not each of them"
        if {*names} == {"K", "E0"}:
            words = "as the product K·E0; K follows from it with the prior of E0"
        flat.append(f"{listed(names)} are determined by these data only {words}")
    none = Check(apart, "passed", "the data determine each of them")
    return *notes, *([Check(apart, "note", words) for words in flat] or [none])


def _inseparable(columns: Mapping[str, np.ndarray]) -> list[list[str]]:
    """Return groups of parameters that the readings cannot distinguish.

    Pairs that have a flat direction come first, linked where they share a parameter;
    then the flat directions beyond these, by the parameters with a share in them.
    """
    names = [name for name in {**dict.fromkeys(_MEAN), **columns} if name in columns]
    if len(names) < 2:
        return []
    # As few numbers as have the same inner products.
    table = np.stack([columns[name] for name in names], axis=1)
    few: np.ndarray = np.asarray(np.linalg.qr(table, mode="r"))
    linked = np.zeros((len(names), len(names)))
    for pair in combinations(range(len(names)), 2):
        linked[pair] = np.linalg.svd(few[:, [*pair]], compute_uv=False)[-1] < 1.0
    count, label = connected_components(linked, directed=False)
    groups = (
        [n for n, g in zip(names, label, strict=True) if g == i] for i in range(count)
    )
    found = [group for group in groups if len(group) > 1]
    # A row for each column, also with fewer readings than columns.
    padded = np.vstack([few, np.zeros((len(names), len(names)))])
    _, singular_values, vectors = np.linalg.svd(padded, full_matrices=False)
    named = sum(len(group) - 1 for group in found)
    further = max(int(np.sum(singular_values < 1.0)) - named, 0)
    for vector in vectors[::-1][:further]:
        share = np.abs(vector) / np.abs(vector).max()
        large = [n for n, part in zip(names, share, strict=True) if part >= _SHARE]
        if len(large) > 2 and large not in found:
            found.append(large)
    return found
