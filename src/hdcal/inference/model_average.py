"""The posterior of a diagnosis: models of the same data with their probabilities.

In its file each model is a group named by its hypothesis, with the groups of a single
calibration below it and its probability among the attributes.
"""

import json
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import xarray as xr

from hdcal.data.case import Case
from hdcal.inference.posterior import HYPOTHESIS, Library, Posterior
from hdcal.inference.posterior_file import (
    CALIBRATION,
    content,
    file_of,
    not_a_posterior,
    read_tree,
)

# Hypotheses that name no effect.
NONE, UNKNOWN = "none", "unknown"
_WEIGHT, _LEFT_OUT = "probability", "left_out"


@dataclass(frozen=True)
class LeftOut:
    """Probability of hypotheses without a calibration, counted as that of another."""

    probability: float
    counted_as: str


@dataclass(frozen=True)
class ModelAverage:
    """Calibrated models of the same data by hypothesis, each with its probability.

    The probabilities sum to 1; `left_out` is what has no model among these.
    """

    posteriors: Mapping[str, tuple[float, Posterior]]
    left_out: LeftOut | None = None

    def __repr__(self) -> str:
        shares = {name: share for name, (share, _) in self.posteriors.items()}
        listed = ", ".join(f"{name} {share:.0%}" for name, share in shares.items())
        return f"<ModelAverage of {self.case.name}: {listed}>"

    @property
    def case(self) -> Case:
        """Data and gear."""
        return next(iter(self.posteriors.values()))[1].case

    @property
    def tree(self) -> xr.DataTree:
        """All groups, those of a model below its hypothesis."""
        tree = xr.DataTree()
        for name, (share, posterior) in self.posteriors.items():
            node = posterior.tree.copy()
            node.attrs = {**posterior.attributes(), _WEIGHT: float(share)}
            tree[name] = node
        return tree

    def require_usable(self) -> None:
        """Raise `NotUsable` if any model failed its checks."""
        for _, posterior in self.posteriors.values():
            posterior.require_usable()

    def save(self, path: Path | str) -> None:
        """Write the models as one NetCDF file that ArviZ opens."""
        Path(path).write_bytes(self.to_netcdf())

    def to_netcdf(self) -> bytes:
        """Return the content of a NetCDF file that ArviZ opens."""
        left = None if self.left_out is None else asdict(self.left_out)
        return content(self.tree, CALIBRATION, {_LEFT_OUT: json.dumps(left)})

    @classmethod
    def load(cls, path: Path | str, effects: Library | None = None) -> "ModelAverage":
        """Read the models of a diagnosis; errors as of `Posterior.load`."""
        file = file_of(path)
        return cls.from_tree(read_tree(file), file, effects)

    @classmethod
    def from_tree(
        cls, tree: xr.DataTree, file: Path, effects: Library | None = None
    ) -> "ModelAverage":
        """Return the models of a tree that was read from a file, as `load`."""
        try:
            left = json.loads(tree.attrs[_LEFT_OUT])
            shares = {name: n.attrs[_WEIGHT] for name, n in tree.children.items()}
            left_out = None if left is None else LeftOut(**left)
        except (KeyError, ValueError, TypeError) as error:
            raise not_a_posterior(file) from error
        posteriors = {}
        for name, share in sorted(shares.items(), key=lambda item: -item[1]):
            model = Posterior.from_tree(tree.children[name], file, effects)
            model = replace(model, settings={**model.settings, HYPOTHESIS: name})
            posteriors[name] = float(share), model
        return cls(posteriors, left_out)


def load_models(
    path: Path | str, kinds: Collection[type[Posterior]] = ()
) -> Posterior | ModelAverage:
    """Read a calibration of the gear at rest, or the models of a diagnosis.

    The path is a result folder or its posterior.nc; `kinds` are further kinds of
    posteriors that may be read. Errors as of `Posterior.load`.
    """
    file = file_of(path)
    tree = read_tree(file)
    if "model" not in tree.attrs:
        return ModelAverage.from_tree(tree, file)
    written = json.loads(tree.attrs["model"])["kind"]
    kind = next((kind for kind in kinds if kind.kind == written), Posterior)
    return kind.from_tree(tree, file)
