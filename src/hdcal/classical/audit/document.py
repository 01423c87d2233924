"""The audit in words."""

from collections.abc import Mapping

from hdcal.classical.audit.answer import AuditAnswer, AuditedFit, PrintedCurve
from hdcal.report.document import Document, Section, Table, Text
from hdcal.report.words import number

_PLURAL = {"holds": "hold", "does not hold": "do not hold"}


def headline(count: Mapping[str, int]) -> str:
    """Return how many claims have each verdict, in one sentence."""
    each = ", ".join(f"{n} {_PLURAL.get(word, word)}" for word, n in count.items())
    return f"Of {sum(count.values())} claims: {each}."


def audit_document(found: AuditAnswer) -> Document:
    """Return the report of the audit."""
    claims = [
        [str(c.point), c.claim, c.formula, c.data, c.verdict] for c in found.claims
    ]
    columns = ["", "the article says", "the formula gives", "the data give", "verdict"]
    fits = Table(
        ["curve", "coefficients", "s [N]", "R²"],
        [_fit_row(one) for one in found.fits],
        frozenset({"s [N]", "R²"}),
    )
    note = Text("The same from `hdcal fit`, with errors and tests.", soft=True)
    return Document(
        name=found.article,
        kind="audit",
        subtitle="its claims against its own formula and readings",
        headline=found.headline,
        sections=[
            Section("Claims", [Table(columns, claims, frozenset({""}))], brief=True),
            Section("Least squares on Table 2 (ω in mm, F in N)", [fits, note], True),
        ],
        provenance=[
            ("data", found.data.name),
            ("SHA-256 of the data", found.data.sha256),
        ],
    )


def _fit_row(one: AuditedFit | PrintedCurve) -> list[str]:
    if isinstance(one, PrintedCurve):
        return [one.model, "", f"{one.rms_N:.2f} (rms)", f"{one.r2:.5f}"]
    listed = ", ".join(number(c) for c in one.coefficients)
    return [one.model, listed, f"{one.s_N:.3f}", f"{one.r2:.5f}"]
