"""The branch on which a turning row was read, by its force."""

import numpy as np

# Rows of each branch that are compared with the row between them; four and more
# also show a curvature and a slope of each branch.
_MOST, _FEWEST, _CURVED = 8, 2, 4
# Prior probability that a turning row was read before the movement turned, as a rig
# does that stops at its set points.
_BEFORE = 0.99
# Digits of a computed force.
_ROUNDING = 1e-9


def sense_at_turns(
    sense: np.ndarray, deformation: np.ndarray, force: np.ndarray, run: np.ndarray
) -> np.ndarray:
    """Return the sense of the movement, with turning rows on the branch of their force.

    The deformation of a turning row does not show whether the movement had turned when
    the force was read; with friction the two forces differ by the width of the loop.
    The row gets the sense of the branch that predicts its force better: both branches
    are extrapolated from their nearest rows, the turning row left out.

    Args:
        sense: sign of the last movement, a turning row counted before its turn.
        deformation: in the order it was taken [mm], shape (n,).
        force: as read [N].
        run: index of the mounting.
    """
    order = np.argsort(run, kind="stable")
    x, y, sign = deformation[order], force[order], sense[order].copy()
    edges = np.flatnonzero((np.diff(sign) != 0) | (np.diff(run[order]) != 0)) + 1
    edges = np.array([0, *edges, sign.size])
    # The last row of a branch is the turning row, and belongs to none here.
    before, after = np.diff(edges)[:-1] - 1, np.diff(edges)[1:]
    after[:-1] -= 1
    rows = edges[1:-1] - 1
    turned = (run[order][rows] == run[order][rows + 1]) if rows.size else rows > 0
    count = np.where(turned, np.minimum(np.minimum(before, after), _MOST), 0)
    sizes = [size for size in range(_FEWEST, _MOST + 1) if np.any(count == size)]
    if not sizes:
        return sense
    fits = [_two_branches(x, y, rows[count == size], size) for size in sizes]
    freedom = sum(free for *_, free in fits)
    noise = np.sqrt(sum(squares for _, squares, _ in fits) / freedom)
    noise += _ROUNDING * np.max(np.abs(y))
    for size, (error, *_) in zip(sizes, fits, strict=True):
        score = np.log1p((error / noise) ** 2 / freedom)
        likelier = 0.5 * (freedom + 1) * (score[0] - score[1])
        late = rows[count == size][likelier > np.log(_BEFORE / (1.0 - _BEFORE))]
        sign[late] = sign[late + 1]
    senses = np.empty_like(sense)
    senses[order] = sign
    return senses


def _two_branches(
    x: np.ndarray, y: np.ndarray, at: np.ndarray, size: int
) -> tuple[np.ndarray, float, int]:
    """Return how two branches predict the force at the turning rows between them.

    Returns:
        Errors of the prediction from before and from after the turn, over their
        standard errors for a noise of one, shape (2, t); the sum of squares that the
        branches leave; and its degrees of freedom.
    """
    steps = np.concatenate([np.arange(-size, 0), np.arange(1, size + 1)])
    near = at[:, None] + steps
    u = x[near] - x[at][:, None]
    u /= np.maximum(np.max(np.abs(u), axis=1, keepdims=True), np.finfo(float).tiny)
    side = np.broadcast_to(np.sign(steps), u.shape)
    curved = [side * u, u**2] if size >= _CURVED else []
    design = np.stack([np.ones_like(u), side, u, *curved], axis=2)
    inverse = np.linalg.pinv(design)
    fitted = np.einsum("tpn,tn->tp", inverse, y[near])
    left = y[near] - np.einsum("tnp,tp->tn", design, fitted)
    ends = [inverse[:, 0] + way * inverse[:, 1] for way in (-1.0, 1.0)]
    errors = [
        (y[at] - np.sum(end * y[near], axis=1)) / np.sqrt(1.0 + np.sum(end**2, axis=1))
        for end in ends
    ]
    free = at.size * (2 * size - design.shape[2])
    return np.array(errors), float(np.sum(left**2)), free
