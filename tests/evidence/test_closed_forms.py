"""Closed-form evidences are the integrals that they stand for, done the slow way."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from dense import (
    NOISE,
    covariance,
    line_integral,
    log_integral,
    log_normal,
    noise_grid,
    prepared_case,
)
from scipy.special import logsumexp
from slices import slice_of

from hdcal.evidence.closed_form import (
    base_evidence,
    cell_evidence,
    subspace_evidence,
)
from hdcal.evidence.inner_products import (
    common_terms,
    gram_matrix,
    piece_products,
    subspace_products,
)
from hdcal.evidence.linear_rows import (
    log_det_projection,
    log_det_whitening,
    whiten,
)
from hdcal.evidence.parameter_grid import SCALE_WEIGHTS, SCALES
from hdcal.evidence.piecewise_effect import (
    TOLERANCES,
    amplitude_cells,
    join_cells,
    piecewise_effect,
)
from hdcal.evidence.piecewise_pairs import CellPairs, cell_pair_evidence
from hdcal.physics.registry import EFFECTS

CORRELATIONS = (0.0, 0.4)
ADDED = {
    "coulomb_friction": lambda r: 0.5 * r.sense,
    # Half of it could be the modulus: its prior is what holds the base model back.
    "thermal_zero_drift": lambda r: 0.02 * (r.temperature - 20.0),
    "progressive_stiffening": lambda r: 4.0 * r.deformation**2,
}


def at_one(setting, correlation):
    return replace(setting.rows, correlations=np.array([correlation]))


def prepared(effect, correlation):
    """Return rows, pieces of the effect and prior of σ for data that show it."""
    records = prepared_case().records
    setting = prepared_case(ADDED[effect](records), correlation=correlation)
    pieces = piecewise_effect(EFFECTS[effect], setting)
    assert pieces.linear
    return at_one(setting, correlation), pieces, setting.priors["sigma"]


def cells_at(pieces, tolerance):
    """Return cells with one tolerance, as likely as not."""
    if tolerance == 0.0:
        return amplitude_cells(pieces, exact=True)
    cells = amplitude_cells(pieces)
    kept = cells.tolerance == tolerance
    cells = jax.tree.map(lambda column: column[kept], cells)
    weight = cells.log_weight + np.log(len(TOLERANCES)) - np.log(0.6)
    return join_cells([cells._replace(log_weight=weight)], [0])


def closed_form(rows, pieces, tolerance, sigma):
    nodes = piece_products(rows, pieces.offsets, pieces.slopes, pieces.shapes)
    found = cell_evidence(common_terms(rows), nodes, cells_at(pieces, tolerance), sigma)
    return float(logsumexp(np.asarray(found[0])))


@pytest.mark.parametrize("correlation", CORRELATIONS)
@pytest.mark.parametrize("effect", ADDED)
def test_no_effect_is_a_dense_normal(effect, correlation):
    rows, pieces, sigma = prepared(effect, correlation)
    nothing = 0.0 * pieces.slopes
    length = piece_products(rows, nothing, nothing).ee[:, 0]
    found = base_evidence(common_terms(rows), length, sigma)[0]
    fixed, reading = covariance(rows, correlation), np.asarray(rows.reading)[:, None]
    slow = [
        log_normal(reading, sd**2 * fixed)[0] + weight
        for sd, weight in zip(*noise_grid(sigma), strict=True)
    ]
    assert found == pytest.approx(logsumexp(slow), abs=0.02)


@pytest.mark.parametrize("tolerance", slice_of([0.0, 0.2], [0.2]))
@pytest.mark.parametrize("correlation", CORRELATIONS)
@pytest.mark.parametrize("effect", ADDED)
def test_a_linear_effect_is_its_integral(effect, correlation, tolerance):
    """Over amplitude, three prior scales and σ; the shape may differ by a fifth."""
    rows, pieces, sigma = prepared(effect, correlation)
    slow = line_integral(
        rows,
        pieces.slopes[0],
        pieces.grid,
        sigma,
        correlation,
        tolerance,
        SCALES,
        SCALE_WEIGHTS,
    )
    assert closed_form(rows, pieces, tolerance, sigma) == pytest.approx(slow, abs=0.02)


def test_cells_of_the_tolerance_are_coarse():
    """A tolerance in proportion to the amplitude itself gives 0.36 nat less here."""
    rows, pieces, sigma = prepared("coulomb_friction", 0.0)
    meant = line_integral(
        rows,
        pieces.slopes[0],
        pieces.grid,
        sigma,
        0.0,
        0.2,
        SCALES,
        SCALE_WEIGHTS,
        cells=False,
    )
    assert abs(closed_form(rows, pieces, 0.2, sigma) - meant) < 0.5


@pytest.mark.parametrize("forgotten", ["base model", "correlation", "half the prior"])
def test_a_wrong_integral_is_noticed(forgotten):
    """The comparison can fail: leave one thing out of the closed form."""
    rows, pieces, sigma = prepared("coulomb_friction", 0.4)
    slow = line_integral(
        rows, pieces.slopes[0], pieces.grid, sigma, 0.4, 0.0, SCALES, SCALE_WEIGHTS
    )
    wrong = {
        "base model": replace(rows, base=0.5 * rows.base),
        "correlation": replace(rows, correlations=np.array([0.2])),
        "half the prior": rows,
    }[forgotten]
    found = closed_form(wrong, pieces, 0.0, sigma)
    found -= np.log(2.0) * (forgotten == "half the prior")
    assert abs(found - slow) > 0.1


@pytest.mark.parametrize("correlation", CORRELATIONS)
def test_a_subspace_is_a_dense_normal(correlation):
    setting = prepared_case(0.6 * np.sin(np.arange(24) / 3.0), correlation=correlation)
    rows, sigma = at_one(setting, correlation), setting.priors["sigma"]
    columns = np.random.default_rng(8).normal(size=(5, 24)) / 2.0
    columns[4] = 0.0  # padding
    columns[0] = np.sin(np.arange(24) / 3.0)
    scale = np.array([[0.1, 0.6, 3.0]])
    blocks = subspace_products(rows, columns[None])
    found = subspace_evidence(
        common_terms(rows), blocks, scale, np.log(scale / 3.7), sigma
    )
    fixed, reading = covariance(rows, correlation), np.asarray(rows.reading)[:, None]
    for factor, one in zip(scale[0], np.asarray(found)[0, 0], strict=True):
        wide = factor**2 * columns.T @ columns
        slow = [
            log_normal(reading, sd**2 * fixed + wide)[0] + weight
            for sd, weight in zip(*noise_grid(sigma), strict=True)
        ]
        slow = logsumexp(slow) + np.log(factor / 3.7)
        assert one == pytest.approx(slow, abs=0.02), factor


def cell_pair(angle, low, high, truth=(0.5, 0.5), seed=2):
    """Return rows, slopes and inner products of two effects so much alike."""
    rng = np.random.default_rng(seed)
    one = np.asarray(prepared_case().records.sense, float)
    other = np.cos(np.arange(24) * 1.3)
    two = angle * one + np.sqrt(1.0 - angle**2) * other / other.std()
    setting = prepared_case(truth[0] * one + truth[1] * two, seed=int(rng.integers(99)))
    rows = at_one(setting, 0.0)
    table = np.asarray(gram_matrix(rows, 0.0, np.stack([one, two])))

    def each(value):
        return np.broadcast_to(np.asarray(value, float).reshape(-1, 1), (2, 1))

    pairs = CellPairs(
        ee=table[0, :1],
        eu=table[0, 1:, None],
        uu=np.array([table[1, 1], table[1, 2], table[2, 2]])[:, None],
        low=each(low),
        high=each(high),
        mean=each(0.0),
        precision=each(1.0 / 1.5**2),
        log_height=np.log(1.0 / (2.0 * np.pi * 1.5**2)) * np.ones(1),
    )
    return rows, setting.priors["sigma"], np.stack([one, two]), pairs


def cell_pair_integral(rows, sigma, slopes, pairs):
    """Integrate over both amplitudes on a fine mesh, and over σ."""
    low, high = np.asarray(pairs.low)[:, 0], np.asarray(pairs.high)[:, 0]
    a, b = (np.linspace(*ends, 161) for ends in zip(low, high, strict=True))
    mesh = np.stack(np.meshgrid(a, b, indexing="ij"))
    target = np.asarray(rows.reading) - np.einsum("kij,kn->ijn", mesh, slopes)
    target = target.reshape(-1, target.shape[-1]).T
    prior = np.sum(-0.5 * (mesh / 1.5) ** 2, axis=0) - np.log(2.0 * np.pi * 1.5**2)
    fixed, total = covariance(rows, 0.0), []
    for sd, weight in zip(*noise_grid(sigma, count=41), strict=True):
        height = log_normal(target, sd**2 * fixed).reshape(prior.shape) + prior
        inner = np.array([log_integral(line, b) for line in height])
        total.append(log_integral(inner, a) + weight)
    return float(logsumexp(total))


BOXES = {
    "all": ((-4.0, -4.0), (4.0, 4.0), (0.5, 0.5)),
    "both positive": ((0.0, 0.0), (5.0, 5.0), (0.5, 0.5)),
    "one at its end": ((0.0, 0.0), (5.0, 5.0), (0.0, 0.6)),
    "small cell": ((0.25, 0.5), (0.5, 1.0), (0.5, 0.5)),
    "off the data": ((1.0, 0.0), (2.0, 0.5), (0.5, 0.5)),
}


@pytest.mark.parametrize("box", BOXES)
@pytest.mark.parametrize("angle", slice_of([0.0, 0.5, 0.9], [0.5]))
def test_a_pair_is_its_double_integral(angle, box):
    rows, sigma, slopes, pairs = cell_pair(angle, *BOXES[box])
    shared = common_terms(rows)
    found = cell_pair_evidence(shared.constant[0], shared.rows, pairs, sigma)[0]
    slow = cell_pair_integral(rows, sigma, slopes, pairs)
    assert found == pytest.approx(slow, abs=0.1)


@pytest.mark.parametrize("correlation", [0.0, 0.3, 0.6])
def test_whitened_rows_are_independent(correlation):
    rows = replace(
        prepared_case().rows,
        before=np.where(np.arange(24) % 8 == 0, -1, np.arange(24) - 1),
        weight=1.0 / np.linspace(0.7, 1.4, 24),
    )
    matrix = np.asarray(whiten(rows, np.eye(24), correlation))
    serial = covariance(replace(rows, base=0.0 * rows.base), correlation)
    np.testing.assert_allclose(matrix @ serial @ matrix.T, np.eye(24), atol=1e-12)
    volume = np.linalg.slogdet(matrix)[1]
    assert log_det_whitening(rows, correlation) == pytest.approx(volume)
    dense = matrix @ covariance(rows, correlation) @ matrix.T
    assert log_det_projection(rows, correlation) == pytest.approx(
        -np.linalg.slogdet(dense)[1]
    )


def test_products_are_those_of_the_inverse_covariance():
    setting = prepared_case()
    rows = at_one(setting, 0.4)
    curves = np.random.default_rng(3).normal(size=(3, 24))
    table = np.concatenate([np.asarray(rows.reading)[None], curves])
    dense = table @ np.linalg.solve(covariance(rows, 0.4), table.T)
    np.testing.assert_allclose(gram_matrix(rows, 0.4, curves), dense, rtol=1e-6)
    nodes = piece_products(rows, curves, curves[::-1])
    left = table[0] - curves
    dense = np.linalg.inv(covariance(rows, 0.4))
    np.testing.assert_allclose(nodes.ee[0], np.diag(left @ dense @ left.T), rtol=1e-6)
    cross = np.diag(left @ dense @ curves[::-1].T)
    np.testing.assert_allclose(nodes.eu[0], cross, rtol=1e-6)
    assert jax.tree.leaves(nodes)[0].shape == (1, 3)
    assert setting.noise_sd == NOISE
