"""Reading for a check: a case, or a folder with a file for each gear as one case."""

from typing import TYPE_CHECKING, Any

from hdcal.cli.console import Console
from hdcal.cli.options import read_given, without_meaning

if TYPE_CHECKING:
    from hdcal.data.case import Case


def read_whole(console: Console, given: dict[str, Any]) -> "Case | None":
    """Read what `case_options` named; the console collects the findings.

    Args:
        console: of the command.
        given: values of these options.
    """
    from hdcal.data.measurements.folder import read_gear_folder
    from hdcal.data.measurements.gear_files import gear_files

    one = given["specimen"] is not None or given["columns"] is None
    if one or not gear_files(given["data"]):
        return read_given(console, **given)
    console.wrong += without_meaning(["sheet"], "a folder of gears")
    names = "data", "gear", "columns", "theory", "reading", "encoding", "range"
    how = {name: given[name] for name in names}
    found = console.wrong.attempt(read_gear_folder, **how)
    return None if found is None else found[0]
