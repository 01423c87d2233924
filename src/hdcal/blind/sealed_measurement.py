"""A real measurement with a stated cause, as one case of a blind check."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from hdcal.blind.label import Label
from hdcal.blind.virtual_rig.cases import GEAR_TOML
from hdcal.blind.virtual_rig.loadings import Loading, loading_of
from hdcal.calibration.calibrate import check_names
from hdcal.data.gear import NO_MATERIAL
from hdcal.data.priors import material_names
from hdcal.data.reading import read_case
from hdcal.errors import Finding, InputError
from hdcal.evidence.case_evidence import UNKNOWN
from hdcal.physics.registry import EFFECTS

# The name of a measurement may tell its cause; of one case none is needed.
NAME = "case"


def sealed_measurement(
    source: str, *, gear: str, cause: str, withhold: str | None
) -> tuple[bytes, bytes, bytes | None, Label]:
    """Return table, gear file, material file if the gear names one, and label.

    Args:
        source: a CSV file.
        gear: its gear file.
        cause: names that would be right, or `unknown`.
        withhold: effects it is to be answered without.

    Raises:
        InputError: it cannot be read, or a name means nothing.
    """
    truth, withheld = _names(cause), _names(withhold or "")
    findings: list[Finding] = []
    if truth != (UNKNOWN,):
        findings += _unknown_names(truth, "cause")
    findings += _unknown_names(withheld, "withhold")
    if not truth:
        findings.append(Finding("cause", "names nothing", "Say it, or 'unknown'"))
    for name in sorted(set(truth) & set(withheld)):
        words, remedy = f"'{name}' is withheld", "Say `cause` unknown, or keep it"
        findings.append(Finding("cause", words, remedy))
    case = None
    try:
        case = read_case(source, gear)
    except InputError as error:
        findings += error.findings
    if findings or case is None:
        raise InputError(findings)
    label = Label(
        case=NAME,
        kind="real",
        truth=truth,
        program="measured",
        rows=len(case.records.force),
        # Of a measurement nobody knows them.
        r=0.0,
        noise="unknown",
        correlation=0.0,
        sigma=0.0,
        withheld=withheld,
    )
    name, material = case.gear.material, None
    if name not in (NO_MATERIAL, *material_names()):
        material = (Path(gear).parent / name).read_bytes()
    return Path(source).read_bytes(), Path(gear).read_bytes(), material, label


def loading_at(source: str) -> Loading:
    """Return what a measurement's rig did, to be done again by the virtual one.

    Raises:
        InputError: it cannot be read.
    """
    with TemporaryDirectory() as folder:
        gear = Path(folder) / "gear.toml"
        gear.write_text(GEAR_TOML, "utf-8")
        # A name of its own: the rigs' loadings have theirs.
        return replace(loading_of(read_case(source, gear)), name="given")


def _names(text: str) -> tuple[str, ...]:
    parts = (part.strip() for part in text.split(","))
    return tuple(dict.fromkeys(part for part in parts if part))


def _unknown_names(names: tuple[str, ...], option: str) -> tuple[Finding, ...]:
    try:
        check_names(list(names), EFFECTS, option)
    except InputError as error:
        return error.findings
    return ()
