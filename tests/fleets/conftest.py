"""Fleets are computed in double precision, as every case makes them be."""

import jax
import pytest


@pytest.fixture(autouse=True)
def _double():
    jax.config.update("jax_enable_x64", True)
