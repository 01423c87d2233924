"""Evidence of each effect alone, beside a given base."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import jax
import numpy as np

from hdcal.data.priors import Prior
from hdcal.evidence.closed_form import Entries, entry_evidence, plain_evidence
from hdcal.evidence.effect_lines import NO_TOLERANCE, Lines, entries_of, join
from hdcal.evidence.inner_products import (
    Ground,
    Nodes,
    ground,
    line_statistics,
    tolerant_statistics,
)
from hdcal.evidence.whitened_rows import Rows

# Numbers in one block of lines: 2**21 of them take 16 MB.
_MOST_VALUES = 2**21
# Lines of each effect whose shape may differ from the library's: the likeliest.
_TOLERANT = 8


@dataclass(frozen=True)
class Cells:
    """Log evidences of cells; [correlation, entry].

    Attributes:
        owner: index of the effect of each entry.
        entries: the cells.
        log_evidence: with prior weights, without the prior of the correlation.
        mean: of the amplitude before its cell cuts it.
        sd: of the amplitude before its cell cuts it.
    """

    owner: np.ndarray
    entries: Entries
    log_evidence: np.ndarray
    mean: np.ndarray
    sd: np.ndarray


@dataclass(frozen=True)
class Singles:
    """Evidence of every effect that is one line.

    Attributes:
        names: of the effects.
        cells: without tolerance, and with it where that was asked for.
        none: without any effect, [correlation].
        ground: what all share.
        nodes: inner products of all lines.
        starts: index of each effect's first line, and the end.
    """

    names: tuple[str, ...]
    cells: tuple[Cells, ...]
    none: np.ndarray
    ground: Ground
    nodes: Nodes
    starts: np.ndarray

    def by_correlation(self, name: str) -> np.ndarray:
        """Return the log evidence of an effect, [correlation]."""
        index = self.names.index(name)
        parts = [c.log_evidence[:, c.owner == index] for c in self.cells]
        return np.logaddexp.reduce(np.concatenate(parts, axis=1), axis=1)


def assess_singles(
    rows: Rows,
    lines: Sequence[Lines],
    sigma: Prior,
    *,
    tolerant: bool = True,
) -> Singles:
    """Compute the evidence of each effect alone.

    Args:
        rows: the data.
        lines: of each effect.
        sigma: prior of the noise sd.
        tolerant: let the shapes differ from the library's.
    """
    shared = ground(rows)
    nothing = np.zeros((1, len(rows.reading)))
    if not lines:
        nodes = line_statistics(rows, nothing, nothing)
        none = np.asarray(plain_evidence(shared, nodes.ee[:, 0], sigma))
        return Singles((), (), none, shared, nodes, np.zeros(1, int))
    starts = np.cumsum([0] + [len(each.slopes) for each in lines])
    offsets, slopes, shapes = (
        np.concatenate([getattr(each, part) for each in lines])
        for part in ("offsets", "slopes", "shapes")
    )
    table = [np.concatenate([nothing, offsets]), np.concatenate([nothing, slopes])]
    nodes = _in_blocks(line_statistics, rows, table)
    none = plain_evidence(shared, nodes.ee[:, 0], sigma)
    nodes = jax.tree.map(lambda leaf: leaf[:, 1:], nodes)
    tight = _cells(shared, nodes, lines, starts, sigma, tight=True)
    cells = (tight,)
    if tolerant:
        chosen = _likeliest(tight, starts)
        loose = _in_blocks(
            tolerant_statistics, rows, [t[chosen] for t in (offsets, slopes, shapes)]
        )
        every = _cells(shared, loose, lines, starts, sigma, chosen=chosen)
        exact = replace(tight, log_evidence=tight.log_evidence + np.log(NO_TOLERANCE))
        cells = (exact, every)
    return Singles(
        tuple(each.name for each in lines),
        cells,
        np.asarray(none),
        shared,
        nodes,
        starts,
    )


def _in_blocks(reduce, rows: Rows, table: list[np.ndarray]) -> Nodes:
    """Apply a reduction to blocks of lines, so that memory stays bounded."""
    block = max(1, _MOST_VALUES // len(rows.reading))
    parts = [
        jax.tree.map(np.asarray, reduce(rows, *(t[i : i + block] for t in table)))
        for i in range(0, len(table[0]), block)
    ]
    return jax.tree.map(lambda *p: np.concatenate(p, axis=1), *parts)


def _likeliest(tight: Cells, starts: np.ndarray) -> np.ndarray:
    """Return the lines of each effect that explain the rows best, always as many."""
    node = np.asarray(tight.entries.node)
    best = np.full(starts[-1], -np.inf)
    np.maximum.at(best, node, tight.log_evidence.max(axis=0))
    chosen = [
        low + np.sort(np.argsort(-best[low:high], kind="stable")[:_TOLERANT])
        for low, high in pairwise(starts)
    ]
    return np.concatenate(chosen)


def _cells(
    shared, nodes, lines, starts, sigma, scale=1.0, *, tight=False, chosen=None
) -> Cells:
    parts = [entries_of(each, scale, tight=tight) for each in lines]
    owner = np.repeat(np.arange(len(parts)), [len(p["node"]) for p in parts])
    entries = join(parts, starts[:-1])
    if chosen is not None:
        place = np.full(starts[-1], -1)
        place[chosen] = np.arange(len(chosen))
        kept = place[entries.node] >= 0
        owner = owner[kept]
        entries = jax.tree.map(lambda leaf: leaf[kept], entries)
        seen = Entries(**{**vars(entries), "node": place[entries.node]})
        found = entry_evidence(shared, nodes, seen, sigma)
    else:
        found = entry_evidence(shared, nodes, entries, sigma)
    return Cells(owner, entries, *(np.asarray(part) for part in found))


def rescaled(
    singles: Singles, lines: Sequence[Lines], priors: dict[str, Prior], scale: float
) -> dict[str, np.ndarray]:
    """Return by how much log evidences move when amplitude priors are rescaled.

    Args:
        singles: with the priors as they are.
        lines: of each effect.
        priors: by site name.
        scale: factor on the prior sds of the amplitudes.

    Returns:
        Change by effect, [correlation].
    """
    if not lines:
        return {}
    shared, nodes, sigma = singles.ground, singles.nodes, priors["sigma"]
    before = singles.cells[0]
    after = _cells(shared, nodes, lines, singles.starts, sigma, scale, tight=True)
    return {
        name: np.logaddexp.reduce(after.log_evidence[:, after.owner == index], axis=1)
        - np.logaddexp.reduce(before.log_evidence[:, before.owner == index], axis=1)
        + np.log(NO_TOLERANCE)
        for index, name in enumerate(singles.names)
    }
