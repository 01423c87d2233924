"""Each test of effects fails for an effect that breaks its promise."""

from inspect import signature

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
    size: float = parameter("N/K", "an amplitude", typical=0.10501, null=0.0)

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


def check(test, request, given) -> None:
    """Run a test of effects on the effect named broken."""
    names = [name for name in signature(test).parameters if name not in given]
    fixtures = {n: request.getfixturevalue(n) for n in names if n != "name"}
    test("broken", **given, **fixtures)


HONEST = [
    (test_effects.test_null_changes_nothing, {"seed": 0}),
    (test_effects.test_at_its_typical_size_it_does_something, {}),
    (
        test_effects.test_gradients_are_finite,
        {"size": test_effects.typical, "moved": False},
    ),
    (test_effects.test_gradients_are_right, {"seed": 0}),
    (test_effects.test_symmetry_is_as_declared, {}),
    (test_effect_needs.test_it_uses_what_it_needs, {"need": "temperature"}),
    *[
        (test_effect_needs.test_it_looks_at_nothing_undeclared, {"covariate": name})
        for name in test_effect_needs.LICENCES
    ],
    (test_effect_units.test_units_do_not_matter, {}),
]
BROKEN = [
    (NotNullAtNull, test_effects.test_null_changes_nothing, {"seed": 0}),
    (
        KinkAtNull,
        test_effects.test_gradients_are_finite,
        {"size": test_effects.null, "moved": True},
    ),
    (WrongSlope, test_effects.test_gradients_are_right, {"seed": 0}),
    (NotEven, test_effects.test_symmetry_is_as_declared, {}),
    (
        LooksAtTime,
        test_effect_needs.test_it_looks_at_nothing_undeclared,
        {"covariate": "time"},
    ),
    (
        NeedsNothing,
        test_effect_needs.test_it_uses_what_it_needs,
        {"need": "temperature"},
    ),
    (OtherUnit, test_effect_units.test_units_do_not_matter, {}),
    (HardCoded, test_effect_units.test_units_do_not_matter, {}),
    (NotToBeFound, test_effect_recovery.test_recovered_from_its_own_data, {}),
    (Broken, test_effect_declarations.test_priors_exist_with_the_declared_unit, {}),
]


@pytest.mark.parametrize(("test", "given"), HONEST)
def test_a_right_effect_passes(monkeypatch, request, test, given):
    monkeypatch.setitem(EFFECTS, "broken", Broken)
    check(test, request, given)


@pytest.mark.parametrize(("effect", "test", "given"), BROKEN)
def test_a_broken_effect_fails(monkeypatch, request, effect, test, given):
    monkeypatch.setitem(EFFECTS, "broken", effect)
    with pytest.raises((AssertionError, KeyError, FileNotFoundError)):
        check(test, request, given)


def test_an_effect_that_spoils_others_fails(monkeypatch, scattered, base, reading):
    monkeypatch.setitem(EFFECTS, "broken", SpoilsOthers)
    with pytest.raises(AssertionError):
        test_effects.test_any_two_compose("outliers", scattered, base, reading)
