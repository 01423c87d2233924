"""The evidence again on resampled half cycles: is the name owed to a few rows?"""

import numpy as np

from hdcal.evidence.assessment import Assessment
from hdcal.evidence.closed_form import entry_evidence, plain_evidence
from hdcal.evidence.inner_products import Ground, Nodes
from hdcal.evidence.kernels import blocks_of
from hdcal.evidence.whitened_rows import whiten

_SAMPLES = 20


def repeated_evidence(found: Assessment, rng: np.random.Generator) -> np.ndarray:
    """Return the log evidence of none and each line effect on resampled blocks.

    Inner products add over blocks, so that no row is visited twice.

    Args:
        found: evidences of the whole data.
        rng: source of randomness.

    Returns:
        Shape (samples, 1 + effects).
    """
    rows, lines = found.setting.rows, found.lines
    whole = np.stack(list(found.table.values()))
    index = int(np.argmax(np.logaddexp.reduce(whole, axis=0)))
    correlation = float(np.asarray(rows.correlations)[index])
    cells = found.singles.cells[0]
    offsets = np.concatenate([each.offsets for each in lines])
    slopes = np.concatenate([each.slopes for each in lines])
    zero = np.zeros((1, offsets.shape[1]))
    left = np.asarray(rows.reading) - np.concatenate([zero, offsets])
    slope = np.concatenate([zero, slopes])
    base, left, slope = (
        np.asarray(whiten(rows, columns, correlation))
        for columns in (rows.base, left.T, slope.T)
    )
    block = blocks_of(found.setting.records)
    count = int(block.max()) + 1
    picked = rng.multinomial(count, np.full(count, 1.0 / count), size=_SAMPLES)
    weight = picked[:, block].astype(float)
    parts = {
        "xx": np.einsum("sn,np,nq->spq", weight, base, base, optimize=True),
        "xe": np.einsum("sn,np,ng->spg", weight, base, left, optimize=True),
        "xu": np.einsum("sn,np,ng->spg", weight, base, slope, optimize=True),
        "ee": weight @ left**2,
        "eu": weight @ (left * slope),
        "uu": weight @ slope**2,
    }
    gram = parts["xx"] + np.diag(np.asarray(rows.precision))
    xe, xu = np.linalg.solve(gram, parts["xe"]), np.linalg.solve(gram, parts["xu"])
    ee = parts["ee"] - np.sum(parts["xe"] * xe, axis=1)
    eu = parts["eu"] - np.sum(parts["xu"] * xe, axis=1)
    uu = parts["uu"] - np.sum(parts["xu"] * xu, axis=1)
    nothing = np.zeros((*ee.shape, 0))
    nodes = Nodes(ee, eu, np.maximum(uu, 0.0), nothing, nothing, nothing)
    sigma = found.setting.priors["sigma"]
    shared = Ground(np.zeros(_SAMPLES), float(len(block)))
    own = Nodes(*(leaf[:, 1:] for leaf in vars(nodes).values()))
    evidence = np.asarray(entry_evidence(shared, own, cells.entries, sigma)[0])
    totals = [np.asarray(plain_evidence(shared, ee[:, 0], sigma))]
    for effect in range(len(lines)):
        mine = evidence[:, cells.owner == effect]
        totals.append(np.logaddexp.reduce(mine, axis=1))
    return np.stack(totals, axis=1)
