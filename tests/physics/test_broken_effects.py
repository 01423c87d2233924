"""The tests of effects catch each an effect that breaks just their promise."""

import jax.numpy as jnp
import pytest
import test_effect_declarations
import test_effect_needs
import test_effect_recovery
import test_effect_units
import test_effects

from hdcal import EFFECTS
from hdcal.physics.effect import Effect, Noise, parameter


class Broken(
    Effect, stage="sensor", groups=("rig",), needs=("temperature",), symmetry="even"
):
    """A thermal zero that is right; each subclass breaks one promise."""

    size: float = parameter("N/K", "an amplitude", typical=0.1, null=0.0)

    def apply(self, signal, rows):
        return signal + self.size * rows.temperature_rise


class NotNullAtNull(Broken):
    def apply(self, signal, rows):
        return signal + (self.size + 1e-9) * rows.temperature_rise


class KinkAtNull(Broken):
    def apply(self, signal, rows):
        return signal + jnp.sqrt(self.size**2) * rows.temperature_rise


class WrongSlope(Broken):
    def apply(self, signal, rows):
        # A step: its derivative is zero wherever it exists.
        return signal + jnp.round(100.0 * self.size) / 100.0 * rows.temperature_rise


class NotEven(Broken):
    def apply(self, signal, rows):
        return signal + self.size * rows.temperature_rise * rows.deformation


class LooksAtTime(Broken):
    def apply(self, signal, rows):
        drift = 1e-3 * rows.records.time
        return signal + self.size * (rows.temperature_rise + drift)


class NeedsNothing(Broken):
    def apply(self, signal, rows):
        return signal + 10.0 * self.size


class OtherUnit(Broken):
    def apply(self, signal, rows):
        return signal + self.size * rows.temperature_rise * rows.stiffness / 200.0


class HardCoded(Broken):
    def apply(self, signal, rows):
        return signal + 0.1 * jnp.tanh(10.0 * self.size) * rows.temperature_rise


class SpoilsOthers(Broken):
    stage = "noise"

    def apply(self, signal, rows):
        # Forgets the components that other effects of the noise have made.
        sd = signal.sd[:1] + self.size * jnp.abs(rows.temperature_rise)
        return Noise(jnp.zeros(1), sd)


class NotToBeFound(Broken):
    def apply(self, signal, rows):
        return signal + self.size


def register(monkeypatch, effect):
    monkeypatch.setitem(EFFECTS, "broken", effect)


def test_the_honest_one_passes(
    monkeypatch, scattered, loading, base, reading, differences
):
    register(monkeypatch, Broken)
    test_effects.test_null_changes_nothing("broken", 0, scattered, base, reading)
    test_effects.test_at_its_typical_size_it_does_something(
        "broken", loading, base, reading
    )
    for size in (test_effects.null, test_effects.typical):
        test_effects.test_gradients_are_finite(
            "broken", size, False, scattered, base, reading
        )
    test_effects.test_gradients_are_right(
        "broken", 0, scattered, base, reading, differences
    )
    test_effects.test_symmetry_is_as_declared("broken", scattered, base, reading)
    test_effects.test_any_two_compose("outliers", scattered, base, reading)
    test_effect_needs.test_it_uses_what_it_needs(
        "broken", "temperature", loading, base, reading
    )
    for covariate in test_effect_needs.LICENCES:
        test_effect_needs.test_it_looks_at_nothing_undeclared(
            "broken", covariate, loading, base, reading
        )
    test_effect_units.test_units_do_not_matter("broken", scattered, base, reading)


def test_not_null_at_null(monkeypatch, scattered, base, reading):
    register(monkeypatch, NotNullAtNull)
    with pytest.raises(AssertionError):
        test_effects.test_null_changes_nothing("broken", 0, scattered, base, reading)


def test_no_slope_at_null(monkeypatch, scattered, base, reading):
    register(monkeypatch, KinkAtNull)
    with pytest.raises(AssertionError):
        test_effects.test_gradients_are_finite(
            "broken", test_effects.null, True, scattered, base, reading
        )


def test_wrong_slope(monkeypatch, scattered, base, reading, differences):
    class OffTheStep(WrongSlope):
        size: float = parameter("N/K", "an amplitude", typical=0.10501, null=0.0)

    register(monkeypatch, OffTheStep)
    with pytest.raises(AssertionError):
        test_effects.test_gradients_are_right(
            "broken", 0, scattered, base, reading, differences
        )


def test_wrong_symmetry(monkeypatch, scattered, base, reading):
    register(monkeypatch, NotEven)
    with pytest.raises(AssertionError):
        test_effects.test_symmetry_is_as_declared("broken", scattered, base, reading)


def test_undeclared_covariate(monkeypatch, loading, base, reading):
    register(monkeypatch, LooksAtTime)
    with pytest.raises(AssertionError):
        test_effect_needs.test_it_looks_at_nothing_undeclared(
            "broken", "time", loading, base, reading
        )


def test_needless_need(monkeypatch, loading, base, reading):
    register(monkeypatch, NeedsNothing)
    with pytest.raises(AssertionError):
        test_effect_needs.test_it_uses_what_it_needs(
            "broken", "temperature", loading, base, reading
        )


@pytest.mark.parametrize("effect", [OtherUnit, HardCoded])
def test_wrong_unit(monkeypatch, scattered, base, reading, effect):
    register(monkeypatch, effect)
    with pytest.raises(AssertionError):
        test_effect_units.test_units_do_not_matter("broken", scattered, base, reading)


def test_spoils_others(monkeypatch, scattered, base, reading):
    register(monkeypatch, SpoilsOthers)
    with pytest.raises(AssertionError):
        test_effects.test_any_two_compose("outliers", scattered, base, reading)


def test_not_to_be_found(monkeypatch, loading, base, reading):
    register(monkeypatch, NotToBeFound)
    with pytest.raises(AssertionError):
        test_effect_recovery.test_recovered_from_its_own_data(
            "broken", loading, base, reading
        )


@pytest.mark.parametrize(
    "promise",
    [
        test_effect_declarations.test_priors_exist_with_the_declared_unit,
        test_effect_declarations.test_the_documentation_has_a_page,
        test_effect_declarations.test_the_docstring_states_its_source,
    ],
)
def test_undocumented(monkeypatch, promise):
    register(monkeypatch, Broken)
    with pytest.raises((AssertionError, KeyError, FileNotFoundError)):
        promise("broken")
