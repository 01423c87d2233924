"""Parquet and MATLAB files are read as the tables that they hold."""

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

import hdcal
from hdcal.errors import InputError

DEFORMATION = np.linspace(0.0, 0.5, 6)
FORCE = np.array([0.5, 21.0, 41.5, 62.0, 82.5, 1.0 / 3.0])
FRAME = pd.DataFrame({"Weg [mm]": DEFORMATION, "force_N": FORCE})


def check(case: hdcal.Case, told: str = "") -> None:
    np.testing.assert_array_equal(case.records.deformation, DEFORMATION)
    np.testing.assert_array_equal(case.records.force, FORCE)
    assert told in " ".join(case.notes)


def test_parquet(tmp_path):
    FRAME.to_parquet(tmp_path / "a.parquet")
    check(hdcal.read_case(tmp_path / "a.parquet"), "'Weg [mm]' is the deformation")


@pytest.mark.parametrize("shape", [(6,), (6, 1), (1, 6)])
def test_vectors_of_a_mat_file(tmp_path, shape):
    """Beside what else a workspace holds: a rate, a name, a picture."""
    held = {"deformation_mm": DEFORMATION.reshape(shape)}
    held |= {"force_N": FORCE.reshape(shape), "fs": 2500.0, "who": "M. K."}
    savemat(tmp_path / "a.mat", held | {"picture": np.zeros((30, 40))})
    check(hdcal.read_case(tmp_path / "a.mat"))


def test_a_structure_of_a_mat_file(tmp_path):
    savemat(tmp_path / "a.mat", {"log": {"deformation_mm": DEFORMATION, "F": FORCE}})
    check(hdcal.read_case(tmp_path / "a.mat", columns={"force": "F[N]"}))


def test_a_matrix_of_a_mat_file(tmp_path):
    savemat(tmp_path / "a.mat", {"data": np.stack([FORCE, DEFORMATION], axis=1)})
    asked = {"deformation": "2[mm]", "force": "1[N]"}
    check(hdcal.read_case(tmp_path / "a.mat", columns=asked), "the matrix 'data'")
    with pytest.raises(InputError, match="numbers where the headers should be"):
        hdcal.read_case(tmp_path / "a.mat")


def test_what_cannot_be_told_is_refused(tmp_path):
    several = {"a": FORCE, "b": FORCE, "c": np.zeros(9), "d": np.zeros(9)}
    savemat(tmp_path / "a.mat", several)
    with pytest.raises(InputError, match="holds no one table of readings: 'a', 'b'"):
        hdcal.read_case(tmp_path / "a.mat")
    savemat(tmp_path / "b.mat", {"note": "nothing here"})
    with pytest.raises(InputError, match="no arrays"):
        hdcal.read_case(tmp_path / "b.mat")


def test_what_is_not_read_of_a_mat_file_is_told(tmp_path):
    held = {"deformation_mm": DEFORMATION, "force_N": FORCE, "run": ["a"] * 6}
    savemat(tmp_path / "a.mat", {**held, "temperature_C": np.zeros(5)})
    check(hdcal.read_case(tmp_path / "a.mat"), "not read of the file: 'run', 'temper")
    runs = {"deformation_mm": DEFORMATION, "force_N": FORCE}
    savemat(tmp_path / "b.mat", {"up": runs, "down": runs})
    with pytest.raises(InputError, match="'deformation_mm', 'force_N' more than once"):
        hdcal.read_case(tmp_path / "b.mat")


def test_arrays_have_no_encoding(tmp_path):
    FRAME.to_parquet(tmp_path / "a.parquet")
    with pytest.raises(InputError, match="has no `encoding`"):
        hdcal.read_case(tmp_path / "a.parquet", encoding="utf-8")


@pytest.mark.parametrize("begins", [b"PAR1", b"MATLAB 5.0 MAT-file", b"\x89HDF\r\n"])
def test_a_broken_one_is_refused_in_words(tmp_path, begins):
    (tmp_path / "a").write_bytes(begins + bytes(range(256)) * 4)
    with pytest.raises(InputError, match=r"is (no|an) \S+ file"):
        hdcal.read_case(tmp_path / "a")
