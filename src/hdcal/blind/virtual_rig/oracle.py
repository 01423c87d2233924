"""The best that anyone could do: Bayes' rule with rig, size and noise given away.

The oracle knows r, σ, the correlation of the noise and how likely each shape of each
mechanism is on this rig; slope, zero and loss of modulus it has to infer. Its shapes
are a sample, to which the true one is added, so that it is a bound, not a competitor.
"""

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.special import logsumexp

from hdcal.blind.virtual_rig.loadings import PROGRAMS, Program
from hdcal.blind.virtual_rig.mechanism import Shape
from hdcal.blind.virtual_rig.virtual_rig import (
    ALPHA,
    ALPHA_SD,
    MECHANISMS,
    Bench,
    Switched,
)

_DRAWS, _SEED = 40, 20
_TRIAL = 0.2  # of the largest size


def judge(
    program: Program,
    bench: Bench,
    reading: np.ndarray,
    *,
    truth: str,
    curve: np.ndarray,
    r: float,
    correlation: float,
) -> dict[str, float]:
    """Return the oracle's probability of each mechanism.

    Args:
        program: what the rig did.
        bench: the true rig without a mechanism.
        reading: force as read [N], shape (n,).
        truth: name of the mechanism.
        curve: what it added [N], shape (n,).
        r: how visible it is.
        correlation: AR(1) coefficient of the noise.
    """
    precision = _precision(bench, correlation)
    # Nobody tells it how much of the modulus this rig loses.
    weighted = precision @ (reading - replace(bench, alpha=ALPHA).plain)
    found = {}
    for name, bank in curves(program.name).items():
        scale = r / bench.visible(bank)
        shapes = scale[:, None] * bank
        if name == truth:
            shapes = np.concatenate([shapes, curve[None]])
        energy = np.einsum("sn,nm,sm->s", shapes, precision, shapes, optimize=True)
        each = shapes @ weighted - 0.5 * energy
        found[name] = float(logsumexp(each) - np.log(len(each)))
    total = logsumexp(list(found.values()))
    # As many digits as any machine's algebra agrees on.
    return {n: round(float(np.exp(v - total)), 6) for n, v in found.items()}


@cache
def curves(program: str) -> dict[str, np.ndarray]:
    """Return drawn curves of every mechanism that a program shows, each (s, n) [N]."""
    made = PROGRAMS[program]()
    bench, rng, found = Bench(made.history), np.random.default_rng(_SEED), {}
    for name, mechanism in MECHANISMS.items():
        if mechanism.needs - made.features:
            continue
        shapes = [mechanism.draw(rng) for _ in range(_DRAWS)]
        signs = (1.0, -1.0) if mechanism.signed else (1.0,)
        found[name] = np.stack(
            [_moderate(bench, name, sign, shape) for sign in signs for shape in shapes]
        )
    return found


def _moderate(bench: Bench, name: str, sign: float, shape: Shape) -> np.ndarray:
    """Return a curve near r = ½, where few mechanisms are far from linear."""
    size = _TRIAL * MECHANISMS[name].largest
    seen = float(bench.visible(bench.curve(Switched(name, sign * size, shape))))
    size *= np.clip(0.5 / max(seen, 1e-6), 0.01, 1.0 / _TRIAL)
    return bench.curve(Switched(name, sign * size, shape))


def _precision(bench: Bench, correlation: float) -> np.ndarray:
    """Return the inverse covariance of readings beside the base, shape (n, n)."""
    told = bench.history
    order, run = told.order, told.run
    apart = np.abs(order[:, None] - order)
    serial = np.where(run[:, None] == run, float(correlation) ** apart, 0.0)
    x = told.deformation
    base = np.stack([x, np.ones_like(x), bench.stiffness * ALPHA_SD * x * told.rise])
    noise = np.linalg.inv(bench.sigma**2 * serial)
    # Slope and zero are free, the loss of modulus as far as its prior lets it.
    gram = base @ noise @ base.T + np.diag([0.0, 0.0, 1.0])
    return noise - noise @ base.T @ np.linalg.solve(gram, base @ noise)
