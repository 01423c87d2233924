"""The opening of a sealed set: everything verified, then scored and written."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter
from pydantic.dataclasses import dataclass

import hdcal
from benchmarks.blind.answers import OPENED, read_frozen
from benchmarks.blind.calibration import reliability
from benchmarks.blind.estimates import Estimate
from benchmarks.blind.label import Label
from benchmarks.blind.rivals import closable
from benchmarks.blind.scored_case import Cases, ScoredCase
from benchmarks.blind.scores import (
    COLUMNS,
    LEAST_CLOSED_R,
    UNITS,
    Row,
    class_statements,
    mix_ups,
    score_rows,
    tables,
)
from benchmarks.blind.sealed_set import (
    BlindSet,
    Hash,
    read_hashed,
    read_key,
    read_set,
    write_hashed,
)

JUDGED = "hdcal"
RESULT = "result"


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
    pairs = {
        name: [*map(ScoredCase, secret.labels, answers.answers)]
        for name, (answers, _) in frozen.items()
    }
    # hdcal first, then in alphabetical order.
    scored = {n: pairs[n] for n in sorted(pairs, key=lambda n: (n != JUDGED, n))}
    shares = closable_shares(found, secret.labels)
    rows = {name: score_rows(cases, shares) for name, cases in scored.items()}
    cases = next(iter(scored.values()))
    head = [f"commitment {found.commitment}"]
    head += [
        f"answers {sha} by '{name}'" + ("" if blind[name] else ", NOT BLIND")
        for name, (_, sha) in frozen.items()
    ]
    text = "\n".join([*head, "", *_markdown(rows, scored)]) + "\n"
    result = folder / RESULT
    result.mkdir(exist_ok=True)
    (result / "scores.md").write_text(text, "utf-8")
    content = {
        "commitment": found.commitment,
        "mix": secret.mix,
        "answers": {n: {"sha256": frozen[n][1], "blind": blind[n]} for n in frozen},
        "rows": {
            name: [{**asdict(r), "target": _ends(r), "met": r.met} for r in some]
            for name, some in rows.items()
        },
        "tables": tables(cases),
        "reliability": reliability(class_statements(cases)),
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


def closable_shares(
    found: BlindSet, labels: Sequence[Label]
) -> dict[str, dict[str, float]]:
    """Return the share of the gap's rms that each effect can close, by case.

    As the library's effect does, fitted to the readings without noise by least squares:
    the data come from other physics, so that even an effect that acts alone does not
    close all of its gap. The share is defined as `Cause.explains`.
    """
    shares = {}
    for label, entry in zip(labels, found.manifest.cases, strict=True):
        if not label.clean or label.r < LEAST_CLOSED_R:
            continue
        case = hdcal.read_case(found.table(entry), found.gear)
        assert case.screening is not None
        clean = np.asarray(label.clean)[case.screening.kept]
        case = replace(case, records=replace(case.records, force=clean))
        shares[label.case] = closable(case, hdcal.EFFECTS, label.sigma)
    return shares


def _markdown(
    rows: Mapping[str, list[Row]], scored: Mapping[str, Cases]
) -> Iterator[str]:
    for name, some in rows.items():
        met = [row.met for row in some]
        yield f"{name}: {met.count(True)} targets met, {met.count(False)} missed"
    yield "\n95 % interval and number of cases in brackets; bold: target missed."
    yield f"\n| score | target | {' | '.join(rows)} |"
    yield "|---" * (len(rows) + 2) + "|"
    for same in zip(*rows.values(), strict=True):
        cells = [same[0].what, _target(same[0]), *map(_cell, same)]
        yield f"| {' | '.join(cells)} |"
    name, cases = next(iter(scored.items()))
    yield f"\nOf {name}, class probabilities:"
    yield "\n| mean probability | share right | 95 % interval | classes |"
    yield "|---|---|---|---|"
    for stated, found in reliability(class_statements(cases)):
        yield f"| {100 * stated:.1f} % | {' | '.join(shown(found))} | {found.n} |"
    for by, groups in tables(cases).items():
        yield from _table(by, groups)
    yield "\n| truth | most probable | cases |\n|---|---|---|"
    for truth, answer, count in mix_ups(cases):
        yield f"| {truth} | {answer} | {count} |"
    yield from _measured(scored)


def _measured(scored: Mapping[str, Cases]) -> Iterator[str]:
    """Yield what was answered to measured data, which have no scores."""
    for name, cases in scored.items():
        for case in cases:
            if case.label.kind == "real":
                chances = case.answer.explanations
                held = [f"{n} {100 * chances[n]:.0f} %" for n in case.answer.set]
                causes = [*case.answer.classes, case.answer.outside]
                acts = [
                    f"{' or '.join(each.members)} {100 * each.acts:.0f} %"
                    for each in causes
                    if each.acts > 0.5
                ]
                yield (
                    f"\nMeasured, stated {' or '.join(case.label.truth)}; {name}: "
                    f"acts: {', '.join(acts) or 'nothing'}; set: {', '.join(held)}"
                )


def _cell(row: Row) -> str:
    if row.found.value is None:
        return ""
    number, span = shown(row.found, row.unit)
    number = f"**{number}**" if row.met is False else number
    return f"{number} ({span}; {row.found.n})"


def _table(first: str, groups: Mapping[str, Mapping[str, Estimate]]) -> Iterator[str]:
    yield f"\n| {first} | {' | '.join(COLUMNS)} |"
    yield "|---" * (len(COLUMNS) + 1) + "|"
    for name, cells in groups.items():
        texts = [
            f"{shown(found, UNITS.get(column, 'share'))[0]} ({found.n})"
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
    text = f"≥ {low}" if np.isinf(row.target[1]) else f"{low} … {high}"
    return f"{text} within its interval" if row.within else text


def _draw_reliability(cases: Cases, path: Path) -> None:
    """Draw probabilities of classes against the share that was right."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.5, 4.5), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], "--", color="grey")
    bins = reliability(class_statements(cases))
    x = [stated for stated, _ in bins]
    y = np.array([[e.value, e.lo, e.hi] for _, e in bins]).reshape(-1, 3).T
    axes.errorbar(x, y[0], [y[0] - y[1], y[2] - y[0]], fmt="o")
    axes.set(xlabel="probability of a class", ylabel="share right", aspect="equal")
    figure.savefig(path, dpi=120)
