"""Results of earlier commands that a command starts from."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hdcal.inference.posterior import Posterior


def load_posterior(run: str) -> "Posterior":
    """Load the calibration in a result folder.

    Raises:
        InputError: there is none, or it was changed.
        NotUsable: it failed its checks.
    """
    from hdcal.cli.compilation_cache import keep_compilations

    keep_compilations()
    from hdcal.inference.posterior import Posterior

    posterior = Posterior.load(run)
    posterior.require_usable()
    return posterior
