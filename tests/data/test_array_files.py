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


@pytest.mark.parametrize("begins", [b"PAR1", b"MATLAB 5.0 MAT-file", b"\x89HDF\r\n"])
def test_a_broken_one_is_refused_in_words(tmp_path, begins):
    (tmp_path / "a").write_bytes(begins + bytes(range(256)) * 4)
    with pytest.raises(InputError, match=r"is (no|an) \S+ file"):
        hdcal.read_case(tmp_path / "a")
