"""A measurement with a stated cause, as the one case of a sealed set."""

from pathlib import Path

import hdcal
from benchmarks.blind.label import OUTSIDE, Label
from benchmarks.blind.sealed_set import GEAR, refusal
from hdcal.errors import Finding, InputError

# The name of the measured file may give its cause away.
NAME = "case"


def sealed_measurement(
    table: Path, gear: Path, cause: str, withhold: str = ""
) -> tuple[bytes, Label, dict[str, bytes]]:
    """Return the table, its label, and the gear file with a material file it names.

    Args:
        table: a CSV file.
        gear: its gear file.
        cause: effects each of which would be right, or `outside`.
        withhold: effects that it is to be answered without.

    Raises:
        InputError: the measurement cannot be read, or a name is no effect.
    """
    truth, withheld = _names(cause), tuple(sorted(_names(withhold)))
    allowed = {*hdcal.EFFECTS} - {*withheld}
    if truth == (OUTSIDE,):
        truth, wrong = (OUTSIDE,), {*withheld} - {*hdcal.EFFECTS}
    else:
        wrong = {*truth} - allowed | {*withheld} - {*hdcal.EFFECTS}
    if wrong or not truth:
        words = f"no effect that is not withheld: {', '.join(sorted(wrong)) or 'none'}"
        remedy = f"Give effects of the library, or the cause '{OUTSIDE}'"
        raise InputError([Finding("cause", words, remedy)])
    case = hdcal.read_case(table, gear)
    files, material = {GEAR: gear.read_bytes()}, gear.parent / case.gear.material
    if material.is_file():
        if material.parent != gear.parent or material.suffix != ".toml":
            words = f"names the material file {case.gear.material}"
            raise refusal(gear, words, "Put a .toml file next to the gear file")
        files[material.name] = material.read_bytes()
    # The size of the gap and the noise of a measurement are not known.
    label = Label(
        case=NAME,
        kind="real",
        truth=truth,
        program="measured",
        rows=len(case.records.force),
        r=0.0,
        noise="unknown",
        correlation=0.0,
        sigma=0.0,
        withheld=withheld,
    )
    return table.read_bytes(), label, files


def _names(text: str) -> tuple[str, ...]:
    parts = (part.strip() for part in text.split(","))
    return tuple(dict.fromkeys(part for part in parts if part))
