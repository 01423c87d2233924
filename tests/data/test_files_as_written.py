"""Files as machines and people write them are read as they are meant, or refused.

To read a file wrongly in silence is the only unforgivable error.
"""

import numpy as np
import pytest

from hdcal.data.reading import read_case
from hdcal.errors import InputError

# Six readings in mm and N, and in °C.
DEFORMATION = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
FORCE = np.array([0.5, 21.0, 41.5, 62.0, 82.5, 103.0])
TEMPERATURE = np.array([20.0, 20.5, 21.0, 21.5, 22.0, 22.5])


def lines(separator=",", decimal=".", force=1.0, more=None) -> list[str]:
    """Return the readings as lines of text; `force` is its unit in newtons."""
    table = [DEFORMATION, FORCE / force, *([] if more is None else [more])]
    rows = zip(*table, strict=True)
    cells = [[f"{cell:.6g}".replace(".", decimal) for cell in row] for row in rows]
    return [separator.join(row) + "\n" for row in cells]


def text(*parts: str | list[str]) -> str:
    return "".join("".join(part) for part in parts)


BODY, SEMI, TABS = lines(), lines(";", ","), lines("\t")
WARM = lines(";", ",", more=TEMPERATURE)
GERMAN = text("Weg [mm];Kraft [N];Temperatur [°C]\n", WARM)
TWO_RUNS = {"run": [0, 0, 0, 1, 1, 1]}
LABVIEW = "LabVIEW Measurement\t\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
BY_NUMBER = {"columns": {"deformation": "1[mm]", "force": "2[N]"}}
# Content; further columns as they are meant; further arguments of `read_case`.
FILES = {
    "a preamble of a test controller": (
        text(
            "MTS793|BTW|ENU|1|2|.|/|:|1|0|0|A\n\nData Header:,,,\nTime:,12.3,Sec,\n"
            "Data Acquisition\nStation Name: rig 4\n"
            "Axial Displacement (mm),Axial Force (kN)\n",
            lines(force=1000.0),
        ),
    ),
    "a row of units": (text("Displacement,Force\nmm,N\n", BODY),),
    "German": ("Prüfprotokoll 4711\n\n" + GERMAN, {"temperature": TEMPERATURE}),
    "Windows-1252 with a degree sign": (
        *(GERMAN.encode("cp1252"), {"temperature": TEMPERATURE}),
    ),
    "Chinese": (text("位移(mm),力(N)\n", BODY),),
    "Chinese in GB18030": (
        text("试验报告\n位移(mm),载荷(kN)\n", lines(force=1e3)).encode("gb18030"),
    ),
    "marked headers": (
        text("# displacement_mm force is in N\n# displacement_mm\tload_N\n", TABS),
    ),
    "no headers": (text(BODY), {}, BY_NUMBER),
    "UTF-16": (text("deformation_mm\tforce_N\n", TABS).encode("utf-16"),),
    "one header twice": (
        text("Weg [mm],Kraft [N],Kraft [N]\n", lines(more=FORCE + 1.0)),
        *({}, {"columns": {"force": "2"}}),
    ),
    "columns separated by blanks": (
        text("  deformation_mm    force_N\n", lines("      ")),
    ),
    "a logger started twice": (
        text("Weg [mm];Kraft [N]\n", SEMI[:3], "\n\nMessung 2\n")
        + text("Weg [mm];Kraft [N]\n", SEMI[3:]),
        TWO_RUNS,
    ),
    "units behind a slash": (text("Weg / mm;Load / kN\n", lines(";", ",", 1e3)),),
    "a setpoint": (
        text("Displacement setpoint (mm),Displacement (mm),Force (N)\n")
        + "".join(f"9,{row}" for row in BODY),
    ),
    "blocks that name their run": (
        "deformation_mm,force_N,Mounting\n"
        + "".join(f"{row[:-1]},7\n" for row in BODY[:3])
        + "deformation_mm,force_N,Mounting\n"
        + "".join(f"{row[:-1]},8\n" for row in BODY[3:]),
        *(TWO_RUNS, {"columns": {"run": "Mounting"}}),
    ),
    "a footer": (
        text("deformation_mm,force_N\n", BODY, "\nEnd of test\nOperator: M. K.\n"),
    ),
    "LabVIEW, a block for each run": (
        LABVIEW
        + "".join(
            "Samples\t40\t40\n***End_of_Header***\t\nWeg (mm)\tKraft (N)\tComment\n"
            + "".join(f"{row[:-1]}\t\n" for row in TABS[k : k + 3])
            + "\n"
            for k in (0, 3)
        ),
        TWO_RUNS,
    ),
    "LabVIEW with a time": (
        LABVIEW + "X_Dimension\tTime\tTime\t\nX0\t0\t0\t\nDelta_X\t0.5\t0.5\t\n"
        "***End_of_Header***\t\t\t\nX_Value\tWeg (mm)\tKraft (N)\tComment\n"
        + "".join(f"{k}\t{row[:-1]}\t\n" for k, row in enumerate(TABS)),
        {"time": [0, 1, 2, 3, 4, 5]},
    ),
    "LabVIEW with a comment on the first reading": (
        LABVIEW + "Y_Unit_Label\tMillimeter\tkN\t\nX0\t0\t0\t\n"
        "***End_of_Header***\t\t\t\nX_Value\tWeg (um)\tKraft\tComment\n"
        + "".join(
            f"{k}\t{1000 * x:.6f}\t{y / 1000:.9f}" + ("\n" if k else "\tstart\n")
            for k, (x, y) in enumerate(zip(DEFORMATION, FORCE, strict=True))
        ),
    ),
    "points for thousands beside decimal commas": (
        "Weg [mm];Kraft [mN]\n"
        + "".join(
            f"{x:.6f};{1000 * y:,.6f}\n".translate(str.maketrans(",.", ".,"))
            for x, y in zip(DEFORMATION, FORCE, strict=True)
        ),
    ),
    "a mean and a remark in cells": (
        text("Prüfling,Weg [mm],Kraft [N]\n", [f"A,{row}" for row in BODY])
        + ",,\nMittelwert:,0.25,52\nBemerkung: i.O.,,\n",
    ),
    "labels of merged cells": (
        "Prüfling,Weg [mm],Kraft [N]\n"
        + "".join(f"{'' if k % 3 else 'AB'[k // 3]},{r}" for k, r in enumerate(BODY)),
        {"specimen": TWO_RUNS["run"]},
    ),
}


def read(folder, content: str | bytes, **asked):
    """Return the case of a file beside a gear file."""
    raw = content if isinstance(content, bytes) else content.encode()
    (folder / "data.csv").write_bytes(raw)
    return read_case(folder, **asked)


@pytest.mark.parametrize("habit", FILES)
def test_a_file_is_read_as_it_is_meant(folder, habit):
    content, also, asked, *_ = (*FILES[habit], {}, {})
    case = read(folder, content, **asked)
    np.testing.assert_allclose(case.records.deformation, DEFORMATION, atol=1e-12)
    np.testing.assert_allclose(case.records.force, FORCE, rtol=1e-12)
    for name, values in also.items():
        np.testing.assert_allclose(getattr(case.records, name), values)
    assert case.records.known >= {*also}
    # Assumptions come first among the notes.
    assumed = [note.startswith("ASSUMED") for note in case.notes]
    assert assumed == sorted(assumed, reverse=True)
    assert any(assumed) or habit in ("UTF-16", "no headers", "a footer")


REFUSED = [
    (
        text("Displacement (mm),Force left (N),Force right (N)\n", lines(more=FORCE)),
        "the force may be 'Force left (N)' or 'Force right (N)'",
    ),
    (
        text("Displacement (mm),Load (g)\n", BODY),
        "g is a mass; the unit of its weight is gf",
    ),
    (
        "Weg [mm];Kraft [N]\n" + "".join(f"0,{k}00;1.70{k}\n" for k in range(6)),
        "decimal point among decimal commas",
    ),
    (
        "Weg [mm]\tKraft [N]\n" + "".join(f"0.{k}00\t1,70{k}\n" for k in range(6)),
        "decimal point among decimal commas",
    ),
    (
        "Weg [um];Kraft [N]\n100;380\n200;567\n300;734\n400;981\n500;1.234\n",
        "'1.234' may be in thousands",
    ),
    (
        "Weg [mm];Kraft [N]\n0,1;0,5\n0,2;2,5\n0,3;4,5\n0,4;10.04,00\n0,5;8,5\n",
        "row 5, column 'Kraft [N]': '10.04,00' is not a number",
    ),
    (text("Weg [mm];Kraft [N]\nmm;kN\n", SEMI), "states N, but the row of units kN"),
    (
        text("deformation_mm;force_N\n", lines(";"), "0.6;ERR\n0.7\n")
        + text("deformation_mm;force_N\n", lines(";")),
        "'ERR' is not a number",
    ),
    (
        "clock,deformation_mm,force_N\n"
        + "".join(
            f"2026-11-25T10:0{k},{row[:-1]}" + (",x\n" if k > 3 else "\n")
            for k, row in enumerate(BODY)
        ),
        "has 4 cells where the header row has 3",
    ),
]


@pytest.mark.parametrize(("content", "words"), REFUSED)
def test_what_can_be_meant_in_two_ways_is_asked(folder, content, words):
    with pytest.raises(InputError) as caught:
        read(folder, content)
    assert any(words in str(finding) for finding in caught.value.findings)


def test_a_gear_file_names_columns(folder):
    """And `columns` overrides it."""
    content = text("left,right,middle\n", lines(more=FORCE + 1.0))
    gear = folder / "gear.toml"
    table = '\n[columns]\ndeformation = "left[mm]"\nforce = "middle[N]"\n'
    gear.write_text(gear.read_text("utf-8") + table, "utf-8")
    np.testing.assert_allclose(read(folder, content).records.force, FORCE + 1.0)
    case = read(folder, content, columns={"force": "right[N]"})
    np.testing.assert_allclose(case.records.force, FORCE)
    with pytest.raises(InputError, match="the `encoding` 'klingon' is unknown"):
        read(folder, content, encoding="klingon")


def test_that_a_deformation_is_radial_is_an_assumption(folder):
    """A diametral reading would double K."""
    assert not read_case(folder).notes
    gear = folder / "gear.toml"
    silent = gear.read_text("utf-8").replace('deformation = "radial"', "")
    gear.write_text(silent, "utf-8")
    notes = read_case(folder).notes
    assert [note for note in notes if note.startswith("ASSUMED: the deformation is r")]
