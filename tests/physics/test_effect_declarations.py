"""Every effect declares its stage, needs, units and prior."""

import dataclasses

import numpy as np
from effect_bench import BEYOND_RECORDS, everyone

from hdcal import EFFECTS
from hdcal.data.priors import effect_priors
from hdcal.data.units import to_code
from hdcal.physics.effect import parameters
from hdcal.physics.groups import GROUPS

STAGES = ("deformation", "force", "sensor", "noise")


@everyone
def test_the_declaration_is_complete(name, loading):
    effect = EFFECTS[name]
    assert effect.name == name
    assert effect.stage in STAGES
    assert effect.symmetry in ("odd", "even", "none")
    assert effect.groups and {*effect.groups} <= GROUPS.keys()
    assert effect.needs <= loading.known | BEYOND_RECORDS
    declared = parameters(effect)
    assert list(declared) == [field.name for field in dataclasses.fields(effect)]
    assert declared
    for about in declared.values():
        assert about.meaning
        assert len(about.meaning) <= 80
        assert about.typical != about.null
        assert np.isfinite(about.typical)


@everyone
def test_priors_exist_with_the_declared_unit(name):
    priors = effect_priors()
    for field, about in parameters(EFFECTS[name]).items():
        prior = priors[f"{name}.{field}"]
        assert to_code(about.unit) == (1.0, prior.unit)
        assert prior.source
        assert not prior.source.startswith("given in")


def test_no_prior_without_an_effect():
    declared = {
        f"{name}.{field}" for name in EFFECTS for field in parameters(EFFECTS[name])
    }
    assert set(effect_priors()) == declared
