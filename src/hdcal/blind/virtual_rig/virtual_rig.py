"""The virtual rig: a chain from table to reading, with mechanisms at a size in N.

Nothing here knows the library's physics: what the diagnosis has to recognise is made
by other forms, from finite elements to circuits.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from hdcal.blind.virtual_rig.history import History
from hdcal.blind.virtual_rig.mechanics import MECHANICS
from hdcal.blind.virtual_rig.mechanism import Mechanism, Rig, Shape
from hdcal.blind.virtual_rig.paths import PATHS
from hdcal.blind.virtual_rig.sensing import SENSING

MECHANISMS: dict[str, Mechanism] = {**MECHANICS, **PATHS, **SENSING}
# True spread of the loss of modulus per kelvin; the gear file's prior states the same.
ALPHA, ALPHA_SD = 3e-4, 4e-5
_STAGES = ("table", "gear", "path", "reading")
# Smallest size in shares of the largest, and what counts as not seen at all.
_SMALLEST, _UNSEEN = 1e-4, 1e-9


@dataclass(frozen=True)
class Switched:
    """One mechanism of drawn shape at a size in its own unit."""

    name: str
    size: float
    shape: Shape


@dataclass(frozen=True)
class Bench:
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

    def read(self, switched: Sequence[Switched] = ()) -> np.ndarray:
        """Return readings without noise [N], shape (n,)."""
        stiffness = self.stiffness * (1.0 - self.alpha * self.history.rise)
        seen = self.history.deformation - self.shift
        rig = Rig(self.history, stiffness, seen)
        signal = seen
        for stage in _STAGES:
            if stage == "gear":
                rig = replace(rig, deformation=signal)
                signal = rig.stiffness * signal
            for each in switched:
                made = MECHANISMS[each.name]
                if made.stage == stage:
                    signal = signal + made.adds(signal, rig, each.size, each.shape)
        return signal + self.zero

    @cached_property
    def plain(self) -> np.ndarray:
        """Readings without noise of the rig on which nothing is wrong [N]."""
        return self.read()

    @cached_property
    def base(self) -> np.ndarray:
        """What a calibration absorbs: slope, zero, loss of modulus by its prior."""
        x, rise = self.history.deformation, self.history.rise
        warm = self.stiffness * ALPHA_SD * x * rise / self.sigma
        return np.stack([x, np.ones_like(x), warm], axis=1)

    def left(self, curves: np.ndarray) -> np.ndarray:
        """Return what curves (…, n) leave beside the base."""
        gram = self.base.T @ self.base + np.diag([1e-9, 1e-9, 1.0])
        return curves - (curves @ self.base) @ np.linalg.solve(gram, self.base.T)

    def visible(self, curves: np.ndarray) -> np.ndarray:
        """Return r of curves (…, n): RMS of what they leave, over the noise sd."""
        return np.sqrt(np.mean(self.left(curves) ** 2, axis=-1)) / self.sigma

    def curve(self, switched: Switched) -> np.ndarray:
        """Return what one mechanism adds to the readings [N], shape (n,)."""
        return self.read([switched]) - self.plain

    def at_size(self, name: str, r: float, rng: np.random.Generator) -> Switched | None:
        """Return a mechanism of drawn shape and sign that is visible as r.

        Returns:
            None where no plausible size reaches r on this program.
        """
        made = MECHANISMS[name]
        shape = made.draw(rng)
        sign = rng.choice([-1.0, 1.0]) if made.signed else 1.0
        low, high = np.log(_SMALLEST * made.largest), np.log(made.largest)

        def excess(log_size: float) -> float:
            switched = Switched(name, sign * float(np.exp(log_size)), shape)
            seen = self.visible(self.curve(switched))
            return float(np.log(max(float(seen), _UNSEEN) / r))

        if excess(high) < 0.0 or excess(low) > 0.0:
            return None
        log_size = float(brentq(excess, low, high, xtol=1e-4))  # type: ignore[arg-type]
        return Switched(name, sign * float(np.exp(log_size)), shape)


def draw_bench(history: History, rng: np.random.Generator) -> Bench:
    """Draw a rig on which nothing is wrong."""
    return Bench(
        history,
        stiffness=rng.uniform(150.0, 260.0),
        alpha=rng.normal(ALPHA, ALPHA_SD),
        zero=rng.normal(),
        shift=rng.normal(0.0, 0.004),
        sigma=rng.uniform(0.3, 0.9),
    )


def draw_noise(
    bench: Bench, rng: np.random.Generator, correlation: float = 0.0
) -> np.ndarray:
    """Return noise with sd σ [N], serially correlated within runs, shape (n,)."""
    new = rng.normal(size=len(bench.history.run))
    noise, starts = new.copy(), bench.history.run_starts
    for row in range(1, len(new)):
        if not starts[row]:
            fresh = np.sqrt(1.0 - correlation**2) * new[row]
            noise[row] = correlation * noise[row - 1] + fresh
    return bench.sigma * noise
