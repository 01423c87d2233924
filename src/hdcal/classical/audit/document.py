"""The audit for a reader, and its result folder."""

from pathlib import Path

from hdcal.report.folder import whole_folder
from hdcal.report.plain import as_json
from hdcal.report.sheet import Section, Sheet, sheet_page
from hdcal.report.words import number

_COLUMNS = ["", "the article says", "the formula gives", "the data give", "verdict"]
_FIT_COLUMNS = ["curve", "coefficients", "s [N]", "R²"]


def audit_sheet(found: dict) -> Sheet:
    """Return the sheet of `hdcal audit`.

    Args:
        found: from `summarise_audit`.
    """
    rows = [
        [str(c["point"]), c["claim"], c["formula"], c["data"], c["verdict"]]
        for c in found["claims"]
    ]
    fits = [
        [
            one["model"],
            ", ".join(number(c) for c in one.get("coefficients", [])),
            f"{one['s_N']:.3f}" if "s_N" in one else f"{one['rms_N']:.2f} (rms)",
            f"{one['r2']:.5f}",
        ]
        for one in found["fits"]
    ]
    plural = {"holds": "hold", "does not hold": "do not hold"}
    count = ", ".join(f"{n} {plural.get(w, w)}" for w, n in found["count"].items())
    return Sheet(
        name=found["article"],
        kind="audit",
        subtitle="its claims against its own formula and readings",
        answers=[f"Of {len(rows)} claims: {count}."],
        warnings=[],
        sections=[
            Section("Claims", _COLUMNS, rows, frozenset({""})),
            Section(
                "Least squares on Table 2 (ω in mm, F in N)",
                _FIT_COLUMNS,
                fits,
                frozenset({"s [N]", "R²"}),
                ["The same from `hdcal fit`, with errors and tests."],
            ),
        ],
    )


def write_audit(found: dict, target: Path | str, *, force: bool = False) -> None:
    """Write audit.json and report.html, both or neither.

    Args:
        found: from `summarise_audit`.
        target: the folder to make.
        force: replace an older result.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    data = found["data"]
    facts = [("data", data["name"]), ("SHA-256 of the data", data["sha256"])]
    page = sheet_page(audit_sheet(found), facts, {})
    with whole_folder(target, force=force) as folder:
        (folder / "audit.json").write_text(as_json(found), "utf-8")
        (folder / "report.html").write_bytes(page.encode("utf-8", "xmlcharrefreplace"))
