"""The evidence on resampled half cycles: does the name depend on a few rows?"""

import numpy as np
from jaxtyping import Float

from hdcal.evidence.case_evidence import CaseEvidence
from hdcal.evidence.closed_form import base_evidence, cell_evidence
from hdcal.evidence.inner_products import CommonTerms, PieceProducts
from hdcal.evidence.linear_rows import whiten
from hdcal.evidence.row_features import half_cycle_blocks
from hdcal.evidence.single_evidence import CellEvidence

_SAMPLES = 20


def resampled_evidence(
    evidence: CaseEvidence, rng: np.random.Generator
) -> Float[np.ndarray, "s m"]:
    """Return the log evidence of none and each single effect on resampled blocks.

    Inner products add over blocks, so that no row is visited twice.

    Args:
        evidence: of the whole data.
        rng: source of randomness.

    Returns:
        Shape (samples, 1 + effects).
    """
    block = half_cycle_blocks(evidence.prepared.records)
    count = int(block.max()) + 1
    picked = rng.multinomial(count, np.full(count, 1.0 / count), size=_SAMPLES)
    ee, eu, uu = _products(evidence, picked[:, block].astype(float))
    nothing = np.zeros((_SAMPLES, ee.shape[1] - 1, 0))
    products = PieceProducts(
        ee[:, 1:], eu[:, 1:], np.maximum(uu, 0.0)[:, 1:], nothing, nothing, nothing
    )
    sigma = evidence.prepared.priors["sigma"]
    common = CommonTerms(np.zeros(_SAMPLES), float(len(block)))
    exact = evidence.single.parts[0]
    log_evidence, mean, sd = cell_evidence(common, products, exact.cells, sigma)
    totals = [base_evidence(common, ee[:, 0], sigma)]
    found = CellEvidence(exact.owner, exact.cells, log_evidence, mean, sd)
    for effect in range(len(evidence.piecewise)):
        totals.append(np.logaddexp.reduce(found.of(effect).log_evidence, axis=1))
    return np.stack(totals, axis=1)


def _products(evidence: CaseEvidence, weight: np.ndarray):
    """Return ee, eu and uu of no effect and of all pieces, for weights of the rows.

    Args:
        evidence: of the whole data.
        weight: how often each row counts, [sample, row].
    """
    rows, effects = evidence.prepared.rows, evidence.piecewise
    correlation = evidence.likeliest_correlation
    nothing = np.zeros((1, len(rows.reading)))
    offsets = np.concatenate([nothing, *(each.offsets for each in effects)])
    slopes = np.concatenate([nothing, *(each.slopes for each in effects)])
    base, left, slope = (
        whiten(rows, columns, correlation)
        for columns in (rows.base, (rows.reading - offsets).T, slopes.T)
    )
    # Orthonormal columns rather than X'X + S⁻¹, which readings without noise leave
    # singular by rounding.
    root = np.sqrt(weight)[:, :, None]
    prior = np.diag(np.sqrt(rows.precision))
    stacked = np.concatenate(
        [root * base, np.broadcast_to(prior, (len(weight), *prior.shape))], axis=1
    )
    seen = root * np.linalg.qr(stacked).Q[:, : len(base)]
    xe = np.einsum("snp,ng->spg", seen, left, optimize=True)
    xu = np.einsum("snp,ng->spg", seen, slope, optimize=True)
    return (
        weight @ left**2 - np.sum(xe**2, axis=1),
        weight @ (left * slope) - np.sum(xe * xu, axis=1),
        weight @ slope**2 - np.sum(xu**2, axis=1),
    )
