"""Several models of the same data as one posterior, and back."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

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
        tree=_tree(names, posteriors, rows, effects),
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
    sizes, labels = posterior.tree["posterior"].sizes, _hypotheses(posterior)
    if labels is None:
        return np.zeros(sizes["chain"] * sizes["draw"], int)
    return np.tile(np.unique(labels, return_inverse=True)[1], sizes["chain"])


def _hypotheses(posterior: Posterior) -> np.ndarray | None:
    """Return the hypothesis of each draw of a chain; None of one model."""
    draws = posterior.tree["posterior"].to_dataset()
    if HYPOTHESIS not in draws.coords:
        return None
    return np.asarray(draws[HYPOTHESIS].to_numpy(), str)


def _alone(posterior: Posterior, name: str, rows: np.ndarray) -> Posterior:
    """Return one model of a mixture, of these draws of each chain."""
    own = parts_of(name)
    effects = tuple(e for e in posterior.effects if e.name in own)
    sites = posterior.sites(posterior.case, effects, UNKNOWN in own)
    tree = posterior.tree.copy()
    for group in _OF_DRAWS:
        if group in tree.children:
            kept = (
                tree[group]
                .to_dataset()
                .isel(draw=rows)
                .drop_vars(HYPOTHESIS, errors="ignore")
            )
            if group == "posterior":
                kept = kept[[n for n in kept.data_vars if n in sites]]
            tree[group] = xr.DataTree(kept)
    origin = posterior.settings[ORIGIN]
    assert isinstance(origin, dict)
    known = {"with_gap": UNKNOWN in own, "draws": len(rows)}
    return replace(
        posterior,
        effects=effects,
        tree=tree,
        diagnoses={n: d for n, d in posterior.diagnoses.items() if n in sites},
        settings={
            **posterior.settings,
            **known,
            ORIGIN: {**origin, "hypothesis": name},
        },
    )


def _rows(shares: Sequence[float], posteriors: Sequence[Posterior]) -> list[np.ndarray]:
    """Return which draws of each chain every model gives, evenly along it."""
    held = [one.tree["posterior"].sizes["draw"] for one in posteriors]
    count = min(held)
    ends = np.round(np.cumsum(shares) / sum(shares) * count).astype(int)
    given = np.maximum(np.diff(ends, prepend=0), 1)
    return [
        np.linspace(0, size - 1, each).round().astype(int)
        for size, each in zip(held, given, strict=True)
    ]


def _tree(names, posteriors: Sequence[Posterior], rows, effects) -> xr.DataTree:
    tree = posteriors[0].tree.copy()
    labels = np.repeat(names, list(map(len, rows)))
    for group in _OF_DRAWS:
        tables = [
            one.tree[group].to_dataset().isel(draw=kept)
            for one, kept in zip(posteriors, rows, strict=True)
            if group in one.tree.children
        ]
        if len(tables) < len(posteriors):
            continue
        if group == "posterior":
            tables = [_completed(table, posteriors, effects) for table in tables]
        common = set.intersection(*({*table.data_vars} for table in tables))
        joined = xr.concat([t[sorted(map(str, common))] for t in tables], "draw")
        joined = joined.assign_coords(draw=np.arange(len(labels)))
        if group == "posterior":
            joined = joined.assign_coords({HYPOTHESIS: ("draw", labels.astype(object))})
        tree[group] = xr.DataTree(joined)
    priors = [one.tree["prior"].to_dataset() for one in posteriors]
    least = min(table.sizes["draw"] for table in priors)
    tables = [table.isel(draw=slice(least)) for table in reversed(priors)]
    tree["prior"] = xr.DataTree(xr.merge(tables, compat="override", join="override"))
    return tree


def _completed(
    table: xr.Dataset, posteriors: Sequence[Posterior], effects
) -> xr.Dataset:
    """Return draws of a model with the sites that only others have."""
    nulls = dict(null_sites(effects)) | dict.fromkeys((*GAP, CORRELATION), 0.0)
    for one in posteriors:
        held = one.tree["posterior"].to_dataset()
        shapes = one.tree["prior"].to_dataset()
        for site in {*map(str, held.data_vars)} - {*map(str, table.data_vars)}:
            size = (table.sizes["chain"], table.sizes["draw"], *held[site].shape[2:])
            # What has no prior to draw from is fixed.
            source = shapes if site in shapes else held
            filled = np.full(size, nulls[site]) if site in nulls else None
            if filled is None:
                filled = np.resize(source[site].to_numpy(), size)
            table = table.assign({site: (held[site].dims, filled)})
    return table


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
