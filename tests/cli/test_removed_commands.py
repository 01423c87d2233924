"""A former command is bad input, and the message says what to use instead."""

import pytest
from commands import Hdcal

from hdcal.__main__ import REMOVED
from hdcal.__main__ import hdcal as root


@pytest.mark.parametrize("name", REMOVED)
def test_a_former_command_names_its_successor(here: Hdcal, name: str):
    done = here(name)
    assert name not in root.commands
    assert done.returncode == 2 and not done.stdout
    assert REMOVED[name] in " ".join(done.stderr.split())
