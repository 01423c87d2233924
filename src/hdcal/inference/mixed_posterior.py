"""Several models of the same data as one posterior, and back."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from hdcal.inference import laplace
from hdcal.inference.array_tree import (
    CHAIN,
    DRAW,
    OVER_DRAWS,
    ArrayTree,
    Group,
    Named,
)
from hdcal.inference.checks import Check
from hdcal.inference.diagnostics import Diagnosis
from hdcal.inference.hypotheses import (
    GAP,
    HYPOTHESIS,
    ORIGIN,
    UNKNOWN,
    null_sites,
    parts_of,
)
from hdcal.inference.posterior import Posterior
from hdcal.inference.serial_correlation import CORRELATION

_OF_DRAWS = ("posterior", "sample_stats", "log_likelihood")
_Weighed = Mapping[str, tuple[float, Posterior]]


def mixed_posterior(models: _Weighed) -> Posterior:
    """Return several models as one posterior, each draw with its hypothesis.

    Every model has as many of the draws as it is probable, at least one in each chain.
    An effect that a draw's hypothesis lacks is at its null value there, and its shape
    as in its prior: the draws are those of one model with all of the effects.

    Args:
        models: probability and posterior by hypothesis, of the same data; the
            probabilities sum to 1.

    Returns:
        The posterior; of one model that itself.
    """
    names = sorted(models, key=lambda name: -models[name][0])
    likeliest = models[names[0]][1]
    if len(names) == 1:
        return likeliest
    posteriors = [models[name][1] for name in names]
    found = {e.name: e for one in posteriors for e in one.effects}
    effects = tuple(found[name] for name in sorted(found))
    rows = _rows([models[name][0] for name in names], posteriors)
    gap = any(one.settings["with_gap"] for one in posteriors)
    sizes = {"draws": sum(map(len, rows)), "with_gap": gap}
    chances = {name: models[name][0] for name in names}
    origin = {"hypothesis": None, "probabilities": chances}
    sites = likeliest.sites(likeliest.case, effects, gap)
    return replace(
        likeliest,
        effects=effects,
        priors={n: p for one in reversed(posteriors) for n, p in one.priors.items()},
        arrays=_arrays(names, posteriors, rows, effects),
        diagnoses={
            name: found
            for name, found in _diagnoses(posteriors).items()
            if name in sites
        },
        checks=tuple(_checks(names, posteriors)),
        settings={**likeliest.settings, **sizes, ORIGIN: origin},
    )


def models_of(posterior: Posterior) -> list[tuple[float, Posterior]]:
    """Return the models of a mixture with their probabilities; of one model that."""
    labels = _hypotheses(posterior)
    if labels is None:
        return [(1.0, posterior)]
    origin = posterior.settings[ORIGIN]
    assert isinstance(origin, dict)
    return [
        (share, _alone(posterior, name, np.flatnonzero(labels == name)))
        for name, share in origin["probabilities"].items()
    ]


def causes_of_draws(posterior: Posterior) -> np.ndarray:
    """Return the number of the cause behind each draw, shape (draw,); 0 of one model.

    Draws are in the order of `Posterior.draws`, chain after chain.
    """
    (chains, draws), labels = posterior.size, _hypotheses(posterior)
    if labels is None:
        return np.zeros(chains * draws, int)
    return np.tile(np.unique(labels, return_inverse=True)[1], chains)


def _hypotheses(posterior: Posterior) -> np.ndarray | None:
    """Return the hypothesis of each draw of a chain; None of one model."""
    found = posterior.arrays.groups["posterior"].get(HYPOTHESIS)
    return None if found is None else np.asarray(found.values, str)


def _alone(posterior: Posterior, name: str, rows: np.ndarray) -> Posterior:
    """Return one model of a mixture, of these draws of each chain."""
    own = parts_of(name)
    effects = tuple(e for e in posterior.effects if e.name in own)
    sites = posterior.sites(posterior.case, effects, UNKNOWN in own)
    groups = {**posterior.arrays.groups}
    for group in groups.keys() & _OF_DRAWS:
        groups[group] = _taken(groups[group], rows)
    drawn = groups["posterior"]
    own_sites = [one for name, one in drawn.items() if name in sites]
    kept = {*sites, *(axis for one in own_sites for axis in one.axes)}
    groups["posterior"] = {name: one for name, one in drawn.items() if name in kept}
    origin = posterior.settings[ORIGIN]
    assert isinstance(origin, dict)
    known = {"with_gap": UNKNOWN in own, "draws": len(rows)}
    return replace(
        posterior,
        effects=effects,
        arrays=ArrayTree(groups),
        diagnoses={n: d for n, d in posterior.diagnoses.items() if n in sites},
        settings={
            **posterior.settings,
            **known,
            ORIGIN: {**origin, "hypothesis": name},
        },
    )


def _rows(shares: Sequence[float], posteriors: Sequence[Posterior]) -> list[np.ndarray]:
    """Return which draws of each chain every model gives, evenly along it."""
    held = [one.size[1] for one in posteriors]
    count = min(held)
    ends = np.round(np.cumsum(shares) / sum(shares) * count).astype(int)
    given = np.maximum(np.diff(ends, prepend=0), 1)
    return [
        np.linspace(0, size - 1, each).round().astype(int)
        for size, each in zip(held, given, strict=True)
    ]


def _arrays(names, posteriors: Sequence[Posterior], rows, effects) -> ArrayTree:
    groups = {**posteriors[0].arrays.groups}
    groups.pop(laplace.GROUP, None)
    labels = np.repeat(names, list(map(len, rows)))
    for group in groups.keys() & _OF_DRAWS:
        tables = [
            _taken(one.arrays.groups[group], kept)
            for one, kept in zip(posteriors, rows, strict=True)
            if group in one.arrays.groups
        ]
        if len(tables) < len(posteriors):
            continue
        if group == "posterior":
            tables = [_completed(table, posteriors, effects) for table in tables]
        groups[group] = _end_to_end(tables)
    groups["posterior"] = {
        **groups["posterior"],
        HYPOTHESIS: Named((DRAW,), labels.astype(object)),
    }
    priors = [one.arrays.groups["prior"] for one in posteriors]
    least = np.arange(min(len(table[DRAW].values) for table in priors))
    shortest = [_taken(table, least) for table in priors]
    groups["prior"] = {n: one for table in shortest for n, one in table.items()}
    return ArrayTree(groups)


def _taken(group: Group, rows: np.ndarray) -> dict[str, Named]:
    """Return a group with these draws of each chain only."""
    return {name: one.taken(DRAW, rows) for name, one in group.items()}


def _end_to_end(tables: Sequence[Group]) -> dict[str, Named]:
    """Return groups as one, the draws of the next after those of the last."""
    found = {}
    for name in sorted(set.intersection(*({*table} for table in tables))):
        first = tables[0][name]
        if DRAW in first.axes:
            each = [table[name].values for table in tables]
            whole = np.concatenate(each, first.axes.index(DRAW))
            first = first._replace(values=whole)
        found[name] = first
    found[DRAW] = Named((DRAW,), np.arange(len(found[DRAW].values)))
    return found


def _completed(table: Group, posteriors: Sequence[Posterior], effects) -> Group:
    """Return draws of a model with the sites that only others have."""
    nulls = dict(null_sites(effects)) | dict.fromkeys((*GAP, CORRELATION), 0.0)
    found = {**table}
    size = len(table[CHAIN].values), len(table[DRAW].values)
    for one in posteriors:
        held, shapes = (one.arrays.groups[name] for name in ("posterior", "prior"))
        for name in held.keys() - found.keys():
            if held[name].axes[:2] != OVER_DRAWS:
                found[name] = held[name]
                continue
            # What has no prior to draw from is fixed.
            source = shapes if name in shapes else held
            whole = (*size, *held[name].values.shape[2:])
            filled = np.full(whole, nulls[name]) if name in nulls else None
            if filled is None:
                filled = np.resize(source[name].values, whole)
            found[name] = held[name]._replace(values=filled)
    return found


def _diagnoses(posteriors: Sequence[Posterior]) -> dict[str, Diagnosis]:
    """Return for each parameter the worst of the models' diagnoses."""
    each: dict[str, list[Diagnosis]] = {}
    for one in posteriors:
        for name, diagnosis in one.diagnoses.items():
            each.setdefault(name, []).append(diagnosis)
    return {
        name: replace(
            max(of_name, key=lambda found: found.rhat),
            ess_bulk=float(np.fmin.reduce([found.ess_bulk for found in of_name])),
            ess_tail=float(np.fmin.reduce([found.ess_tail for found in of_name])),
        )
        for name, of_name in each.items()
    }


def _checks(names, posteriors: Sequence[Posterior]) -> Iterator[Check]:
    for name, one in zip(names, posteriors, strict=True):
        for check in one.checks:
            yield replace(check, words=f"{name}: {check.words}")
