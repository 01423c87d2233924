"""Loops are compiled as one piece where that can still be said, and only there."""

import os
import subprocess
import sys

import pytest

CALLED = "from hdcal.cli.compilation_cache import compile_loops_whole as whole\n"
LOOP = """
import jax, jax.numpy as jnp

def turn(_, x):
    return jnp.sin(x) + jnp.roll(x, 1)

loop = jax.jit(lambda x: jax.lax.fori_loop(0, 100, turn, x))
print("small_call" in loop.lower(jnp.ones(2000)).compile().as_text())
"""


def told(script: str, flags: str | None = None) -> str:
    env = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"}
    env |= {} if flags is None else {"XLA_FLAGS": flags}
    command = [sys.executable, "-c", CALLED + script]
    return subprocess.run(
        command, env=env, capture_output=True, text=True, check=True
    ).stdout


@pytest.mark.parametrize("flags", [None, "--xla_cpu_use_fusion_emitters=false"])
def test_a_loop_is_one_kernel(flags):
    """Whatever else the user asks of XLA; and of two calls the second says nothing."""
    assert told("whole(); whole()" + LOOP, flags) == "True\n"
    assert told(LOOP, flags) == "False\n"


@pytest.mark.parametrize(
    ("script", "flags"),
    [("whole()", "--xla_backend_extra_options=xla_cpu_other=1"), ("import jax", "")],
)
def test_what_the_user_said_stands_and_nothing_is_said_too_late(script, flags):
    shown = script + "\nwhole()\nimport os; print(os.environ['XLA_FLAGS'])"
    assert told(shown, flags) == f"{flags}\n"
