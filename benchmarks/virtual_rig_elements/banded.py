"""Chains of elements give banded matrices: assembled and multiplied as such."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]


def assemble_matrix(blocks: Floats) -> Floats:
    """Return the sum of symmetric element matrices along a chain of nodes.

    Args:
        blocks: element matrices, shape (elements, 2d, 2d), d dofs per node.

    Returns:
        Upper banded storage as `scipy.linalg.solveh_banded` takes it, shape
        (2d, (elements + 1) d).

    Source:
        LAPACK, band storage of symmetric matrices.
    """
    elements, size, _ = blocks.shape
    total = (elements + 1) * size // 2
    row, column = np.triu_indices(size)
    first = (size // 2) * np.arange(elements)[:, None]
    place = (size - 1 + row - column) * total + column + first
    entries = blocks[:, row, column]
    flat = np.zeros(size * total)
    np.add.at(flat, place, entries)
    return flat.reshape(size, total)


def assemble_vector(blocks: Floats) -> Floats:
    """Return the sum of element vectors along a chain of nodes.

    Args:
        blocks: element vectors, shape (elements, 2d).

    Returns:
        Vector, shape ((elements + 1) d,).

    Source:
        As `assemble_matrix`.
    """
    elements, size = blocks.shape
    dofs = size // 2
    total = np.zeros((elements + 1, dofs))
    total[:-1] += blocks[:, :dofs]
    total[1:] += blocks[:, dofs:]
    return total.ravel()


def multiply(band: Floats, vector: Floats) -> Floats:
    """Return the product of a banded symmetric matrix with a vector.

    Args:
        band: upper banded storage, shape (bands, dofs).
        vector: shape (dofs,).

    Returns:
        Product, shape (dofs,).

    Source:
        As `assemble_matrix`.
    """
    product = band[-1] * vector
    for offset in range(1, len(band)):
        above = band[-1 - offset, offset:]
        product[:-offset] += above * vector[offset:]
        product[offset:] += above * vector[:-offset]
    return product
