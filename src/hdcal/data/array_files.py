"""Tables that programs keep as arrays: Parquet, and MATLAB's .mat up to version 7."""

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.findings import FileFindings
from hdcal.data.frames import frame_text
from hdcal.errors import quoted

PARQUET, MATLAB, HDF5 = b"PAR1", b"MATLAB 5.0", b"\x89HDF"
_FEWEST = 5


def read_arrays(
    path: Path, findings: FileFindings, kind: bytes
) -> tuple[bytes, str, str]:
    """Return a file of arrays as text, as `read_text` does.

    Args:
        path: where it is.
        findings: of the file.
        kind: what it begins with.

    Raises:
        InputError: it cannot be read, or holds no table.
    """
    if kind == HDF5:
        words = "is an HDF5 file, as MATLAB writes it since version 7.3"
        findings.refuse(words, "Save it with -v7, or as CSV")
    table, note = (_parquet if kind == PARQUET else _matlab)(path, findings)
    utf8 = frame_text(table, findings)[0]
    return utf8, hashlib.sha256(path.read_bytes()).hexdigest(), note


def _parquet(path: Path, findings: FileFindings) -> tuple[pd.DataFrame, str]:
    try:
        return pd.read_parquet(path), ""
    except ImportError:
        findings.refuse(
            "is a Parquet file, which needs pyarrow", 'pip install "hdcal[files]"'
        )
    except Exception as error:  # whatever a parser makes of a broken file
        findings.refuse(
            f"is no Parquet file that can be read ({error})", "Save it anew"
        )


def _matlab(path: Path, findings: FileFindings) -> tuple[dict[str, np.ndarray], str]:
    """Return the vectors of one length, or the columns of a matrix."""
    from scipy.io import loadmat

    try:
        held = loadmat(path, simplify_cells=True)
    except Exception as error:  # whatever a parser makes of a broken file
        findings.refuse(f"is no .mat file that can be read ({error})", "Save it anew")
    found = list(_arrays(held))
    arrays = dict(found)
    twice = [name for name in arrays if [n for n, _ in found].count(name) > 1]
    if twice:
        words = f"holds {', '.join(map(quoted, twice))} more than once"
        findings.refuse(words, "Save one run in a file, or give each a name")
    vectors = {name: array for name, array in arrays.items() if array.ndim == 1}
    lengths = [len(array) for array in vectors.values()]
    usual = [size for size in {*lengths} if lengths.count(size) > 1]
    matrices = {name: array for name, array in arrays.items() if array.ndim == 2}
    names = ", ".join(map(quoted, arrays))
    if len(usual) == 1:
        taken = {n: a for n, a in vectors.items() if len(a) == usual[0]}
        left = [name for name in held if name not in taken and name[:2] != "__"]
        left = [n for n in left if not _holds(held[n], taken)]
        note = f"not read of the file: {', '.join(map(quoted, left))}" if left else ""
        return taken, note
    if not usual and len(matrices) == 1:
        ((name, matrix),) = matrices.items()
        columns = {str(k + 1): column for k, column in enumerate(matrix.T)}
        return columns, f"the matrix {quoted(name)} holds the readings"
    words = f"holds no one table of readings: {names or 'no arrays'}"
    findings.refuse(words, "Save vectors of one length, and nothing else")


def _holds(value: Any, taken: dict[str, np.ndarray]) -> bool:
    """Tell whether a variable is a structure of nothing but what was taken."""
    return isinstance(value, dict) and {*value} <= {*taken}


def _arrays(held: Any, name: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Yield the arrays of numbers in variables and structures, by their own names."""
    if isinstance(held, dict):
        for key, value in held.items():
            if not key.startswith("__"):
                yield from _arrays(value, key)
    elif (
        isinstance(held, np.ndarray)
        and np.issubdtype(held.dtype, np.number)
        and np.isrealobj(held)
        and held.ndim in (1, 2)
        and len(held) >= _FEWEST
    ):
        yield name, held
