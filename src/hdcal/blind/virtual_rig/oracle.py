"""The best that anyone could do: Bayes' rule with rig, size and noise given away.

The oracle knows r, σ, the correlation of the noise and how likely each shape of each
mechanism is on this rig; slope, zero and loss of modulus it has to infer. Its shapes
are a sample, to which the true one is added, so that it is a bound, not a competitor.
"""

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.special import logsumexp

from hdcal.blind.virtual_rig.history import Floats
from hdcal.blind.virtual_rig.loadings import LOADINGS, Loading
from hdcal.blind.virtual_rig.mechanism import Shape
from hdcal.blind.virtual_rig.virtual_rig import (
    ALPHA,
    ALPHA_SD,
    MECHANISMS,
    ActiveMechanism,
    VirtualRig,
)

_DRAWS, _SEED = 40, 20
_TRIAL = 0.2  # of the largest size


def oracle_probabilities(
    loading: Loading,
    rig: VirtualRig,
    reading: Floats,
    *,
    truth: str,
    curve: Floats,
    r: float,
    correlation: float,
) -> dict[str, float]:
    """Return the oracle's probability of each mechanism.

    Args:
        loading: one of `LOADINGS`.
        rig: the true rig without a mechanism.
        reading: force as read [N], shape (n,).
        truth: name of the mechanism.
        curve: what it added [N], shape (n,).
        r: its gap over the noise.
        correlation: AR(1) coefficient of the noise.
    """
    precision = _precision(rig, correlation)
    # How much of the modulus this rig loses the oracle has to infer.
    weighted = precision @ (reading - replace(rig, alpha=ALPHA).fault_free)
    found = {}
    for name, drawn in drawn_curves(loading.name).items():
        scale = r / rig.gap_over_noise(drawn)
        shapes = scale[:, None] * drawn
        if name == truth:
            shapes = np.concatenate([shapes, curve[None]])
        energy = np.einsum("sn,nm,sm->s", shapes, precision, shapes, optimize=True)
        each = shapes @ weighted - 0.5 * energy
        found[name] = float(logsumexp(each) - np.log(len(each)))
    total = logsumexp(list(found.values()))
    # As many digits as any machine's algebra agrees on.
    return {n: round(float(np.exp(v - total)), 6) for n, v in found.items()}


@cache
def drawn_curves(name: str) -> dict[str, Floats]:
    """Return drawn curves of every mechanism that a loading shows, each (s, n) [N]."""
    loading = LOADINGS[name]()
    rig, rng, found = VirtualRig(loading.history), np.random.default_rng(_SEED), {}
    for name, mechanism in MECHANISMS.items():
        if mechanism.needs - loading.features:
            continue
        shapes = [mechanism.draw(rng) for _ in range(_DRAWS)]
        signs = (1.0, -1.0) if mechanism.signed else (1.0,)
        found[name] = np.stack(
            [_moderate(rig, name, sign, shape) for sign in signs for shape in shapes]
        )
    return found


def _moderate(rig: VirtualRig, name: str, sign: float, shape: Shape) -> Floats:
    """Return a curve near r = ½, where few mechanisms are far from linear."""
    size = _TRIAL * MECHANISMS[name].largest
    trial = rig.curve(ActiveMechanism(name, sign * size, shape))
    r = max(float(rig.gap_over_noise(trial)), 1e-6)
    size *= np.clip(0.5 / r, 0.01, 1.0 / _TRIAL)
    return rig.curve(ActiveMechanism(name, sign * size, shape))


def _precision(rig: VirtualRig, correlation: float) -> Floats:
    """Return the inverse covariance of what calibration leaves, shape (n, n)."""
    history = rig.history
    order, run = history.order, history.run
    apart = np.abs(order[:, None] - order)
    serial = np.where(run[:, None] == run, float(correlation) ** apart, 0.0)
    x = history.deformation
    base = np.stack([x, np.ones_like(x), rig.stiffness * ALPHA_SD * x * history.rise])
    noise = np.linalg.inv(rig.sigma**2 * serial)
    # Slope and zero are free, the loss of modulus as far as its prior allows.
    gram = base @ noise @ base.T + np.diag([0.0, 0.0, 1.0])
    return noise - noise @ base.T @ np.linalg.solve(gram, base @ noise)
