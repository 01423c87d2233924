"""Evidence of each effect alone, beside a given base."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hdcal.data.priors import Prior
from hdcal.evidence.closed_form import AmplitudeCells, base_evidence, cell_evidence
from hdcal.evidence.inner_products import (
    CommonTerms,
    PieceProducts,
    common_terms,
    piece_products,
)
from hdcal.evidence.linear_rows import LinearRows, project
from hdcal.evidence.piecewise_effect import (
    NO_TOLERANCE,
    PiecewiseEffect,
    amplitude_cells,
    join_cells,
)

# Numbers in one block of pieces: 2**21 of them take 16 MB.
_MOST_VALUES = 2**21
# Pieces of each effect whose shape may differ from the library's: the likeliest.
_TOLERANT = 8


@dataclass(frozen=True)
class CellEvidence:
    """Log evidences of cells; [correlation, cell].

    Attributes:
        owner: index of the effect of each cell, those of one beside each other.
        cells: of the amplitudes.
        log_evidence: with prior weights, without the prior of the correlation.
        mean: of the amplitude before its cell cuts it.
        sd: of the amplitude before its cell cuts it.
    """

    owner: np.ndarray
    cells: AmplitudeCells
    log_evidence: np.ndarray
    mean: np.ndarray
    sd: np.ndarray

    def of(self, effect: int) -> "CellEvidence":
        """Return the cells of one effect."""
        own = slice(*np.searchsorted(self.owner, (effect, effect + 1)))
        tables = (t[:, own] for t in (self.log_evidence, self.mean, self.sd))
        cells = AmplitudeCells(*(column[own] for column in self.cells))
        return CellEvidence(self.owner[own], cells, *tables)


@dataclass(frozen=True)
class SingleEvidence:
    """Evidence of every effect in pieces.

    Attributes:
        names: of the effects.
        parts: with exact shapes, and with tolerance where that was asked for.
        none: without any effect, [correlation].
        common: what all hypotheses share.
        products: of all pieces.
        starts: index of each effect's first piece, and the end.
    """

    names: tuple[str, ...]
    parts: tuple[CellEvidence, ...]
    none: np.ndarray
    common: CommonTerms
    products: PieceProducts
    starts: np.ndarray

    def likeliest(self, name: str, at: int) -> tuple[int, float, float]:
        """Return where most of an effect's evidence is at a correlation.

        Args:
            name: of the effect.
            at: index of the correlation.

        Returns:
            Its piece, from 0, the size of its amplitude, and of which amplitude its
            shape's freedom is, however small the effect itself stands there.
        """
        index = self.names.index(name)
        parts = [part.of(index) for part in self.parts]
        part = max(parts, key=lambda p: p.log_evidence[at].max())
        cell, cells = int(np.argmax(part.log_evidence[at])), part.cells
        size = abs(np.clip(part.mean[at, cell], cells.low[cell], cells.high[cell]))
        loose = cells.tolerance[cell] * cells.size[cell]
        piece = int(cells.piece[cell] - self.starts[index])
        return piece, float(size), float(loose)

    def by_correlation(self, name: str) -> np.ndarray:
        """Return the log evidence of an effect, [correlation]."""
        index = self.names.index(name)
        parts = [part.of(index).log_evidence for part in self.parts]
        return np.logaddexp.reduce(np.concatenate(parts, axis=1), axis=1)


def single_evidence(
    rows: LinearRows,
    effects: Sequence[PiecewiseEffect],
    sigma: Prior,
    *,
    tolerant: bool = True,
) -> SingleEvidence:
    """Compute the evidence of each effect alone.

    Args:
        rows: the data.
        effects: in pieces.
        sigma: prior of the noise sd.
        tolerant: let the shapes differ from the library's.
    """
    common, nothing = common_terms(rows), np.zeros((0, len(rows.reading)))
    starts = np.cumsum([0] + [len(each.slopes) for each in effects])
    offsets, slopes, shapes = (
        np.concatenate([nothing, *(getattr(each, part) for each in effects)])
        for part in ("offsets", "slopes", "shapes")
    )
    products = _in_blocks(rows, offsets, slopes)
    none = evidence_of_none(rows, sigma)
    if not effects:
        return SingleEvidence((), (), none, common, products, starts)
    exact = _exact(common, products, effects, starts, sigma)
    parts = (exact,)
    if tolerant:
        chosen = _likeliest(exact, starts)
        loose = _in_blocks(rows, offsets[chosen], slopes[chosen], shapes[chosen])
        weight = np.log(NO_TOLERANCE)
        parts = (
            replace(exact, log_evidence=exact.log_evidence + weight),
            _tolerant(common, loose, effects, starts, sigma, chosen),
        )
    names = tuple(each.name for each in effects)
    return SingleEvidence(names, parts, none, common, products, starts)


def evidence_of_none(rows: LinearRows, sigma: Prior) -> np.ndarray:
    """Return the log evidence without any effect, [correlation]."""
    left = [project(rows, c, rows.reading[None])[0] for c in rows.correlations]
    return base_evidence(common_terms(rows), np.sum(np.square(left), axis=1), sigma)


def _in_blocks(rows: LinearRows, *curves: np.ndarray) -> PieceProducts:
    """Reduce blocks of pieces, so that memory stays bounded."""
    block = max(1, _MOST_VALUES // len(rows.reading))
    parts = [
        piece_products(rows, *(table[i : i + block] for table in curves))
        for i in range(0, max(len(curves[0]), 1), block)
    ]
    joined = (np.concatenate(leaves, axis=1) for leaves in zip(*parts, strict=True))
    return PieceProducts(*joined)


def _likeliest(exact: CellEvidence, starts: np.ndarray) -> np.ndarray:
    """Return the pieces of each effect that explain the rows best, always as many."""
    best = np.full(starts[-1], -np.inf)
    np.maximum.at(best, exact.cells.piece, exact.log_evidence.max(axis=0))
    chosen = [
        low + np.sort(np.argsort(-best[low:high], kind="stable")[:_TOLERANT])
        for low, high in pairwise(starts)
    ]
    return np.concatenate(chosen)


def _cells_of_all(effects, starts, **settings) -> tuple[np.ndarray, AmplitudeCells]:
    """Return the cells of all effects, and the index of the effect of each."""
    parts = [amplitude_cells(each, **settings) for each in effects]
    owner = np.repeat(np.arange(len(parts)), [len(part.low) for part in parts])
    return owner, join_cells(parts, starts[:-1])


def _exact(common, products, effects, starts, sigma, scale=1.0) -> CellEvidence:
    """Return the evidence of cells whose shapes are the library's."""
    owner, cells = _cells_of_all(effects, starts, scale=scale, exact=True)
    return CellEvidence(owner, cells, *cell_evidence(common, products, cells, sigma))


def _tolerant(common, products, effects, starts, sigma, chosen) -> CellEvidence:
    """Return the evidence of cells on chosen pieces, whose shapes may differ."""
    owner, cells = _cells_of_all(effects, starts)
    place = np.full(starts[-1], -1)
    place[chosen] = np.arange(len(chosen))
    kept = place[cells.piece] >= 0
    owner, cells = owner[kept], AmplitudeCells(*(leaf[kept] for leaf in cells))
    among_chosen = cells._replace(piece=place[cells.piece])
    found = cell_evidence(common, products, among_chosen, sigma)
    return CellEvidence(owner, cells, *found)


def rescaled_change(
    single: SingleEvidence,
    effects: Sequence[PiecewiseEffect],
    priors: dict[str, Prior],
    scale: float,
) -> dict[str, np.ndarray]:
    """Return by how much log evidences move when amplitude priors are rescaled.

    Args:
        single: with the priors as they are.
        effects: in pieces.
        priors: by site name.
        scale: factor on the prior sds of the amplitudes.

    Returns:
        Change by effect, [correlation].
    """
    if not effects:
        return {}
    before = single.parts[0]
    after = _exact(
        single.common, single.products, effects, single.starts, priors["sigma"], scale
    )
    return {
        name: np.logaddexp.reduce(after.of(index).log_evidence, axis=1)
        - np.logaddexp.reduce(before.of(index).log_evidence, axis=1)
        + np.log(NO_TOLERANCE)
        for index, name in enumerate(single.names)
    }
