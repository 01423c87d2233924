"""The virtual rig: a chain from table to reading, with mechanisms at a size in N.

Nothing here knows the library's physics: what the diagnosis has to recognise is made
by other forms, from finite elements to circuits.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from hdcal.blind.virtual_rig.history import Floats, History
from hdcal.blind.virtual_rig.mechanics import MECHANICS
from hdcal.blind.virtual_rig.mechanism import Mechanism, RigState, Shape
from hdcal.blind.virtual_rig.paths import PATHS
from hdcal.blind.virtual_rig.sensing import SENSING

MECHANISMS: dict[str, Mechanism] = {**MECHANICS, **PATHS, **SENSING}
# True spread of the loss of modulus per kelvin; the gear file's prior states the same.
ALPHA, ALPHA_SD = 3e-4, 4e-5
_STAGES = ("table", "gear", "path", "reading")
# Smallest size in shares of the largest, and what counts as no gap at all.
_SMALLEST, _NO_GAP = 1e-4, 1e-9


@dataclass(frozen=True)
class ActiveMechanism:
    """One mechanism of drawn shape at a size in its own unit."""

    name: str
    size: float
    shape: Shape


@dataclass(frozen=True)
class VirtualRig:
    """A rig on which nothing is wrong, and its noise.

    Attributes:
        history: what it does.
        stiffness: of the gear at 20 °C [N/mm].
        alpha: relative loss of modulus per kelvin.
        zero: force read at no deformation [N].
        shift: deformation read where the gear is first touched [mm].
        sigma: sd of the noise [N].
    """

    history: History
    stiffness: float = 200.0
    alpha: float = ALPHA
    zero: float = 0.0
    shift: float = 0.0
    sigma: float = 0.5

    def readings(self, active: Sequence[ActiveMechanism] = ()) -> Floats:
        """Return readings without noise [N], shape (n,)."""
        stiffness = self.stiffness * (1.0 - self.alpha * self.history.rise)
        signal = self.history.deformation - self.shift
        state = RigState(self.history, stiffness, signal)
        for stage in _STAGES:
            if stage == "gear":
                state = replace(state, deformation=signal)
                signal = state.stiffness * signal
            for one in active:
                mechanism = MECHANISMS[one.name]
                if mechanism.stage == stage:
                    signal = signal + mechanism.adds(signal, state, one.size, one.shape)
        return signal + self.zero

    @cached_property
    def fault_free(self) -> Floats:
        """Readings without noise and without any mechanism [N], shape (n,)."""
        return self.readings()

    @cached_property
    def absorbed(self) -> Floats:
        """What a calibration absorbs, shape (n, 3).

        Slope and zero are free; the loss of modulus is in units of its prior's sd.
        """
        x, rise = self.history.deformation, self.history.rise
        warm = self.stiffness * ALPHA_SD * x * rise / self.sigma
        return np.stack([x, np.ones_like(x), warm], axis=1)

    def gap(self, curves: Floats) -> Floats:
        """Return what a calibration leaves of curves [N], shape (…, n)."""
        gram = self.absorbed.T @ self.absorbed + np.diag([1e-9, 1e-9, 1.0])
        fitted = (curves @ self.absorbed) @ np.linalg.solve(gram, self.absorbed.T)
        return curves - fitted

    def gap_over_noise(self, curves: Floats) -> Floats:
        """Return r of curves (…, n): RMS of the gap over the sd of the noise."""
        return np.sqrt(np.mean(self.gap(curves) ** 2, axis=-1)) / self.sigma

    def curve(self, active: ActiveMechanism) -> Floats:
        """Return what one mechanism adds to the readings [N], shape (n,)."""
        return self.readings([active]) - self.fault_free

    def draw_mechanism(
        self, name: str, r: float, rng: np.random.Generator
    ) -> ActiveMechanism | None:
        """Draw shape and sign of a mechanism, and size it to a gap over noise of r.

        Returns:
            None where no plausible size reaches r on this loading.
        """
        mechanism = MECHANISMS[name]
        shape = mechanism.draw(rng)
        sign = rng.choice([-1.0, 1.0]) if mechanism.signed else 1.0
        low, high = np.log(_SMALLEST * mechanism.largest), np.log(mechanism.largest)

        def sized(log_size: float) -> ActiveMechanism:
            return ActiveMechanism(name, sign * float(np.exp(log_size)), shape)

        def excess(log_size: float) -> float:
            found = float(self.gap_over_noise(self.curve(sized(log_size))))
            return float(np.log(max(found, _NO_GAP) / r))

        if excess(high) < 0.0 or excess(low) > 0.0:
            return None
        return sized(float(scipy.optimize.brentq(excess, low, high, xtol=1e-4)))  # type: ignore[arg-type]


def draw_rig(history: History, rng: np.random.Generator) -> VirtualRig:
    """Draw a rig on which nothing is wrong."""
    return VirtualRig(
        history,
        stiffness=rng.uniform(150.0, 260.0),
        alpha=rng.normal(ALPHA, ALPHA_SD),
        zero=rng.normal(),
        shift=rng.normal(0.0, 0.004),
        sigma=rng.uniform(0.3, 0.9),
    )


def draw_noise(
    rig: VirtualRig, rng: np.random.Generator, correlation: float = 0.0
) -> Floats:
    """Return noise with sd σ [N], serially correlated within runs, shape (n,)."""
    new = rng.normal(size=len(rig.history.run))
    noise, starts = new.copy(), rig.history.run_starts
    for row in range(1, len(new)):
        if not starts[row]:
            fresh = np.sqrt(1.0 - correlation**2) * new[row]
            noise[row] = correlation * noise[row - 1] + fresh
    return rig.sigma * noise
