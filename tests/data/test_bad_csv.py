"""A bad table is refused with every finding at its row and column."""

import numpy as np
import pandas as pd
import pytest

from hdcal.data.reading import read_case
from hdcal.errors import InputError

H = "deformation_mm,force_N\n"
GOOD = "0,0\n.1,2\n.2,4\n.3,6\n.4,8\n.5,10\n"
T = "deformation_mm,force_N,time_s\n"
FIVE = "0,0,{}\n1,1,{}\n2,2,{}\n3,3,{}\n4,4,{}\n"
R = "deformation_mm,force_N,run\n"


def timed(*times, header=T):
    return header + FIVE.format(*times)


def fourth(cell):
    return H + GOOD.replace("4\n", f"{cell}\n")


# Content, and (row, column, words) of every finding.
CASES = {
    "empty": ("\n \n\t\n", [(None, None, "empty")]),
    "no header": (GOOD, [(1, None, "contains numbers")]),
    "neither": ("a,b\n" + GOOD, [(1, "deformation", "no c"), (1, "force", "no c")]),
    "negative sd": (
        timed(1, 1, -1, 1, 1, header=T.replace("time_s", "force_sd_N")),
        [(4, "force_sd_N", "between 0 and 1000000000 N")],
    ),
    "long line": (H.encode() + b"1" * ((1 << 20) + 300_000), [(2, None, "1 MiB")]),
    "many at once": (
        "deformation_mm,force_psi,time_s,temperature_C\n"
        "0,0,0,20\nx,1,1,20\n2,2,0.5,-400\n3,3\n4,4,9,inf\n5,5,10,20\n",
        [
            (5, None, "2 cells"),
            (1, "force_psi", "unknown unit"),
            (3, "deformation_mm", "'x'"),
            (6, "temperature_C", "'inf'"),
            (4, "temperature_C", "absolute zero"),
            (4, "time_s", "time decreases"),
        ],
    ),
    "a thousand bad rows": (
        H + "0,0\n" + "".join(f"1,x{k}\n" for k in range(1000)) + "1\n0\n\n" * 30,
        [
            (1003, None, "60 rows in total, also rows 1004, 1006"),
            (
                3,
                "force_N",
                "1000 rows in total, also rows 4, 5, 6, 7, 8, 9 and 993 more",
            ),
        ],
    ),
}
# Content, row, column and words of the only finding.
ONE = [
    (H + "0,0\n1,1\n2,2\n3,3\n", None, None, "4 rows"),
    ("deformation_mm,force\n" + GOOD, 1, "force", "no unit"),
    (fourth("nan"), 4, "force_N", "not a number"),
    (H + GOOD.replace(".2,4", "#DIV/0!,4"), 4, "deformation_mm", "'#DIV/0!' is not a"),
    (fourth("1_0"), 4, "force_N", "not a number"),
    (fourth("-inf"), 4, "force_N", "not a number"),
    (b"PK\x03\x04junk", None, None, "workbook"),
    (
        timed(*"12345", header=H.replace("\n", ",force_kN\n")),
        *(1, "force_kN", "may be 'force_N' or 'force_kN'"),
    ),
    (fourth("1e999"), 4, "force_N", "too large"),
    (fourth("1e200"), 4, "force_N", "does not lie between"),
    (fourth(""), 4, "force_N", "empty"),
    (H + GOOD.replace(".2,4", ".2"), 4, None, "1 cells"),
    (H + GOOD.replace(".2,4", "0,2,4,0"), 4, None, "semicolons"),
    (H + GOOD.replace(".2,4", '".2,4'), 4, None, "close each quotation mark"),
    (H + "1,1\n" * 5, None, "deformation_mm", "constant"),
    (timed("a", "a", " ", "b", "b", header=R), 4, "run", "label is empty"),
    (H + GOOD.replace(".5", "500"), 7, "deformation_mm", "radius"),
    ("\n" + H + "0,0\n\n\n1,1\n2,oops\n3,3\n4,4\n5,5\n", 7, "force_N", "'oops'"),
    (H.encode() + b"0,0\n\0\1\n", None, None, "binary"),
    (b"\xff\xfea\0b", None, None, "UTF-16"),
    (f"deformation_mm,force[{' ' * 50_000}x\n" + GOOD, 1, "force", "no column"),
]
CASES |= {
    f"{place}: {where[-1]}": (text, [where]) for place, (text, *where) in enumerate(ONE)
}


def findings_of(*args, **options):
    with pytest.raises(InputError) as caught:
        read_case(*args, **options)
    return caught.value.findings


def check(findings, expected):
    found = {(f.row, f.column): f"{f.problem}. {f.remedy}" for f in findings}
    assert len(findings) == len(expected), [str(f) for f in findings]
    for row, column, words in expected:
        assert words in found[row, column]
    assert all(f.remedy and "\n" not in str(f) for f in findings)


@pytest.mark.parametrize("name", CASES)
def test_bad_table(folder, name):
    content, expected = CASES[name]
    raw = content if isinstance(content, bytes) else content.encode()
    (folder / "data.csv").write_bytes(raw)
    findings = findings_of(folder)
    check(findings, expected)
    assert {f.file for f in findings} == {str(folder / "data.csv")}


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        ({"force": "Load[N]"}, (1, "Load", "does not exist")),
        ({"force": "force_N[psi]"}, (1, "force_N", "'psi'")),
        ({"force": "extra"}, (1, "extra", "[UNIT]")),
        ({"forse": "force_N[N]"}, (None, None, "mean 'force'")),
        ({"time": "force_N[s]"}, (1, "force_N", "both as force and as time")),
        ({"time": "twin[s]"}, (1, "twin", "matches 2 columns")),
    ],
)
def test_bad_mapping(folder, columns, expected):
    content = "deformation_mm,force_N,extra,twin,twin\n"
    content += "".join(f"{i},{i},{i},{i},{i}\n" for i in range(6))
    (folder / "data.csv").write_text(content)
    check(findings_of(folder, columns=columns), [expected])


@pytest.mark.parametrize("torn", ["0.005,1.0,20.5,start", "0.005,1.0"])
@pytest.mark.parametrize(
    "above", ["", "Test of today\ndeformation_mm,force_N,temperature_C\n"]
)
def test_a_first_reading_that_is_torn_is_no_title(folder, torn, above):
    rows = "".join(f"{x / 100},{2 * x},{20 + x % 2}.5\n" for x in range(1, 12))
    (folder / "data.csv").write_text(f"{above}{torn}\n{rows}")
    columns = {} if above else {"deformation": "1[mm]", "force": "2[N]"}
    found = findings_of(folder, columns=columns)
    check(found, [(above.count("\n") + 1, None, f"{torn.count(',') + 1} cell")])


def test_missing_files_are_reported_together(tmp_path):
    findings = findings_of(tmp_path / "a.csv", tmp_path / "b.toml")
    assert [f.problem for f in findings] == ["does not exist"] * 2
    assert len(findings_of("no\0where.csv", tmp_path / "b.toml")) == 2


def test_a_folder_is_a_case_of_two_files(folder):
    (folder / "gear.toml").unlink()
    (folder / "data.csv").write_text(H)
    assert "does not exist" in findings_of(folder)[1].problem


def labelled(folder, *columns):
    """Write twelve rows with columns of labels, and return the file."""
    table = pd.DataFrame({"Weg [mm]": np.arange(12.0) / 100, "Kraft [N]": range(12)})
    for header, *cells in columns:
        table[header] = np.repeat(cells, 12 // len(cells))
    table.to_csv(folder / "data.csv", index=False)
    return folder / "data.csv"


def test_two_columns_that_may_both_name_the_gear_are_asked_about(folder):
    data = labelled(folder, ("Prüfling", 1, 2), ("Seriennummer", *"wxyz"))
    expected = [(1, "Seriennummer", "the specimen may be 'Prüfling' or 'Seriennummer'")]
    check(findings_of(folder), expected)
    assert read_case(data, columns={"specimen": "4"}).specimen_labels == (*"wxyz",)
    # Columns that tell the same rows apart are no question.
    gears = ("Prüfling", 1, 2), ("Seriennummer", "s7", "s9"), ("Probe", "ring")
    assert read_case(labelled(folder, *gears)).specimen_labels == ("1", "2")


def test_one_of_several_specimens_is_read_alone(folder):
    data = labelled(folder, ("Prüfling", "a/1", "b"), ("Messung", 1, 2, 3, 4))
    whole, case = read_case(data), read_case(data, specimen="b")
    assert case.name == "data-b" and read_case(data, specimen="a/1").name == "data-a_1"
    assert case.specimen_labels == ("b",) and case.run_labels == ("3", "4")
    assert np.array_equal(case.records.force, whole.records.force[6:])
    assert not {"specimen", "specimens"} & case.records.known
    with pytest.raises(InputError, match="The specimens are 'a/1', 'b'"):
        read_case(data, specimen="x")
    table = pd.read_csv(data)
    table.loc[6:, "Weg [mm]"] = 0.1
    with pytest.raises(InputError, match="the deformation of specimen 'b' is constant"):
        read_case(table, specimen="b")
