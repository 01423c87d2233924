"""The models that a result folder holds, each with its probability."""

import json
from pathlib import Path

from hdcal.errors import Finding, InputError, NotUsable
from hdcal.inference.posterior import Posterior

VERDICT = "verdict.json"
SCHEMA = "hdcal.verdict/1"
# What a posterior of a diagnosis knows of the diagnosis: its own hypothesis, and the
# probabilities of all that were calibrated.
ORIGIN = "diagnosis"


def read_models(run: Path | str) -> list[tuple[float, Posterior]]:
    """Return the models of a folder of `hdcal calibrate` or `hdcal diagnose`.

    Args:
        run: the folder, or a single posterior file.

    Raises:
        NotUsable: the diagnosis failed.
        InputError: a file is missing, changed or of another version.
    """
    run = Path(run)
    if not (run / VERDICT).is_file():
        return [(1.0, Posterior.load(run))]
    found = _read_verdict(run / VERDICT)
    if found["status"] != "ok":
        reasons = "; ".join(map(str, found.get("reasons", [])))
        raise NotUsable(f"this diagnosis failed and must not be used: {reasons}")
    refits = found.get("refits", [])
    if not refits:
        words = "holds no calibrated model"
        remedy = "Diagnose again without --quick, or calibrate"
        raise InputError([Finding(str(run), words, remedy)])
    loaded, findings = [], []
    for refit in refits:
        try:
            loaded.append(Posterior.load(run / refit["file"]))
        except InputError as error:
            findings += error.findings
    if findings:
        raise InputError(findings)
    return _weighed(run, refits, loaded)


def _read_verdict(path: Path) -> dict:
    """Return a verdict of this version with whole entries for its models."""
    words, remedy = "is not a verdict that hdcal wrote", "Diagnose again"
    try:
        found = json.loads(path.read_text("utf-8"))
        schema = str(found["schema"])
        if schema == SCHEMA and _is_whole(found):
            return found
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        schema = SCHEMA
    if schema != SCHEMA:
        words = f"has the format {schema[:60]}, and this hdcal reads {SCHEMA}"
        remedy = "Use the hdcal that wrote it, or diagnose again"
    raise InputError([Finding(str(path), words, remedy)])


def _is_whole(found: dict) -> bool:
    """Tell whether every model has a name, a probability and a file of this folder."""
    refits = found.get("refits", [])
    names = {refit["hypothesis"]: refit["probability"] for refit in refits}
    inside = all(Path(refit["file"]).name == refit["file"] for refit in refits)
    return inside and len(names) == len(refits) and isinstance(found["status"], str)


def _weighed(run: Path, refits, loaded) -> list[tuple[float, Posterior]]:
    """Return the models with what their own files, which are sealed, say of them."""
    told = {refit["hypothesis"]: refit["probability"] for refit in refits}
    for refit, posterior in zip(refits, loaded, strict=True):
        origin = posterior.settings.get(ORIGIN, {})
        if origin != {"hypothesis": refit["hypothesis"], "probabilities": told}:
            words = f"does not belong to {refit['file']}: one of them was changed"
            remedy = "Take the folder as it was written, or diagnose again"
            raise InputError([Finding(str(run / VERDICT), words, remedy)])
    return list(zip(told.values(), loaded, strict=True))
