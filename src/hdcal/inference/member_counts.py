"""How many runs and specimens have a parameter of their own, and how many may."""

from collections.abc import Mapping

from hdcal.data.case import Case
from hdcal.errors import Finding, InputError
from hdcal.inference.discrepancy import leftover_size

# Runs or specimens: of the kind that is eliminated one by one, and of any other, whose
# cost grows with the cube of their number.
_MOST_MEMBERS, _MOST_DENSE = 10_000, 500


def member_counts(case: Case, with_gap: bool) -> dict[str, int]:
    """Return how many members of each kind have a parameter of their own.

    Args:
        case: records and labels.
        with_gap: whether there is a leftover discrepancy.
    """
    known = case.records.known
    weights = leftover_size(case.records)
    counts = {
        "run": len(case.run_labels) if "run" in known else 0,
        "specimen": len(case.specimen_labels) if "specimen" in known else 0,
        "discrepancy": weights if with_gap else 0,
    }
    return {kind: count for kind, count in counts.items() if count}


def integrated_kinds(
    counts: Mapping[str, int], linear: frozenset[str]
) -> tuple[str, ...]:
    """Return the kinds of members to integrate out.

    The first one is eliminated one by one, unless it is the discrepancy: of runs and
    specimens the more numerous kind.

    Args:
        counts: from `member_counts`.
        linear: kinds that enter a Gaussian likelihood linearly.
    """
    return tuple(
        sorted(
            counts.keys() & linear,
            key=lambda kind: (kind == "discrepancy", -counts[kind], kind),
        )
    )


def check_member_counts(
    name: str, counts: Mapping[str, int], integrated: tuple[str, ...]
) -> None:
    """Check that runs and specimens are not too many.

    Args:
        name: of the case.
        counts: from `member_counts`.
        integrated: from `integrated_kinds`.

    Raises:
        InputError: they are.
    """
    findings = []
    for kind in sorted(counts.keys() - {"discrepancy"}):
        eliminated = kind in integrated[:1]
        most = _MOST_MEMBERS if eliminated else _MOST_DENSE
        if counts[kind] > most:
            words = f"{counts[kind]} {kind}s are too many for one calibration"
            if not eliminated:
                words += " with effects, coarse readings or both runs and specimens"
            findings.append(Finding(name, words, f"give it {most} or fewer"))
    if findings:
        raise InputError(findings)
