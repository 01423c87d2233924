"""What a design starts from: a calibration, or a gear of which priors are known."""

from hdcal.errors import Finding


def check_source(run: str | None, gear: str | None) -> list[Finding]:
    """Return what is wrong with the choice of a source."""
    if (run is None) == (gear is None):
        words = "is missing" if run is None else "and --gear are given both"
        remedy = "Name a folder of hdcal calibrate, or --gear GEAR.toml for priors only"
        return [Finding("RUN", words, remedy)]
    return []


def open_source(run: str | None, gear: str | None):
    """Return the calibration or gear, and its name for a folder.

    Raises:
        InputError: it cannot be read.
    """
    from pathlib import Path

    if gear is not None:
        from hdcal.rig.gear import read_gear

        return read_gear(gear), Path(gear).stem
    from hdcal.inference.posterior import Posterior

    posterior = Posterior.load(str(run))
    return posterior, posterior.case.name
