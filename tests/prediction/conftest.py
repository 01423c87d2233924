"""What tests of predictions share."""

import numpy as np
import pytest

from hdcal.prediction.margin import refined


@pytest.fixture
def counted(monkeypatch):
    """Rare events counted among the draws, which are written by hand.

    They are not of the posterior of the readings beside them, which would else count.
    """
    monkeypatch.setattr(refined, "_ENOUGH", np.inf)
