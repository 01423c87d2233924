"""Evidence of every pair of hypotheses, each kind by its own road."""

from dataclasses import replace
from itertools import combinations

import numpy as np

from hdcal.evidence.assessment import (
    QUANTISATION,
    Assessment,
    curve_of,
    pair_name,
)
from hdcal.evidence.closed_form import block_evidence
from hdcal.evidence.inner_products import block_statistics
from hdcal.evidence.line_pairs import assess_couples
from hdcal.evidence.noise_evidence import assess_noise
from hdcal.evidence.single_evidence import Singles, assess_singles
from hdcal.evidence.subspaces import mean_evidence
from hdcal.evidence.whitened_rows import Rows

# Correlations of less posterior weight than this take no part in pairs.
_LEAST_WEIGHT = 0.02
# Effects beside which the shape of the noise is looked at anew.
_BESIDE = 2


def assess_pairs(found: Assessment, shaped, gain: float | None) -> dict:
    """Return the log evidence of every pair, [correlation]."""
    sigma = found.setting.priors["sigma"]
    table, lines = found.table, found.lines
    pairs = _line_pairs(found)
    for name in found.wide:
        beside = _with_subspace(found, name)
        variant = assess_singles(beside, lines, sigma, tolerant=False)
        both = _beside_subspace(found, beside, variant, name)
        pairs |= {n: table[name] + gained for n, gained in both.items()}
        for other in found.singles.names:
            gained = variant.by_correlation(other) - variant.none
            pairs[pair_name(name, other)] = table[name] + gained
    mean = [*found.singles.names, *found.wide]
    pairs |= _noise_pairs(found, shaped, mean)
    if QUANTISATION in table:
        others = [*mean, *found.noise]
        pairs |= {pair_name(QUANTISATION, n): table[n] + gain for n in others}
    return pairs


def _noise_pairs(found: Assessment, shaped, mean: list[str]) -> dict:
    """Return pairs of an effect on the noise with any other.

    Noise takes up what structure the mean has left, so that its evidence is found
    anew beside each of the likeliest effects; beside others the least of these counts.
    """
    table = found.table
    whole = {name: np.logaddexp.reduce(table[name]) for name in mean}
    best = sorted(mean, key=lambda name: -whole[name])[:_BESIDE]
    pairs = {}
    for noisy in found.noise:
        factor = {
            name: assess_noise(
                shaped[noisy], found.setting, curve_of(found, name)
            ).log_factor
            for name in best
        }
        least = min([found.noise[noisy].log_factor, *factor.values()])
        for name in mean:
            gain = factor.get(name, least)
            pairs[pair_name(noisy, name)] = table[name] + gain
    for one, two in combinations(found.noise, 2):
        least = min(found.noise[n].log_factor for n in (one, two))
        better = np.maximum(table[one], table[two])
        # They compete for the same rows: no more than the better one of them.
        pairs[pair_name(one, two)] = better + min(least, 0.0)
    return pairs


def _line_pairs(found: Assessment) -> dict:
    alone = np.stack([v for n, v in found.table.items()])
    weight = np.exp(np.max(alone, axis=0) - np.max(alone))
    weight = weight / weight.sum()
    pairs: dict[str, np.ndarray] = {}
    for index, share in enumerate(weight):
        if share < _LEAST_WEIGHT or len(found.lines) < 2:
            continue
        both = assess_couples(
            found.setting.rows,
            found.singles,
            found.lines,
            found.setting.priors["sigma"],
            index,
        )
        for (one, other), value in both.items():
            name = pair_name(one, other)
            pairs.setdefault(name, np.full(len(weight), -np.inf))[index] = value
    return pairs


def _beside_subspace(
    found: Assessment, beside: Rows, variant: Singles, name: str
) -> dict:
    """Return what subspaces after this one gain beside it, by name of the pair."""
    later = [other for other in found.wide if other > name]
    if not later:
        return {}
    spaces = found.subspaces
    own = np.concatenate([spaces.of(other) for other in later])
    sigma = found.setting.priors["sigma"]
    evidence = block_evidence(
        variant.ground,
        block_statistics(beside, spaces.columns[own]),
        spaces.scale[own],
        spaces.log_weight[own],
        sigma,
    )
    label = np.asarray(spaces.names)[own]
    return {
        pair_name(name, other): mean_evidence(np.asarray(evidence)[:, label == other])
        - variant.none
        for other in later
    }


def _with_subspace(found: Assessment, name: str) -> Rows:
    """Return rows whose base also absorbs an effect at its most probable scale."""
    spaces, rows = found.subspaces, found.setting.rows
    shape, scale = spaces.likeliest(name)
    columns = scale * spaces.columns[spaces.of(name)[shape]].T
    noise = np.full(columns.shape[1], found.setting.noise_sd**2)
    return replace(
        rows,
        base=np.concatenate([rows.base, columns], axis=1),
        precision=np.concatenate([rows.precision, noise]),
    )
