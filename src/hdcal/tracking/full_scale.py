"""Which full scale a stream that begins with priors is taken to have."""

from hdcal.data.case import Gear
from hdcal.data.full_scale import REFERENCE, FullScale
from hdcal.data.gear import IN_NEWTONS, at_full_scale
from hdcal.prediction.engine.pooled import Pooled

# Of a leftover discrepancy a stream that begins with priors makes no use.
_UNUSED = "gap_sd"
# Largest ratio of full scales for which priors in newtons serve as well.
_ALIKE = 3.0


class AssumedFullScale:
    """The full scale that shipped priors in newtons are for, told where it matters.

    A stream has none before it is read: the priors stay as they are.

    Args:
        known: what the stream begins with; a calibration assumes nothing.
    """

    def __init__(self, known: Pooled | Gear):
        self._names, self._largest = "", 0.0
        if isinstance(known, Gear):
            twice = FullScale(
                force=2.0 * REFERENCE.force,
                slope=2.0 * REFERENCE.slope,
                zero_sd=2.0 * REFERENCE.zero_sd,
            )
            other = at_full_scale(known, twice)
            own, moved = (g.priors | g.scale_priors for g in (known, other))
            # The stiffness of a spring is such a prior too.
            names = ("K", "force_offset", *IN_NEWTONS)
            shipped = [name for name in names if own[name] != moved[name]]
            self._names = ", ".join(name for name in shipped if name != _UNUSED)

    def see(self, force: float) -> None:
        """Take the force of a reading [N]."""
        self._largest = max(self._largest, abs(force))

    def at_start(self) -> list[str]:
        """Return sentences on what is assumed."""
        if not self._names:
            return []
        return [
            f"the priors of {self._names} are those of a rig that reads up to "
            f"{REFERENCE.force:g} N; the table [priors] of the gear file may state "
            "others"
        ]

    def at_end(self) -> str:
        """Return what the readings say against it, to end a sentence; else nothing."""
        ratio = self._largest / REFERENCE.force
        if not self._names or not self._largest or 1.0 / _ALIKE < ratio < _ALIKE:
            return ""
        return (
            f"; the largest force is {self._largest:.3g} N, but the priors of "
            f"{self._names} are for {REFERENCE.force:g} N: state them in the gear "
            "file"
        )
