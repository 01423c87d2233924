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
    settle,
)
from scipy.special import logsumexp

from hdcal.evidence.amplitude_grids import SCALE_WEIGHTS, SCALES
from hdcal.evidence.closed_form import (
    block_evidence,
    entry_evidence,
    plain_evidence,
)
from hdcal.evidence.closed_form_pairs import Couples, couple_evidence
from hdcal.evidence.effect_lines import TOLERANCES, draw_lines, entries_of, join
from hdcal.evidence.inner_products import (
    block_statistics,
    gram,
    ground,
    line_statistics,
    tolerant_statistics,
)
from hdcal.evidence.whitened_rows import log_absorbed, whiten, whitening_jacobian
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


def laid_out(effect, correlation):
    """Return rows, lines of the effect and prior of σ for data that show it."""
    records = settle().records
    setting = settle(ADDED[effect](records), correlation=correlation)
    lines = draw_lines(EFFECTS[effect], setting)
    assert lines.linear
    return at_one(setting, correlation), lines, setting.priors["sigma"]


def entries_at(lines, tolerance):
    """Return entries with one tolerance, as likely as not."""
    if tolerance == 0.0:
        return join([entries_of(lines, tight=True)], [0])
    part = entries_of(lines)
    kept = part["tolerance"] == tolerance
    part = {name: column[kept] for name, column in part.items()}
    part["log_weight"] += np.log(len(TOLERANCES)) - np.log(0.6)
    return join([part], [0])


def closed_line(rows, lines, tolerance, sigma):
    nodes = tolerant_statistics(rows, lines.offsets, lines.slopes, lines.shapes)
    found = entry_evidence(ground(rows), nodes, entries_at(lines, tolerance), sigma)
    return float(logsumexp(np.asarray(found[0])))


@pytest.mark.parametrize("correlation", CORRELATIONS)
@pytest.mark.parametrize("effect", ADDED)
def test_no_effect_is_a_dense_normal(effect, correlation):
    rows, lines, sigma = laid_out(effect, correlation)
    nothing = 0.0 * lines.slopes
    length = line_statistics(rows, nothing, nothing).ee[:, 0]
    found = plain_evidence(ground(rows), length, sigma)[0]
    fixed, reading = covariance(rows, correlation), np.asarray(rows.reading)[:, None]
    slow = [
        log_normal(reading, sd**2 * fixed)[0] + weight
        for sd, weight in zip(*noise_grid(sigma), strict=True)
    ]
    assert found == pytest.approx(logsumexp(slow), abs=0.02)


@pytest.mark.parametrize("tolerance", [0.0, 0.2])
@pytest.mark.parametrize("correlation", CORRELATIONS)
@pytest.mark.parametrize("effect", ADDED)
def test_a_linear_effect_is_its_integral(effect, correlation, tolerance):
    """Over amplitude, three prior scales and σ; the shape may differ by a fifth."""
    rows, lines, sigma = laid_out(effect, correlation)
    slow = line_integral(
        rows,
        lines.slopes[0],
        lines.grid,
        sigma,
        correlation,
        tolerance,
        SCALES,
        SCALE_WEIGHTS,
    )
    assert closed_line(rows, lines, tolerance, sigma) == pytest.approx(slow, abs=0.02)


def test_cells_of_the_tolerance_are_coarse():
    """A tolerance in proportion to the amplitude itself gives 0.36 nat less here."""
    rows, lines, sigma = laid_out("coulomb_friction", 0.0)
    meant = line_integral(
        rows,
        lines.slopes[0],
        lines.grid,
        sigma,
        0.0,
        0.2,
        SCALES,
        SCALE_WEIGHTS,
        cells=False,
    )
    assert abs(closed_line(rows, lines, 0.2, sigma) - meant) < 0.5


@pytest.mark.parametrize("forgotten", ["base model", "correlation", "half the prior"])
def test_a_wrong_integral_is_noticed(forgotten):
    """The comparison can fail: leave one thing out of the closed form."""
    rows, lines, sigma = laid_out("coulomb_friction", 0.4)
    slow = line_integral(
        rows, lines.slopes[0], lines.grid, sigma, 0.4, 0.0, SCALES, SCALE_WEIGHTS
    )
    wrong = {
        "base model": replace(rows, base=0.5 * rows.base),
        "correlation": replace(rows, correlations=np.array([0.2])),
        "half the prior": rows,
    }[forgotten]
    found = closed_line(wrong, lines, 0.0, sigma)
    found -= np.log(2.0) * (forgotten == "half the prior")
    assert abs(found - slow) > 0.1


@pytest.mark.parametrize("correlation", CORRELATIONS)
def test_a_subspace_is_a_dense_normal(correlation):
    setting = settle(0.6 * np.sin(np.arange(24) / 3.0), correlation=correlation)
    rows, sigma = at_one(setting, correlation), setting.priors["sigma"]
    columns = np.random.default_rng(8).normal(size=(5, 24)) / 2.0
    columns[4] = 0.0  # padding
    columns[0] = np.sin(np.arange(24) / 3.0)
    scale = np.array([[0.1, 0.6, 3.0]])
    blocks = block_statistics(rows, columns[None])
    found = block_evidence(ground(rows), blocks, scale, np.log(scale / 3.7), sigma)
    fixed, reading = covariance(rows, correlation), np.asarray(rows.reading)[:, None]
    for factor, one in zip(scale[0], np.asarray(found)[0, 0], strict=True):
        wide = factor**2 * columns.T @ columns
        slow = [
            log_normal(reading, sd**2 * fixed + wide)[0] + weight
            for sd, weight in zip(*noise_grid(sigma), strict=True)
        ]
        slow = logsumexp(slow) + np.log(factor / 3.7)
        assert one == pytest.approx(slow, abs=0.02), factor


def couple(angle, low, high, truth=(0.5, 0.5), seed=2):
    """Return rows, slopes and inner products of two effects so much alike."""
    rng = np.random.default_rng(seed)
    one = np.asarray(settle().records.sense, float)
    other = np.cos(np.arange(24) * 1.3)
    two = angle * one + np.sqrt(1.0 - angle**2) * other / other.std()
    setting = settle(truth[0] * one + truth[1] * two, seed=int(rng.integers(99)))
    rows = at_one(setting, 0.0)
    table = np.asarray(gram(rows, 0.0, np.stack([one, two])))

    def each(value):
        return np.broadcast_to(np.asarray(value, float).reshape(-1, 1), (2, 1))

    couples = Couples(
        ee=table[0, :1],
        eu=table[0, 1:, None],
        uu=np.array([table[1, 1], table[1, 2], table[2, 2]])[:, None],
        low=each(low),
        high=each(high),
        mean=each(0.0),
        precision=each(1.0 / 1.5**2),
        log_height=np.log(1.0 / (2.0 * np.pi * 1.5**2)) * np.ones(1),
    )
    return rows, setting.priors["sigma"], np.stack([one, two]), couples


def couple_integral(rows, sigma, slopes, couples):
    """Integrate over both amplitudes on a fine mesh, and over σ."""
    low, high = np.asarray(couples.low)[:, 0], np.asarray(couples.high)[:, 0]
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
@pytest.mark.parametrize("angle", [0.0, 0.5, 0.9])
def test_a_pair_is_its_double_integral(angle, box):
    rows, sigma, slopes, couples = couple(angle, *BOXES[box])
    shared = ground(rows)
    found = couple_evidence(shared.constant[0], shared.rows, couples, sigma)[0]
    slow = couple_integral(rows, sigma, slopes, couples)
    assert found == pytest.approx(slow, abs=0.1)


@pytest.mark.parametrize("correlation", [0.0, 0.3, 0.6])
def test_whitened_rows_are_independent(correlation):
    rows = replace(
        settle().rows,
        before=np.where(np.arange(24) % 8 == 0, -1, np.arange(24) - 1),
        weight=1.0 / np.linspace(0.7, 1.4, 24),
    )
    matrix = np.asarray(whiten(rows, np.eye(24), correlation))
    serial = covariance(replace(rows, base=0.0 * rows.base), correlation)
    np.testing.assert_allclose(matrix @ serial @ matrix.T, np.eye(24), atol=1e-12)
    volume = np.linalg.slogdet(matrix)[1]
    assert whitening_jacobian(rows, correlation) == pytest.approx(volume)
    dense = matrix @ covariance(rows, correlation) @ matrix.T
    assert log_absorbed(rows, correlation) == pytest.approx(
        -np.linalg.slogdet(dense)[1]
    )


def test_products_are_those_of_the_inverse_covariance():
    setting = settle()
    rows = at_one(setting, 0.4)
    curves = np.random.default_rng(3).normal(size=(3, 24))
    table = np.concatenate([np.asarray(rows.reading)[None], curves])
    dense = table @ np.linalg.solve(covariance(rows, 0.4), table.T)
    np.testing.assert_allclose(gram(rows, 0.4, curves), dense, rtol=1e-6)
    nodes = line_statistics(rows, curves, curves[::-1])
    left = table[0] - curves
    dense = np.linalg.inv(covariance(rows, 0.4))
    np.testing.assert_allclose(nodes.ee[0], np.diag(left @ dense @ left.T), rtol=1e-6)
    cross = np.diag(left @ dense @ curves[::-1].T)
    np.testing.assert_allclose(nodes.eu[0], cross, rtol=1e-6)
    assert jax.tree.leaves(nodes)[0].shape == (1, 3)
    assert setting.noise_sd == NOISE
