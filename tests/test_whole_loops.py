"""Loops are compiled as one piece where that can still be said, and only there."""

import os
import subprocess
import sys
from importlib.metadata import version

import pytest

# As each computation of hdcal begins; computations with a case do it too.
GEAR = "import hdcal; hdcal.Geometry(0.68, 40.0, 70.0, 70.0, 0.3)\n"
LOOP = """
import jax, jax.numpy as jnp

def turn(_, x):
    return jnp.sin(x) + jnp.roll(x, 1)

loop = jax.jit(lambda x: jax.lax.fori_loop(0, 100, turn, x))
print("small_call" in loop.lower(jnp.ones(2000)).compile().as_text())
"""
FLAGS = "import os; print(os.environ.get('XLA_FLAGS'))"


def told(script: str, flags: str | None = None) -> str:
    env = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"}
    env |= {} if flags is None else {"XLA_FLAGS": flags}
    command = [sys.executable, "-c", script]
    return subprocess.run(
        command, env=env, capture_output=True, text=True, check=True
    ).stdout


@pytest.mark.parametrize("flags", [None, "--xla_backend_optimization_level=1"])
@pytest.mark.parametrize("before", ["", "import jax\n"])
def test_a_loop_is_one_kernel(before, flags):
    """Whatever else the user asks of XLA; and of two gears the second says nothing."""
    assert told(before + GEAR + GEAR + LOOP, flags) == "True\n"
    # Later ones compile this one whole without being asked.
    if version("jaxlib").startswith("0.10."):
        assert told(before + LOOP, flags) == "False\n"


@pytest.mark.parametrize(
    ("before", "flags"),
    [
        ("", "--xla_backend_extra_options=xla_cpu_other=1"),
        ("", "a_file_of_flags.txt"),
        ("import jax; jax.devices()\n", ""),
        ("from jax._src import xla_bridge as b; del b.backends_are_initialized\n", ""),
    ],
)
def test_what_the_user_said_stands_and_nothing_is_said_too_late(before, flags):
    code = before + "from hdcal.programs.compiling import compile_loops_whole as whole"
    assert told(f"{code}\nwhole()\n{FLAGS}", flags) == f"{flags}\n"
