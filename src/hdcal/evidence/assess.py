"""All hypotheses of one case side by side: none, effects, pairs, unknown."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdcal.data.case import Case
from hdcal.data.priors import Prior
from hdcal.evidence.assessment import (
    LEAST_SEEN,
    NONE,
    QUANTISATION,
    UNKNOWN,
    Assessment,
)
from hdcal.evidence.closed_form import plain_evidence
from hdcal.evidence.effect_lines import draw_lines
from hdcal.evidence.inner_products import ground, line_statistics
from hdcal.evidence.kernels import kernels as kernels_of
from hdcal.evidence.kernels import visible_kernels
from hdcal.evidence.local_scan import likeliest
from hdcal.evidence.noise_evidence import assess_noise, lattice_evidence
from hdcal.evidence.pair_evidence import assess_pairs
from hdcal.evidence.prepare import Setting, lay_out, reweighted
from hdcal.evidence.single_evidence import Singles, assess_singles
from hdcal.evidence.subspaces import (
    WIDTH,
    assess_subspaces,
    effect_columns,
    effect_scales,
    is_subspace,
    large,
    unknown_scales,
)
from hdcal.evidence.whitened_rows import Rows, beside_line
from hdcal.inference.problem import problem_priors
from hdcal.physics.effect import Effect
from hdcal.physics.scatter import Scatter

# Kernels that share the prior of the unknown; a program that shows fewer leaves the
# rest of that prior unused, for what it cannot see.
_KERNELS = 15
# A kernel of which one library effect spans this much would steal its name.
_STOLEN = 0.9


def assess(
    case: Case,
    library: Mapping[str, type[Effect]],
    shipped: Mapping[str, Prior],
    *,
    noise_sd: float | None = None,
    stiffness: float | None = None,
) -> Assessment:
    """Compute the evidence of every hypothesis.

    Args:
        case: gear and records.
        library: effects to consider.
        shipped: priors of every effect in the library.
        noise_sd: of a reading [N]; by default a pilot estimate.
        stiffness: about which effects act [N/mm]; by default from least squares.

    Raises:
        InputError: an effect has no prior.
    """
    # Raises where a prior is missing.
    problem_priors(case, tuple(library.values()), shipped, case.gear.theory)
    setting = lay_out(case, shipped, noise_sd, stiffness)
    known = case.records.known
    not_testable = {
        name: tuple(sorted(effect.needs - known))
        for name, effect in library.items()
        if effect.needs - known
    }
    testable = {n: e for n, e in library.items() if n not in not_testable}
    accounted = (QUANTISATION,) if case.gear.force_resolution > 0.0 else ()
    testable = {n: e for n, e in testable.items() if n not in accounted}
    mean = {n: e for n, e in testable.items() if e.stage != "noise"}
    wide = {n: e for n, e in mean.items() if is_subspace(e, setting)}
    lines = tuple(draw_lines(e, setting) for n, e in mean.items() if n not in wide)
    columns = {n: effect_columns(e, setting) for n, e in wide.items()}
    seen = {each.name: _seen(setting, each.reach[:, None]) for each in lines}
    seen |= {n: _seen(setting, large(wide[n], setting) * c) for n, c in columns.items()}
    unseen = tuple(n for n in mean if not seen[n])
    shaped = {n: e for n, e in testable.items() if e.stage == "noise"}
    return _weigh(
        setting,
        lines,
        columns,
        wide,
        shaped,
        not_testable=not_testable,
        not_excited=unseen,
        accounted=accounted,
        scatter=tuple(n for n, e in wide.items() if issubclass(e, Scatter)),
    )


def _seen(setting: Setting, curves: np.ndarray) -> bool:
    """Tell whether one of the shapes (s, j, n) of a large effect leaves enough."""
    flat = curves.reshape(-1, curves.shape[-1])
    left = np.asarray(beside_line(setting.rows, flat)) * setting.rows.weight
    squares = np.sum(left.reshape(curves.shape) ** 2, axis=(1, 2))
    return bool(np.max(squares) >= LEAST_SEEN * setting.noise_sd**2)


def _weigh(setting, lines, columns, wide, shaped, **about) -> Assessment:
    rows, sigma = setting.rows, setting.priors["sigma"]
    singles = assess_singles(rows, lines, sigma)
    kernel_names, chosen, subspaces = _subspaces(setting, singles, lines, columns, wide)
    table = {NONE: singles.none}
    table |= {name: singles.by_correlation(name) for name in singles.names}
    table |= {name: subspaces.by_correlation(name) for name in columns}
    # Where a program shows no kernel at all, unknown structure has no evidence.
    kernels = [np.full_like(singles.none, -np.inf)]
    kernels += [
        subspaces.by_correlation(name) - chosen.get(name, 0.0) for name in kernel_names
    ]
    count = max(len(kernel_names), _KERNELS)
    table[UNKNOWN] = np.logaddexp.reduce(kernels, axis=0) - np.log(count)
    noise = {
        n: assess_noise(e, setting) for n, e in shaped.items() if n != QUANTISATION
    }
    for name, found in noise.items():
        # What serial correlation adds is found with the rows weighed by their noise.
        other = _plain(reweighted(setting, found.relative_sd).rows, sigma)
        table[name] = found.log_factor + table[NONE][0] + other - other[0]
    step = 0.0
    gain = None
    if QUANTISATION in shaped:
        sd = float(setting.priors[f"{QUANTISATION}.step"].numbers[-1])
        gain, step = lattice_evidence(setting, sd)
        if np.isfinite(gain):
            table[QUANTISATION] = table[NONE] + gain
    found = Assessment(
        setting,
        lines,
        singles,
        subspaces,
        tuple(columns),
        kernel_names,
        noise,
        step,
        table,
        **about,
    )
    table |= assess_pairs(found, shaped, gain)
    # All are computed, so that one program serves every noise; these cannot compete.
    unseen = set(found.not_excited)
    return replace(
        found, table={n: v for n, v in table.items() if not unseen & set(n.split("+"))}
    )


def _subspaces(setting: Setting, singles: Singles, lines, columns, wide):
    """Return names of kernels, of how many some were chosen, and all evidences."""
    rows = setting.rows
    local = likeliest(setting)
    tables = kernels_of(setting.records) | {name: table for name, table, _ in local}
    kernel_names, kernels = visible_kernels(
        tables, lambda table: beside_line(rows, table), WIDTH
    )
    chosen = {name: log_count for name, _, log_count in local}
    stolen = _spanned(setting, kernels, lines, columns)
    kept = [i for i, gone in enumerate(stolen) if not gone]
    kernel_names = tuple(kernel_names[i] for i in kept)
    names, tables, scales = [], [], []
    for name, effect in wide.items():
        names += [name] * len(columns[name])
        tables += list(columns[name])
        scales += [effect_scales(effect, setting)] * len(columns[name])
    scales += [unknown_scales(setting.priors["gap_sd"])] * len(kept)
    found = assess_subspaces(
        rows,
        singles.ground,
        setting.priors["sigma"],
        (*names, *kernel_names),
        [*tables, *(kernels[i] for i in kept)],
        scales,
    )
    return kernel_names, chosen, found


def _spanned(setting: Setting, kernels: np.ndarray, lines, columns) -> np.ndarray:
    """Return which kernels are little more than one effect of the library."""
    rows = setting.rows
    flat = kernels.reshape(-1, kernels.shape[-1])
    whole = np.sum(kernels**2, axis=(1, 2))

    def captured(directions):
        inside = (flat @ directions.T) ** 2
        return inside.reshape(*kernels.shape[:2], -1).sum(axis=1)

    nothing = np.zeros((1, kernels.shape[-1]))
    shapes = np.concatenate([nothing, *(each.shapes for each in lines)])
    left = np.asarray(beside_line(rows, shapes))
    size = np.linalg.norm(left, axis=1, keepdims=True)
    best = captured(left / np.where(size > 0.0, size, 1.0)).max(axis=1)
    for table in (t for each in columns.values() for t in each):
        left = np.asarray(beside_line(rows, table))
        _, strength, axes = np.linalg.svd(left, full_matrices=False)
        axes = axes[strength > 1e-8 * strength[0]]
        best = np.maximum(best, captured(axes).sum(axis=1))
    return best >= _STOLEN * whole


def _plain(rows: Rows, sigma: Prior) -> np.ndarray:
    nothing = np.zeros((1, len(rows.reading)))
    alone = line_statistics(rows, nothing, nothing).ee[:, 0]
    return np.asarray(plain_evidence(ground(rows), alone, sigma))
