"""What tests of predictions share."""

from collections.abc import Iterator

import numpy as np
import pytest

from hdcal.prediction.margin import refined


@pytest.fixture(autouse=True)
def counted(request: pytest.FixtureRequest) -> Iterator[None]:
    """Rare events counted among the draws, which are written by hand.

    They are not of the posterior of the readings beside them, which would else count.
    """
    with pytest.MonkeyPatch.context() as patch:
        if request.module.__name__ != "test_rare":
            patch.setattr(refined, "_ENOUGH", np.inf)
        yield
