"""Result folders as a test writes them."""

from pathlib import Path

from hdcal.report.saving.reserve import reserve_folder
from hdcal.report.write import Report, write_report


def write_result(report: Report, target: Path, force: bool = False) -> None:
    """Write a report into a folder."""
    with reserve_folder(target, force=force) as place:
        write_report(report, place)
