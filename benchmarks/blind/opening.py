"""The opening of a sealed set: everything verified, then scored and written."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter
from pydantic.dataclasses import dataclass

import hdcal
from benchmarks.blind.answers import OPENED, Frozen, read_frozen
from benchmarks.blind.calibration import reliability
from benchmarks.blind.estimates import Estimate
from benchmarks.blind.rivals import closable_share
from benchmarks.blind.scored_case import Cases, ScoredCase
from benchmarks.blind.scores import (
    COLUMNS,
    Row,
    columns,
    effect_statements,
    mix_ups,
    score_rows,
    tables,
    top_statements,
)
from benchmarks.blind.sealed_set import (
    BlindSet,
    Hash,
    Key,
    read_hashed,
    read_key,
    read_set,
    write_hashed,
)

JUDGED = "hdcal"
RESULT = "result"
# Of smaller gaps the share that closes is hardly known.
_LEAST_CLOSED_R = 0.5


@dataclass(frozen=True)
class Opened:
    """The record of the first opening: answers frozen by then were blind."""

    set: Hash
    answers: dict[str, Hash]
    time: str


_OPENED = TypeAdapter(Opened)


def open_set(folder: Path, key: Path) -> str:
    """Verify set, answers and labels, score, and write `result` in the folder.

    Args:
        folder: the set.
        key: the file with its labels.

    Returns:
        The scores as Markdown.

    Raises:
        InputError: anything is missing or was changed.
    """
    found = read_set(folder)
    frozen = read_frozen(found)
    secret = read_key(found, key)
    first = _first_opening(found, {name: sha for name, (_, sha) in frozen.items()})
    blind = {
        name: answers.blind and first.answers.get(name) == sha
        for name, (answers, sha) in frozen.items()
    }
    scored = {name: _scored(secret, answers) for name, (answers, _) in frozen.items()}
    judged = JUDGED if JUDGED in scored else next(iter(scored))
    cases = scored[judged]
    rows = score_rows(cases, closable_shares(found, cases))
    head = [f"commitment {found.commitment}"]
    head += [
        f"answers {sha} by '{name}'" + ("" if blind[name] else ", NOT BLIND")
        for name, (_, sha) in frozen.items()
    ]
    text = "\n".join([*head, "", *_markdown(judged, rows, scored)]) + "\n"
    result = folder / RESULT
    result.mkdir(exist_ok=True)
    (result / "scores.md").write_text(text, "utf-8")
    content = {
        "commitment": found.commitment,
        "mix": secret.mix,
        "answers": {n: {"sha256": frozen[n][1], "blind": blind[n]} for n in frozen},
        "judged": judged,
        "rows": [{**asdict(row), "target": _ends(row), "met": row.met} for row in rows],
        "diagnosers": {name: columns(some) for name, some in scored.items()},
        "tables": tables(cases),
        "mix_ups": mix_ups(cases),
    }
    plain = json.dumps(content, indent=1, default=asdict)
    (result / "scores.json").write_text(plain + "\n", "utf-8")
    _draw_reliability(cases, result / "reliability.png")
    return text


def _first_opening(found: BlindSet, hashes: dict[str, str]) -> Opened:
    """Return the record of the first opening, made now if this is it."""
    path = found.folder / OPENED
    if path.exists():
        return read_hashed(path, _OPENED)[0]
    now = datetime.now(UTC).isoformat(timespec="seconds")
    opened = Opened(found.commitment, hashes, now)
    write_hashed(path, _OPENED, opened)
    return opened


def _scored(secret: Key, frozen: Frozen) -> list[ScoredCase]:
    pairs = zip(secret.labels, frozen.answers, strict=True)
    return [ScoredCase(label, answer, frozen.groups) for label, answer in pairs]


def closable_shares(found: BlindSet, cases: Cases) -> dict[str, float]:
    """Return, of cases whose effect is answered rightly, what its form can close.

    The data come from other physics than the library's: even the true effect does not
    close all of a gap.
    """
    shares = {}
    for scored, entry in zip(cases, found.manifest.cases, strict=True):
        label, effect = scored.label, scored.answer.effect
        if not scored.one_effect or label.r < _LEAST_CLOSED_R:
            continue
        if effect not in hdcal.EFFECTS or effect != label.truth[0]:
            continue
        case = hdcal.read_case(found.table(entry), found.gear)
        assert case.screening is not None
        clean = np.asarray(label.clean)[case.screening.kept]
        case = replace(case, records=replace(case.records, force=clean))
        share = closable_share(case, effect, hdcal.EFFECTS, label.sigma)
        if share is not None:
            shares[label.case] = share
    return shares


def _markdown(
    judged: str, rows: list[Row], scored: Mapping[str, Cases]
) -> Iterator[str]:
    met = [row.met for row in rows]
    yield f"{judged}: {met.count(True)} targets met, {met.count(False)} missed"
    yield "\n| score | found | 95 % interval | cases | target | |\n" + "|---" * 6 + "|"
    words = {True: "met", False: "**missed**", None: ""}
    for row in rows:
        number, span = shown(row.found, row.unit)
        cells = row.what, number, span, str(row.found.n), _target(row), words[row.met]
        yield f"| {' | '.join(cells)} |"
    yield from _table(
        "answers by", {name: columns(some) for name, some in scored.items()}
    )
    for by, groups in tables(scored[judged]).items():
        yield from _table(by, groups)
    yield "\n| truth | taken for | cases |\n|---|---|---|"
    for truth, answer, count in mix_ups(scored[judged]):
        yield f"| {truth} | {answer} | {count} |"
    measured = [c for c in scored[judged] if c.label.kind == "real"]
    for name, some in scored.items() if measured else ():
        for case in some:
            chances = {**case.answer.probabilities, **case.answer.inclusion}
            held = [f"{n} {100 * chances.get(n, 0.0):.0f} %" for n in case.answer.set]
            stated = " or ".join(case.label.truth)
            yield (
                f"\nMeasured, stated {stated}; {name}: {case.answer.verdict}, "
                f"set {', '.join(held)}"
            )


def _table(first: str, groups: Mapping[str, Mapping[str, Estimate]]) -> Iterator[str]:
    yield f"\n| {first} | {' | '.join(COLUMNS)} |"
    yield "|---" * (len(COLUMNS) + 1) + "|"
    units = {"set size": "effects", "log score": "nat", "Brier score": "nat"}
    for name, cells in groups.items():
        texts = [
            f"{shown(found, units.get(column, 'share'))[0]} ({found.n})"
            for column, found in cells.items()
        ]
        yield f"| {name} | {' | '.join(texts)} |"


def shown(found: Estimate, unit: str = "share") -> tuple[str, str]:
    """Return a number and its interval as texts."""

    def text(value: float | None) -> str:
        if value is None:
            return "–"
        return f"{100 * value:.1f} %" if unit == "share" else f"{value:.2f}"

    span = f"{text(found.lo)} … {text(found.hi)}" if found.lo is not None else "–"
    return text(found.value), span


def _ends(row: Row) -> list[float | None] | None:
    if row.target is None:
        return None
    return [end if np.isfinite(end) else None for end in row.target]


def _target(row: Row) -> str:
    if row.target is None:
        return ""
    low, high = (
        f"{100 * end:g} %" if row.unit == "share" else f"{end:g}" for end in row.target
    )
    if np.isinf(row.target[0]):
        return f"≤ {high}"
    return f"≥ {low}" if np.isinf(row.target[1]) else f"{low} … {high}"


def _draw_reliability(cases: Cases, path: Path) -> None:
    """Draw stated probabilities against the share that was true."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.5, 4.5), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], "--", color="grey")
    for label, found in (
        ("most probable hypothesis", top_statements(cases)),
        ("single effects given 5 % or more", effect_statements(cases)),
    ):
        bins = reliability(found)
        x = [stated for stated, _ in bins]
        y = np.array([[e.value, e.lo, e.hi] for _, e in bins]).reshape(-1, 3).T
        axes.errorbar(x, y[0], [y[0] - y[1], y[2] - y[0]], fmt="o", label=label)
    axes.set(xlabel="stated probability", ylabel="share true", aspect="equal")
    axes.legend()
    figure.savefig(path, dpi=120)
