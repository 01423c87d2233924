"""Every effect declares its stage, needs, units, prior, source and documentation."""

import dataclasses
import re
from pathlib import Path

import numpy as np
from effect_bench import BEYOND_RECORDS, everyone

from hdcal import EFFECTS
from hdcal.data.priors import effect_priors
from hdcal.data.units import to_code
from hdcal.physics.effect import parameters
from hdcal.physics.groups import GROUPS

DOCS = Path(__file__).parents[2] / "docs" / "effects"
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
def test_the_docstring_states_its_source(name):
    text = EFFECTS[name].__doc__
    assert len(text.splitlines()[0]) <= 80
    assert re.search(r"Source: \S+", text)


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


@everyone
def test_the_documentation_has_a_page(name):
    page = (DOCS / f"{name}.md").read_text("utf-8")
    assert page.startswith(f"# {name}\n")
    assert f"*{EFFECTS[name].stage.capitalize()} stage." in page
    for field in parameters(EFFECTS[name]):
        assert f"`{name}.{field}`" in page
    reference = page.partition("## Reference\n")[2].strip()
    assert len(reference) > 20
    index = (DOCS / "index.md").read_text("utf-8")
    fields = ", ".join(parameters(EFFECTS[name]))
    needs = ", ".join(sorted(EFFECTS[name].needs)) or "–"
    row = f"| [{name}]({name}.md) | {EFFECTS[name].stage} | {fields} | {needs} |"
    assert row in index
    assert f"\n{name}\n" in index


def test_the_page_says_of_each_group_what_answers_say():
    page = (DOCS / "index.md").read_text("utf-8")
    for name, group in GROUPS.items():
        own = [n for n, effect in EFFECTS.items() if name in effect.groups]
        links = ", ".join(f"[{n}]({n}.md)" for n in own)
        told = " | ".join((name, group.meaning, links, group.remedy, group.run))
        assert f"| {told} |" in page
