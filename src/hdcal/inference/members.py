"""Parameters that come in numbers: of runs, of specimens, weights of a discrepancy."""

from collections.abc import Mapping

from hdcal.data.case import Case
from hdcal.errors import Finding, InputError
from hdcal.inference.discrepancy import leftover_size

# Site of each kind, and the site of the spread of those that are labels in the data.
MEMBERS = {
    "run": "run_offset",
    "specimen": "specimen_deviation",
    "discrepancy": "gap_weights",
}
MEMBER_SD = {"run": "run_offset_sd", "specimen": "specimen_sd"}
# Most runs or specimens: of the kind that is eliminated one by one, and of any other,
# whose cost grows with the cube of their number.
_MOST_ELIMINATED, _MOST_DENSE = 10_000, 500


def member_counts(case: Case, with_gap: bool) -> dict[str, int]:
    """Return the number of members of each kind; with_gap adds the discrepancy's."""
    known = case.records.known
    counts = {
        "run": len(case.run_labels) if "run" in known else 0,
        "specimen": len(case.specimen_labels) if "specimen" in known else 0,
        "discrepancy": leftover_size(case.records) if with_gap else 0,
    }
    return {kind: count for kind, count in counts.items() if count}


def integrated_kinds(
    name: str, counts: Mapping[str, int], linear: frozenset[str]
) -> tuple[str, ...]:
    """Return the kinds of members to integrate out, the discrepancy last.

    Of runs and specimens the more numerous kind is first: it is eliminated one by one.

    Args:
        name: of the case.
        counts: from `member_counts`.
        linear: kinds that enter a Gaussian likelihood linearly.

    Raises:
        InputError: runs or specimens are too many.
    """
    order = sorted(counts.keys() & linear, key=lambda kind: (-counts[kind], kind))
    kinds = [kind for kind in order if kind != "discrepancy"]
    findings = []
    for kind in sorted(counts.keys() - {"discrepancy"}):
        most = _MOST_ELIMINATED if kind in kinds[:1] else _MOST_DENSE
        if counts[kind] > most:
            words = f"{counts[kind]} {kind}s are too many for one calibration"
            if most == _MOST_DENSE:
                words += " with effects, coarse readings or both runs and specimens"
            findings.append(Finding(name, words, f"give it {most} or fewer"))
    if findings:
        raise InputError(findings)
    return (*kinds, *(kind for kind in order if kind == "discrepancy"))
