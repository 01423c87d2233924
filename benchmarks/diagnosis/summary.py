"""From rows of single cases to tables with intervals."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from scipy.special import ndtri

from benchmarks.children import table
from benchmarks.diagnosis.score import family

Row = dict
_Z = float(ndtri(0.975))
# Below the oracle by more than this [points], a class is listed.
_BEHIND = 8.0


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a share, by Wilson's score."""
    if not count:
        return 0.0, 1.0
    share, extra = hits / count, _Z**2 / count
    middle = (share + extra / 2.0) / (1.0 + extra)
    half = np.sqrt(share * (1.0 - share) * extra + extra**2 / 4.0) / (1.0 + extra)
    return middle - half, middle + half


def _share(rows: Sequence[Row], test: Callable[[Row], bool]) -> dict:
    hits = sum(map(test, rows))
    low, high = wilson(hits, len(rows))
    share = hits / len(rows) if rows else float("nan")
    return {"share": share, "lo": low, "hi": high, "count": len(rows)}


def strict(row: Row) -> bool:
    return row["effect"] == row["truth"][0]


def alike(row: Row) -> bool:
    return row["effect"] is not None and family(row["effect"]) == family(
        row["truth"][0]
    )


def covered(row: Row) -> bool:
    return row["truth"][0] in row["set"]


def named(row: Row) -> bool:
    return row["verdict"] == "named"


def summarise(rows: Sequence[Row]) -> dict:
    """Return every score of cases with one true effect."""
    gaps = [row for row in rows if row["verdict"] != "none"]
    names = [row for row in rows if named(row)]
    closed = [abs(row["closed"] - 1.0) for row in rows if "closed" in row]
    errors = [abs(row["amplitude_error"]) for row in rows if "amplitude_error" in row]
    inside = [row for row in rows if "amplitude_inside" in row]
    return {
        "detected": _share(rows, lambda row: row["detected"]),
        "strict": _share(rows, strict),
        "oracle": _share(rows, lambda row: row["oracle"] == row["truth"][0]),
        "family": _share(rows, alike),
        "oracle_family": _share(
            rows, lambda row: family(row["oracle"]) == family(row["truth"][0])
        ),
        "covered": _share(rows, covered),
        "covered_gaps": _share(gaps, covered),
        "set_size": _mean([len(row["set"]) for row in gaps]),
        "named": _share(rows, named),
        "precision": _share(names, strict),
        "precision_family": _share(names, alike),
        "unknown": _share(rows, lambda row: row["verdict"] == "unknown"),
        "none": _share(rows, lambda row: row["verdict"] == "none"),
        "amplitude_error": _median(errors),
        "amplitude_covered": _share(inside, lambda row: row["amplitude_inside"]),
        "closed_error": _median(closed),
        "closed_count": len(closed),
        "seconds": _median([row["seconds"] for row in rows]),
    }


def summarise_none(rows: Sequence[Row]) -> dict:
    """Return the scores of cases without gap."""
    return {
        "gate": _share(rows, lambda row: row["detected"]),
        "alarm": _share(rows, lambda row: row["detected"] and row["verdict"] != "none"),
        "named": _share(rows, named),
        "named_mean": _share(
            rows, lambda row: named(row) and family(row["effect"]) != "noise"
        ),
        "seconds": _median([row["seconds"] for row in rows]),
    }


def summarise_two(rows: Sequence[Row]) -> dict:
    """Return the scores of cases with two true effects."""

    def both(row: Row, same: Callable) -> bool:
        return set(map(same, row["top"].split("+"))) == set(map(same, row["truth"]))

    def said(row: Row) -> bool:
        return {row["effect"], row["second"]} == set(row["truth"])

    def any_right(row: Row) -> bool:
        return row["effect"] in row["truth"]

    return {
        "detected": _share(rows, lambda row: row["detected"]),
        "said": _share(rows, said),
        "both": _share(rows, lambda row: both(row, lambda name: name)),
        "both_family": _share(rows, lambda row: both(row, family)),
        "one": _share(rows, any_right),
        "covered": _share(rows, lambda row: set(row["truth"]) <= set(row["set"])),
        "set_size": _mean([len(row["set"]) for row in rows]),
        "unknown": _share(rows, lambda row: row["verdict"] == "unknown"),
    }


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if len(values) else float("nan")


def groups(rows: Iterable[Row], *keys: str) -> dict[tuple, list[Row]]:
    """Return reachable rows by the values of some columns, in order of appearance."""
    found: dict[tuple, list[Row]] = {}
    for row in rows:
        key = tuple(tuple(v) if isinstance(v := row[k], list) else v for k in keys)
        found.setdefault(key, [])
        if row["reachable"]:
            found[key].append(row)
    return found


def _percent(share: dict, *, interval: bool = True) -> str:
    if not share["count"]:
        return "–"
    text = f"{100.0 * share['share']:.0f}"
    ends = f" ({100.0 * share['lo']:.0f}–{100.0 * share['hi']:.0f})"
    return text + ends if interval else text


def _fine(share: dict) -> str:
    hits = round(share["share"] * share["count"])
    ends = f"{100.0 * share['lo']:.1f}–{100.0 * share['hi']:.1f}"
    return f"{100.0 * share['share']:.1f} ({ends}), {hits} of {share['count']}"


def show(rows: Sequence[Row]) -> dict:
    """Print every table; return the numbers behind them."""
    one = [row for row in rows if len(row["truth"]) == 1]
    two = [row for row in rows if len(row["truth"]) == 2]
    none = [row for row in rows if not row["truth"]]
    overall, classes = groups(one, "program", "r"), groups(one, "program", "r", "truth")
    result = {
        "overall": {str(k): summarise(v) for k, v in overall.items()},
        "classes": {str(k): summarise(v) for k, v in classes.items()},
        "none": {
            str(k): summarise_none(v)
            for k, v in groups(none, "program", "noise").items()
        },
        "two": {
            str(k): summarise_two(v) for k, v in groups(two, "program", "r").items()
        },
    }
    if one:
        _show_overall(overall)
        for key, members in groups(one, "program", "r").items():
            if members:
                _show_classes(
                    key, {k[2][0]: v for k, v in classes.items() if k[:2] == key}
                )
    if none:
        _show_none(groups(none, "program", "noise"))
    if two:
        _show_two(groups(two, "program", "r"))
    return result


def _show_overall(found: dict[tuple, list[Row]]) -> None:
    print("\n### All effects together [%]\n")
    heading = "program, r, cases, detected, top-1, oracle, family, oracle family"
    heading += ", set covers, set size, named, precision, unknown, none"
    heading += ", amplitude error, interval covers, closed error, s per case"
    lines = []
    for (program, r), rows in sorted(
        found.items(), key=lambda kv: kv[0], reverse=False
    ):
        s = summarise(rows)
        shares = ("detected", "strict", "oracle", "family", "oracle_family", "covered")
        lines.append(
            (
                *(program, f"{r:g}", len(rows)),
                *(_percent(s[name]) for name in shares),
                f"{s['set_size']:.2f}",
                *(_percent(s[n]) for n in ("named", "precision")),
                *(_percent(s[n], interval=False) for n in ("unknown", "none")),
                f"{100.0 * s['amplitude_error']:.1f}",
                _percent(s["amplitude_covered"]),
                f"{s['closed_error']:.3f}",
                f"{s['seconds']:.2f}",
            )
        )
    table(tuple(heading.split(", ")), lines)


def _show_classes(key: tuple, found: dict[str, list[Row]]) -> None:
    print(f"\n### {key[0]}, r = {key[1]:g}, effect by effect [%]\n")
    heading = "effect, cases, detected, top-1, oracle, family, set covers, set size"
    heading += ", named, precision, amplitude error, interval covers, closed error, "
    lines = []
    for name, rows in found.items():
        if not rows:
            lines.append((f"{name}: does not reach this r", *[""] * 12))
            continue
        s = summarise(rows)
        behind = 100.0 * (s["oracle"]["share"] - s["strict"]["share"])
        lines.append(
            (
                *(name, len(rows), _percent(s["detected"], interval=False)),
                _percent(s["strict"]),
                *(
                    _percent(s[n], interval=False)
                    for n in ("oracle", "family", "covered")
                ),
                f"{s['set_size']:.1f}",
                *(_percent(s[n], interval=False) for n in ("named", "precision")),
                f"{100.0 * s['amplitude_error']:.0f}",
                _percent(s["amplitude_covered"], interval=False),
                f"{s['closed_error']:.2f}",
                f"behind by {behind:.0f}" if behind > _BEHIND else "",
            )
        )
    table(tuple(heading.split(", ")), lines)


def _show_none(found: dict[tuple, list[Row]]) -> None:
    print("\n### No effect [%]\n")
    names = ("gate", "alarm", "named", "named_mean")
    lines = []
    for (program, noise), rows in found.items():
        s = summarise_none(rows)
        lines.append((program, noise, *(_fine(s[name]) for name in names)))
    heading = ("program or rows of a line", "noise", "gate passed", "false alarm")
    table((*heading, "an effect named", "but for the noise's shape"), lines)


def _show_two(found: dict[tuple, list[Row]]) -> None:
    print("\n### Two effects [%]\n")
    names = ("detected", "said", "both", "both_family", "one", "covered", "unknown")
    lines = []
    for (program, r), rows in found.items():
        s = summarise_two(rows)
        shares = (_percent(s[name]) for name in names)
        lines.append((program, f"{r:g}", len(rows), *shares, f"{s['set_size']:.2f}"))
    heading = "program, r, cases, detected, both named, likeliest pair, its families"
    heading += ", effect is one of them, set holds both, unknown, set size"
    table(tuple(heading.split(", ")), lines)
