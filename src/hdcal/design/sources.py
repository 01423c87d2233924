"""What a design starts from: a calibration, or a gear of which priors are known."""

from pathlib import Path

from hdcal.errors import Finding, attempt


def open_source(
    findings: list[Finding],
    run: str | None,
    gear: str | None,
    out: str | None,
    kind: str,
):
    """Return the calibration or gear, and the folder for the result.

    Args:
        findings: gains what is wrong; nothing is raised.
        run: folder of a calibration.
        gear: a gear file, in its place.
        out: the folder, if the user named one.
        kind: ending of the folder's name otherwise.

    Returns:
        Each None where it cannot be told.
    """
    from hdcal.data.gear import read_gear
    from hdcal.inference.posterior import Posterior

    if (run is None) == (gear is None):
        words = "is missing" if run is None else "and --gear are given both"
        remedy = "Name a folder of hdcal calibrate, or --gear GEAR.toml for priors only"
        findings.append(Finding("RUN", words, remedy))
        return None, out
    if gear is not None:
        source, name = attempt(findings, read_gear, gear), Path(gear).stem
    else:
        source = attempt(findings, Posterior.load, run)
        name = source.case.name if source is not None else ""
    return source, (f"{name}-{kind}" if out is None and source is not None else out)
