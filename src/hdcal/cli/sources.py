"""What a command starts from: the result of an earlier one, or a gear file."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hdcal.data.case import Gear
    from hdcal.inference.posterior import Posterior


def load_posterior(run: str) -> "Posterior":
    """Load the calibration in a result folder.

    Raises:
        InputError: there is none, or it was changed.
        NotUsable: it failed its checks.
    """
    from hdcal.inference.posterior import Posterior

    posterior = Posterior.load(run)
    posterior.require_usable()
    return posterior


def load_gear(path: str) -> "Gear":
    """Read a gear file.

    Raises:
        InputError: it cannot be used.
    """
    from hdcal.data.gear import read_gear

    return read_gear(path)
