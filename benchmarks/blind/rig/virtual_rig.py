"""The measurement chain of the virtual rig, with mechanisms of a size in N."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from scipy.optimize import brentq

from benchmarks.blind.rig.history import Floats, History

Shape = dict[str, Any]
# Mean and spread of the loss of modulus per kelvin; the gear file's prior is the same.
ALPHA, ALPHA_SD = 3e-4, 4e-5
_STAGES = ("table", "gear", "path", "reading")
# Smallest size over the largest, and the r that counts as no gap at all.
_SMALLEST, _NO_GAP = 1e-4, 1e-9


@dataclass(frozen=True)
class RigState:
    """Quantities of the rig that a mechanism may depend on.

    Attributes:
        history: movement of the rig.
        stiffness: of the gear in each row [N/mm], shape (n,).
        deformation: of the gear [mm], shape (n,).
    """

    history: History
    stiffness: Floats
    deformation: Floats


@dataclass(frozen=True)
class Mechanism:
    """One mechanism, of which only the size is free once its shape is drawn.

    Stages, in the order of the chain: `table` adds to the deformation of the gear [mm],
    `gear` to its force [N], `path` is a second path of the force [N], `reading` adds to
    the reading [N].

    Attributes:
        stage: where it acts.
        adds: (signal, state, size, shape) → its contribution to the signal, shape (n,).
        largest: size beyond which it is not plausible on a real rig.
        needs: features of a loading without which it cannot be identified.
        draw: draws the shape.
        signed: whether the size may be negative.
    """

    stage: Literal["table", "gear", "path", "reading"]
    adds: Callable[[Floats, RigState, float, Shape], Floats]
    largest: float
    needs: frozenset[str] = frozenset()
    draw: Callable[[np.random.Generator], Shape] = lambda rng: {}
    signed: bool = False


def draw_members(rng: np.random.Generator) -> Shape:
    """Draw a standard size for each of up to 64 mountings or gears, shape (64,)."""
    return {"members": rng.uniform(-1.7, 1.7, 64)}


@dataclass(frozen=True)
class ActiveMechanism:
    """A mechanism of drawn shape at a size in its unit."""

    mechanism: Mechanism
    size: float
    shape: Shape


@dataclass(frozen=True)
class VirtualRig:
    """A rig without any mechanism, and its noise.

    Attributes:
        history: movement of the rig.
        stiffness: of the gear at 20 °C [N/mm].
        alpha: relative loss of modulus per kelvin.
        zero: force read at no deformation [N].
        shift: deformation read at first contact [mm].
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
            for each in active:
                if each.mechanism.stage == stage:
                    adds = each.mechanism.adds
                    signal = signal + adds(signal, state, each.size, each.shape)
        return signal + self.zero

    @cached_property
    def fault_free(self) -> Floats:
        """Readings without noise and without any mechanism [N], shape (n,)."""
        return self.readings()

    @cached_property
    def absorbed(self) -> Floats:
        """Columns that a calibration absorbs, shape (n, 3).

        Slope and zero are free; the loss of modulus is in units of its prior's sd.
        """
        x, rise = self.history.deformation, self.history.rise
        warm = self.stiffness * ALPHA_SD * x * rise / self.sigma
        return np.stack([x, np.ones_like(x), warm], axis=1)

    def gap(self, curve: Floats) -> Floats:
        """Return what a calibration leaves of a curve [N], shape (n,)."""
        gram = self.absorbed.T @ self.absorbed + np.diag([1e-9, 1e-9, 1.0])
        return curve - self.absorbed @ np.linalg.solve(gram, self.absorbed.T @ curve)

    def gap_over_noise(self, curve: Floats) -> float:
        """Return r of a curve: RMS of the gap over the sd of the noise."""
        return float(np.sqrt(np.mean(self.gap(curve) ** 2))) / self.sigma

    def curve(self, active: ActiveMechanism) -> Floats:
        """Return the contribution of one mechanism to the readings [N], shape (n,)."""
        return self.readings([active]) - self.fault_free

    def draw_mechanism(
        self,
        mechanism: Mechanism,
        r: float,
        rng: np.random.Generator,
        shown: slice = slice(None),
    ) -> ActiveMechanism | None:
        """Draw shape and sign of a mechanism, and size it to a gap over noise of r.

        Args:
            mechanism: to draw.
            r: RMS of the gap over the sd of the noise.
            rng: source of random numbers.
            shown: rows that are measured, the gap being that of these rows alone.

        Returns:
            None where no plausible size reaches r on this loading.
        """
        measured = replace(self, history=_rows(self.history, shown))
        shape = mechanism.draw(rng)
        sign = rng.choice([-1.0, 1.0]) if mechanism.signed else 1.0
        low, high = np.log(_SMALLEST * mechanism.largest), np.log(mechanism.largest)

        def sized(log_size: float) -> ActiveMechanism:
            return ActiveMechanism(mechanism, sign * float(np.exp(log_size)), shape)

        def excess(log_size: float) -> float:
            gap = measured.gap_over_noise(self.curve(sized(log_size))[shown])
            return float(np.log(max(gap, _NO_GAP) / r))

        if excess(high) < 0.0 or excess(low) > 0.0:
            return None
        return sized(float(brentq(excess, low, high, xtol=1e-4)))  # type: ignore[arg-type]


def _rows(history: History, shown: slice) -> History:
    names = [field.name for field in fields(history)]
    return History(**{name: getattr(history, name)[shown] for name in names})


def draw_rig(history: History, rng: np.random.Generator) -> VirtualRig:
    """Draw a rig without any mechanism."""
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
    """Return noise of sd σ [N], AR(1) within runs, shape (n,)."""
    new = rng.normal(size=len(rig.history.run))
    noise, starts = new.copy(), rig.history.run_starts
    for row in range(1, len(new)):
        if not starts[row]:
            fresh = np.sqrt(1.0 - correlation**2) * new[row]
            noise[row] = correlation * noise[row - 1] + fresh
    return rig.sigma * noise
