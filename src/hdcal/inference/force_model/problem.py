"""One inference problem: data, priors and structure, as a pytree of arrays."""

from collections.abc import Mapping, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import jit
from jaxtyping import Float, Int, Key

from hdcal.data.case import Case
from hdcal.data.gear_file.certificates import is_stated
from hdcal.data.prior import Prior
from hdcal.data.records import FEATURE_WORDS, Array, Records
from hdcal.data.theory_names import Theory
from hdcal.errors import Finding, Findings
from hdcal.inference.force_model.compression import CompressedRows, compress
from hdcal.inference.force_model.discrepancy import (
    Discrepancy,
    build_discrepancy,
    discrepancy_columns,
)
from hdcal.inference.force_model.likelihood import pointwise_log_likelihood
from hdcal.inference.force_model.marginal import draw_members, linear_part
from hdcal.inference.force_model.model import declare
from hdcal.inference.force_model.padding import measured, pad_records
from hdcal.inference.force_model.priors import (
    problem_priors,
    unit_stiffness,
    without_scatter,
)
from hdcal.inference.force_model.serial_correlation import previous_rows
from hdcal.inference.force_model.structure import ModelStructure, decide_structure
from hdcal.inference.sampled_problem import Sampled, Values
from hdcal.physics.chain import Reading, linear_columns
from hdcal.physics.effect import Effect

# The cost of a density grows with the cube of the number of runs or specimens.
_MOST_MEMBERS = 200
_base_columns = jit(linear_columns)
# Fields of a problem that hold rows one by one.
_BY_ROW = ("records", "columns", "before")


class Problem(Sampled):
    """The force model of one case; only arrays change between data sets of one shape.

    Rows are compressed to `blocks`, or padded: `count` of them were measured.
    """

    # In code units, K under the theory of the problem.
    priors: dict[str, Prior]
    # k_theory/E, radial [mm].
    unit_stiffness: Float[Array, ""] | float
    reading: Reading
    records: Records | None
    blocks: CompressedRows | None
    # Basis of the discrepancy at the padded rows.
    columns: Float[Array, "n m"] | None
    discrepancy: Discrepancy | None
    # Of rounding [N], 0 for none.
    step: Float[Array, ""] | float
    # Deformation as read at which the unloaded part is expected [mm], and middle of the
    # readings from there.
    contact: Float[Array, ""] | float
    centre: Float[Array, ""] | float
    # Mean of the readings [N].
    level: Float[Array, ""] | float
    count: int
    # From `previous_rows`, if neighbours are correlated.
    before: Int[Array, " n"] | None
    effects: tuple[type[Effect], ...] = eqx.field(static=True)
    # Exact likelihood of rounded readings, else Sheppard's correction.
    rounded: bool = eqx.field(static=True)
    # Number of runs with a zero each and of specimens with a stiffness each, or 0.
    runs: int = eqx.field(static=True)
    specimens: int = eqx.field(static=True)
    # Kinds of members that are integrated out.
    integrated: tuple[str, ...] = eqx.field(static=True)
    correlated: bool = eqx.field(static=True)
    # Whether a certificate states the zero of the force gauge.
    zero_stated: bool = eqx.field(static=True)

    @property
    def sampled_weights(self) -> int:
        """Number of weights of a discrepancy that is not integrated out."""
        is_sampled = "discrepancy" not in self.integrated
        return self.discrepancy.size if self.discrepancy and is_sampled else 0

    @property
    def start(self) -> Mapping[str, Any]:
        """The mean reading: the middle of a wide prior of the zero can be far off."""
        return {"_centre_force": self.level}

    def priors_given(self, values: Mapping) -> dict[str, Prior]:
        """Return the priors, that of the force zero given how mountings differ.

        A certificate states the zero of the gauge itself. To it the mean of n tested
        mountings adds N(0, τ²/n), τ their sd: the parameter is the zero of that mean.
        """
        if not (self.runs and self.zero_stated):
            return self.priors
        middle, gauge = self.priors["force_offset"].numbers
        of_mean = jnp.asarray(values["run_offset_sd"]) / jnp.sqrt(self.runs)
        zero = Prior("normal", (middle, jnp.hypot(gauge, of_mean)))
        return {**self.priors, "force_offset": zero}

    def declare(self) -> None:
        """Declare the joint density."""
        declare(self)

    def log_likelihood(self, values: Values) -> Float[Array, ""]:
        """Return the log likelihood of the measured rows [log 1/N]."""
        if self.integrated or self.blocks is not None:
            return linear_part(self, values).log_likelihood()
        rows = self.rows, self.columns, self.before
        each = pointwise_log_likelihood(self, values, *rows)
        return jnp.sum(jnp.where(measured(len(each), self.count), each, 0.0))

    def draw_members(self, values: Values, key: Key[Array, ""]) -> dict[str, Any]:
        """Draw the members that are integrated out, given the values of one draw."""
        return draw_members(self, values, key) if self.integrated else {}

    @property
    def rows(self) -> Records:
        """The kept rows, padded."""
        assert self.records is not None, "the rows of this problem are compressed"
        return self.records


def without_texts(priors: Mapping[str, Prior]) -> dict[str, Prior]:
    """Return priors without unit and source.

    Strings are static parts of a pytree: other ones would be compiled again.
    """
    return {
        name: Prior(prior.family, tuple(map(np.float64, prior.numbers)))
        for name, prior in priors.items()
    }


def build_problem(
    case: Case,
    shipped: Mapping[str, Prior],
    effects: Sequence[type[Effect]] = (),
    *,
    theory: Theory | None = None,
    structure: ModelStructure | None = None,
) -> Problem:
    """Turn a case into a problem, its rows compressed but for effects and rounding.

    Theory and structure are by default the gear's and that which the readings show.
    `InputError` if an effect lacks its covariates or a prior.
    """
    records, reading = case.records, case_reading(case)
    labels = {"run": case.run_labels, "specimen": case.specimen_labels}
    members = {k: len(names) for k, names in labels.items() if k in records.known}
    _check(case, effects, members)
    effects, theory = without_scatter(effects), theory or case.gear.theory
    priors = problem_priors(case, effects, shipped, theory)
    form = structure or decide_structure(case, effects)
    discrepancy = build_discrepancy(records, effects) if form.with_gap else None
    before = previous_rows(records) if form.correlated else None
    compressed = not (form.rounded or effects)
    kept = _kept_rows(records, reading, discrepancy, before, compressed=compressed)
    integrated = []
    if not (form.rounded or any(effect.mixture for effect in effects)):
        # Through an effect the force need not be linear in the stiffness.
        integrated = [
            kind for kind in members if kind == "run" or kept["blocks"] is not None
        ]
        integrated += ["discrepancy"] if form.with_gap else []
    return Problem(
        priors=without_texts(priors),
        unit_stiffness=unit_stiffness(case, theory),
        reading=reading,
        **kept,
        count=len(records.force),
        discrepancy=discrepancy,
        step=case.gear.force_resolution,
        effects=effects,
        rounded=form.rounded,
        correlated=form.correlated,
        zero_stated=is_stated(case.gear.priors["force_offset"]),
        runs=members.get("run", 0),
        specimens=members.get("specimen", 0),
        integrated=tuple(integrated),
        contact=case.gear.contact,
        centre=float(np.min(case.from_unloaded) + np.max(case.from_unloaded)) / 2.0,
        level=float(np.mean(records.force)),
    )


def _kept_rows(
    records: Records,
    reading: Reading,
    discrepancy: Discrepancy | None,
    before: np.ndarray | None,
    *,
    compressed: bool,
) -> dict[str, Any]:
    """Return the fields of a problem that hold rows, compressed if they can be."""
    padded, rows = pad_records(records), len(records.force)
    columns = discrepancy_columns(discrepancy, padded)
    if compressed:
        base = np.asarray(_base_columns(padded, reading))[:rows]
        design = base if columns is None else np.hstack([base, columns[:rows]])
        blocks = compress(design, records, before)
        if blocks is not None:
            return {"blocks": blocks, **dict.fromkeys(_BY_ROW)}
    if before is not None:
        extra = (0, len(padded.force) - rows)
        before = np.pad(before, extra, constant_values=-1)
    return {
        "blocks": None,
        **dict(zip(_BY_ROW, (padded, columns, before), strict=True)),
    }


def _check(
    case: Case, effects: Sequence[type[Effect]], members: Mapping[str, int]
) -> None:
    """Raise `InputError` where covariates are missing, or members are too many."""
    with Findings() as findings:
        for effect in effects:
            for need in sorted(effect.needs - case.records.known):
                named = FEATURE_WORDS.get(need, need)
                words = f"effect '{effect.name}' needs {named}, which these data lack"
                remedy = "measure it, or leave the effect out"
                findings.append(Finding(case.name, words, remedy))
        for kind, count in members.items():
            if count > _MOST_MEMBERS:
                words = f"{count} {kind}s are too many for one calibration"
                remedy = f"give it {_MOST_MEMBERS} or fewer; fleet takes any number"
                findings.append(Finding(case.name, words, remedy))


def case_reading(case: Case) -> Reading:
    """Return how the rig reads."""
    half = case.gear.reading == "diametral"
    return Reading(0.5 if half else 1.0, case.gear.reference_temperature)
