"""Files as machines and people write them are read as they are meant, or refused.

Each file copies a habit that its name tells; what it means stands beside it. To read
one wrongly in silence is the only unforgivable error.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pytest

from hdcal.data.reading import read_case
from hdcal.errors import InputError

GEAR_TOML = """\
[gear]
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = 70.0
material = "40CrNiMoA"

[measurement]
deformation = "radial"
"""
# Six readings in mm and N.
DEFORMATION = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
FORCE = np.array([0.5, 21.0, 41.5, 62.0, 82.5, 103.0])
TEMPERATURE = np.array([20.0, 20.5, 21.0, 21.5, 22.0, 22.5])


class Written(NamedTuple):
    """A file, how it is asked to be read, and what is told of it.

    Attributes:
        content: text, or bytes in another encoding.
        told: parts of the notes, in their order.
        asked: further arguments of `read_case`.
        also: further columns as they are meant.
    """

    content: str | bytes
    told: tuple[str, ...] = ()
    asked: Mapping = MappingProxyType({})
    also: Mapping = MappingProxyType({})


def lines(
    separator=",",
    decimal=".",
    force=1.0,
    more=None,
    end="",
    form="{:.6g}",
    stretch=1.0,
):
    """Return the readings as lines of text.

    Args:
        separator: of the cells.
        decimal: sign of the numbers.
        force: unit of the force in newtons.
        more: a third column.
        end: what stands behind each line.
        form: of each number.
        stretch: factor on the deformation.
    """
    table = [stretch * DEFORMATION, FORCE / force, *([] if more is None else [more])]
    rows = [
        separator.join(form.format(cell).replace(".", decimal) for cell in row) + end
        for row in zip(*table, strict=True)
    ]
    return "\n".join(rows) + "\n"


BODY, SEMI = lines(), lines(";", ",")
WARM = {"temperature": TEMPERATURE}
FILES = {
    "hdcal's own": Written("deformation_mm,force_N\n" + BODY),
    "a title above the headers": Written(
        "Flexspline 12, second mounting\ndeformation_mm,force_N\n" + BODY,
        ("1 line above",),
    ),
    "six lines of preamble as a test controller writes them": Written(
        "MTS793|BTW|ENU|1|2|.|/|:|1|0|0|A\n\nData Header:,,,\nTime:,12.3,Sec,\n"
        "Data Acquisition\nStation Name: rig 4\n"
        "Axial Displacement (mm),Axial Force (kN)\n" + lines(force=1000.0),
        ("lines above", "'Axial Displacement (mm)'", "'Axial Force (kN)'"),
    ),
    "units in a second header row": Written(
        "Displacement,Force\nmm,N\n" + BODY,
        ("row 2 taken for the units", "'Displacement [mm]'", "'Force [N]'"),
    ),
    "German, of a testing machine": Written(
        "Prüfprotokoll 4711\n\nWeg [mm];Kraft [N];Temperatur [°C]\n"
        + lines(";", ",", more=TEMPERATURE),
        ("1 line above", "'Weg [mm]' is the deformation", "'Kraft [N]' is the force"),
        also=WARM,
    ),
    "Windows-1252 with nothing but a degree sign": Written(
        (
            "Weg [mm];Kraft [N];Temperatur [°C]\n" + lines(";", ",", more=TEMPERATURE)
        ).encode("cp1252"),
        ("the text is cp1252", "'Temperatur [°C]' is the temperature"),
        also=WARM,
    ),
    "Windows-1252 with nothing but micrometres": Written(
        ("Weg [µm];Kraft [N]\n" + lines(";", ",", stretch=1000.0)).encode("cp1252"),
        ("the text is cp1252", "'Weg [µm]' is the deformation in um"),
    ),
    "two columns of one header, one named by its number": Written(
        "Weg [mm],Kraft [N],Kraft [N]\n" + lines(more=FORCE + 1.0),
        ("'Weg [mm]' is the deformation",),
        {"columns": {"force": "2"}},
    ),
    "French": Written(
        "Déplacement (mm);Effort (N)\n" + SEMI, ("'Déplacement (mm)'", "'Effort (N)'")
    ),
    "Chinese": Written("位移(mm),力(N)\n" + BODY, ("'位移(mm)'", "'力(N)'")),
    "Chinese in GB18030": Written(
        ("试验报告\n位移(mm),载荷(kN)\n" + lines(force=1000.0)).encode("gb18030"),
        ("the text is gb18030", "1 line above", "'位移(mm)'", "'载荷(kN)'"),
    ),
    "UTF-16 with its mark, tabs": Written(
        ("deformation_mm\tforce_N\n" + lines("\t")).encode("utf-16")
    ),
    "a logger that marks its headers": Written(
        "# displacement_mm force is in N\n# displacement_mm\tload_N\n" + lines("\t"),
        ("1 line above", "'displacement_mm'", "'load_N'"),
    ),
    "no headers, columns by number": Written(
        BODY, (), {"columns": {"deformation": "1[mm]", "force": "2[N]"}}
    ),
    "kilonewtons behind a slash": Written(
        "Travel / mm;Load / kN\n" + lines(";", ",", 1000.0),
        ("'Travel / mm'", "'Load / kN' is the force in kN"),
    ),
    "a setpoint beside what was reached": Written(
        "Displacement setpoint (mm),Displacement (mm),Force (N)\n"
        + "\n".join(f"9,{row}" for row in BODY.split() if row)
        + "\n",
        ("'Displacement (mm)' is the deformation",),
    ),
    "a column that says which gear": Written(
        "deformation_mm,force_N,gear\n" + lines(more=np.array([7, 7, 7, 8, 8, 8.0])),
        ("'gear' is the specimen",),
        also={"specimen": [0, 0, 0, 1, 1, 1]},
    ),
    "columns separated by blanks, as a simulation writes them": Written(
        "  deformation_mm    force_N\n" + lines("      ", form="{:12.5f}", decimal="."),
        ("separated by blanks",),
    ),
    "blanks behind the commas": Written(
        "Deformation [mm], Force [N]\n" + lines(", "), ("'Deformation [mm]'",)
    ),
    "blocks, and somebody says which column is the run": Written(
        "deformation_mm,force_N,Mounting\n"
        + "".join(f"{row},7\n" for row in BODY.split()[:3])
        + "deformation_mm,force_N,Mounting\n"
        + "".join(f"{row},8\n" for row in BODY.split()[3:]),
        ("the headers stand 2 times. If not",),
        {"columns": {"run": "Mounting"}},
        also={"run": [0, 0, 0, 1, 1, 1]},
    ),
    "a footer": Written(
        "deformation_mm,force_N\n" + BODY + "\nEnd of test\nOperator: M. K.\n",
        ("no readings: rows 9, 10",),
    ),
    "a logger started twice, each time with its headers": Written(
        "Weg [mm];Kraft [N]\n"
        + "\n".join(SEMI.split("\n")[:3])
        + "\n\nMessung 2\nWeg [mm];Kraft [N]\n"
        + "\n".join(SEMI.split("\n")[3:]),
        ("the headers stand 2 times", "'Weg [mm]'"),
        also={"run": [0, 0, 0, 1, 1, 1]},
    ),
    "LabVIEW, a block for each run": Written(
        "LabVIEW Measurement\t\nWriter_Version\t2\n***End_of_Header***\t\n\n"
        + "".join(
            "Channels\t2\t\nSamples\t40\t40\n***End_of_Header***\t\n"
            "Weg (mm)\tKraft (N)\tComment\n"
            + "".join(f"{row}\t\n" for row in lines("\t").split("\n")[k : k + 3])
            + "\n"
            for k in (0, 3)
        ),
        ("lines above the table", "the headers stand 2 times", "no readings: rows 13"),
        also={"run": [0, 0, 0, 1, 1, 1]},
    ),
    "LabVIEW, with the numbers of each channel above the headers": Written(
        "LabVIEW Measurement\t\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
        "X_Dimension\tTime\tTime\t\nX0\t0\t0\t\nDelta_X\t0.5\t0.5\t\n"
        "***End_of_Header***\t\t\t\nX_Value\tWeg (mm)\tKraft (N)\tComment\n"
        + "".join(
            f"{k}\t{row}\t\n" for k, row in enumerate(lines("\t").strip().split("\n"))
        ),
        ("lines above the table", "'X_Value (Time) [s]' is the time in s"),
        also={"time": [0, 1, 2, 3, 4, 5]},
    ),
    "a mean and a remark below the readings, in cells of the table": Written(
        "Prüfling,Weg [mm],Kraft [N]\n"
        + "".join(f"A,{row}\n" for row in lines().strip().split("\n"))
        + ",,\nMittelwert:,0.25,52\nBemerkung: i.O.,,\n",
        ("'Prüfling' is the specimen",),
    ),
    "labels in the first row of what they name, as merged cells are": Written(
        "Prüfling,Weg [mm],Kraft [N]\n"
        + "".join(
            f"{'AB'[k // 3] * (k % 3 == 0)},{row}\n"
            for k, row in enumerate(lines().strip().split("\n"))
        ),
        ("'Prüfling' is the specimen", "'Prüfling' stands in the first row of each"),
        also={"specimen": [0, 0, 0, 1, 1, 1]},
    ),
    "LabVIEW, the first reading with a comment and no cell for one below it": Written(
        "LabVIEW Measurement\t\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
        "Y_Unit_Label\tMillimeter\tkN\t\nX0\t0\t0\t\n"
        "***End_of_Header***\t\t\t\nX_Value\tWeg (um)\tKraft\tComment\n"
        + "".join(
            f"{k}\t{1000 * x:.6f}\t{y / 1000:.9f}"
            + "\tstart\n" * (k == 0)
            + "\n" * (k > 0)
            for k, (x, y) in enumerate(zip(DEFORMATION, FORCE, strict=True))
        ),
        ("lines above the table", "'X_Value'"),
    ),
    "a temperature without a unit": Written(
        "Weg [mm];Kraft [N];Temperatur\n" + lines(";", ",", more=TEMPERATURE),
        ("'Temperatur', which may be the temperature, is not used",),
    ),
}


def read(folder, written: Written, more: str = ""):
    """Return the case of a file beside a gear file."""
    raw = written.content
    (folder / "data.csv").write_bytes(raw if isinstance(raw, bytes) else raw.encode())
    (folder / "gear.toml").write_text(GEAR_TOML + more)
    return read_case(folder, **written.asked)


@pytest.mark.parametrize("habit", FILES)
def test_a_file_is_read_as_it_is_meant(tmp_path, habit):
    written = FILES[habit]
    case = read(tmp_path, written)
    np.testing.assert_allclose(case.records.deformation, DEFORMATION, atol=1e-12)
    np.testing.assert_allclose(case.records.force, FORCE, rtol=1e-12)
    for name, values in written.also.items():
        assert name in case.records.known
        np.testing.assert_allclose(getattr(case.records, name), values)
    told = "\n".join(case.notes)
    place = 0
    for part in written.told:
        assert part in told[place:], told
        place = told.index(part, place)
    # What was guessed is told first and says how to correct it.
    guessed = [note.startswith("ASSUMED") for note in case.notes]
    assert guessed == sorted(guessed, reverse=True)
    own = habit == "hdcal's own"
    assert not (own and any(guessed))


REFUSED = {
    "two columns that may be the force": (
        "Displacement (mm),Force left (N),Force right (N)\n" + lines(more=TEMPERATURE),
        "the force may be 'Force left (N)' or 'Force right (N)'",
    ),
    "a force without a unit": (
        "Displacement (mm),Force\n" + BODY,
        "the header names no unit",
    ),
    "a mass for a force": (
        "Displacement (mm),Load (g)\n" + BODY,
        "g is a mass; its weight is gf",
    ),
    "thousands marked by points beside decimal commas": (
        "Weg [mm];Kraft [N]\n" + "".join(f"0,{k}00;1.70{k}\n" for k in range(6)),
        "decimal point among decimal commas",
    ),
    "thousands marked by points in a column without decimals": (
        "Weg [um];Kraft [N]\n"
        "100;380\n200;567\n300;734\n400;981\n500;1.234\n600;1.402\n",
        "'1.234' may be a thousand",
    ),
    "a broken reading above a repeated header": (
        "deformation_mm;force_N\n" + lines(";") + "0.6;ERR\n0.7\n"
        "deformation_mm;force_N\n" + lines(";"),
        "'ERR' is not a number",
    ),
    "a cell more in the last rows, which begin with a time": (
        "clock,deformation_mm,force_N\n"
        + "".join(
            f"2026-11-25T10:0{k},{row}" + ",x" * (k > 3) + "\n"
            for k, row in enumerate(BODY.split())
        ),
        "has 4 cells where the header row has 3",
    ),
    "thousands marked by commas beside decimal points": (
        "Weg [mm]\tKraft [N]\n" + "".join(f"0.{k}00\t1,70{k}\n" for k in range(6)),
        "decimal point among decimal commas",
    ),
    "a reading that breaks off": (
        "deformation_mm,force_N\n" + BODY + "0.6\n",
        "has 1 cells where the header row has 2",
    ),
    "an encoding that does not exist": (
        "deformation_mm,force_N\n" + BODY,
        "the `encoding` 'klingon' is unknown",
    ),
}


@pytest.mark.parametrize("habit", REFUSED)
def test_what_can_be_meant_in_two_ways_is_asked(tmp_path, habit):
    content, words = REFUSED[habit]
    asked = {"encoding": "klingon"} if "encoding that" in habit else {}
    with pytest.raises(InputError) as caught:
        read(tmp_path, Written(content, asked=asked))
    assert any(words in str(finding) for finding in caught.value.findings)
    told = [finding.problem for finding in caught.value.findings]
    asks = [w for w in told if "may be the" in w or "no column" in w]
    assert len(asks) <= 1


def test_a_gear_file_says_which_column_is_which(tmp_path):
    """And `columns` says otherwise."""
    content = "left,right,middle\n" + lines(more=FORCE + 1.0)
    table = '\n[columns]\ndeformation = "left[mm]"\nforce = "middle[N]"\n'
    case = read(tmp_path, Written(content), table)
    np.testing.assert_allclose(case.records.force, FORCE + 1.0)
    asked = {"columns": {"force": "right[N]"}}
    case = read(tmp_path, Written(content, asked=asked), table)
    np.testing.assert_allclose(case.records.force, FORCE)


def test_that_a_deformation_is_radial_is_assumed_where_nobody_says_so(tmp_path):
    """A diametral reading would double K."""
    said = read(tmp_path, FILES["hdcal's own"])
    (tmp_path / "gear.toml").write_text(GEAR_TOML.replace('deformation = "radial"', ""))
    unsaid = read_case(tmp_path)
    assert not said.notes
    assert [note for note in unsaid.notes if note.startswith("ASSUMED: the deform")]
