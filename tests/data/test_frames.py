"""A table in memory is read as its file would be, to the last digit."""

import numpy as np
import pandas as pd
import pytest

import hdcal
from hdcal.errors import InputError

RNG = np.random.default_rng(3)
FRAME = pd.DataFrame(
    {
        "deformation_mm": np.linspace(0.0, 0.5, 9) + RNG.normal(0.0, 1e-9, 9),
        "Kraft [kN]": RNG.normal(0.05, 0.01, 9),
        "run": ["a"] * 5 + ["b"] * 4,
        "time_s": np.arange(9.0),
    }
)


@pytest.mark.parametrize("kind", ["frame", "arrays", "becomes one"])
def test_it_says_what_its_file_says(folder, kind):
    class Other:
        """Another library's table."""

        def to_pandas(self):
            return FRAME

    given = {"frame": FRAME, "arrays": dict(FRAME), "becomes one": Other()}[kind]
    FRAME.to_csv(folder / "log.csv", index=False)
    gear = folder / "gear.toml"
    found, read = (
        hdcal.read_case(given, gear),
        hdcal.read_case(folder / "log.csv", gear),
    )
    for name in ("deformation", "force", "time", "run", "sense"):
        np.testing.assert_array_equal(
            getattr(found.records, name), getattr(read.records, name)
        )
    np.testing.assert_array_equal(found.records.deformation, FRAME["deformation_mm"])
    assert found.run_labels == ("a", "b")
    assert found.name == "DataFrame"
    assert "'Kraft [kN]' is the force in kN" in found.notes[0]


def test_what_is_wrong_is_told_by_row_and_column(folder):
    wrong = FRAME.assign(**{"Kraft [kN]": [*FRAME["Kraft [kN]"][:-1], np.nan]})
    with pytest.raises(InputError) as caught:
        hdcal.read_case(wrong, folder / "gear.toml")
    (found,) = caught.value.findings
    assert (found.file, found.row, found.column) == ("DataFrame", 10, "Kraft [kN]")
    unequal = {"deformation_mm": np.zeros(6), "force_N": np.zeros(5)}
    with pytest.raises(InputError, match="is no table"):
        hdcal.read_case(unequal, folder / "gear.toml")
    with pytest.raises(InputError, match="no gear file was named"):
        hdcal.read_case(FRAME)
