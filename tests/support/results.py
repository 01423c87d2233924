"""Result folders as a test writes them."""

from pathlib import Path

from hdcal.report.saving import Target
from hdcal.report.write import Report, write_report


def write_result(report: Report, target: Path, force: bool = False) -> None:
    """Write a report into a folder."""
    with Target(str(target), force) as place:
        write_report(report, place)
