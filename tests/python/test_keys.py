"""Models built key by key: Python can set all keys of a model file."""

import copy
import pathlib
import pickle

import pytest
import simflex
import yaml
from models import make_pendulum

KEYS = pathlib.Path(__file__).parent.parent / "cli" / "model"


def find_forms(schema, kind):
    """Forms of a value that are maps with `kind`: `properties` or `patternProperties`."""
    forms = [schema] if kind in schema else []
    for group in ("anyOf", "oneOf", "allOf"):
        for form in schema.get(group, []):
            forms += find_forms(form, kind)
    return forms


def visit(schema, keys, path, found):
    for form in find_forms(schema, "properties"):
        for name, value in form["properties"].items():
            assert name in dir(keys), f"{path}.{name}"
            child = getattr(keys, name)
            found.append(f"{path}.{name}")
            if isinstance(child, simflex.Keys):
                visit(value, child, f"{path}.{name}", found)
            else:
                assert not find_forms(value, "properties") and not find_forms(value, "patternProperties")
    for form in find_forms(schema, "patternProperties"):
        for value in form["patternProperties"].values():
            if find_forms(value, "properties") or find_forms(value, "patternProperties"):
                visit(value, keys.add("one"), f"{path}.one", found)


def test_every_key_of_the_schema_is_an_attribute():
    found = []
    model = simflex.Model()
    del model.simflex
    visit(simflex.schema(), model, "model", found)
    assert len(found) > 300 and "model.bodies.one.mass" in found and "model.solver.accuracy" in found


@pytest.mark.parametrize("name", ["keys.yaml", "mechanisms.yaml"])
def test_files_with_every_key_are_built_key_by_key(name):
    original = simflex.Model(KEYS / name)
    said = original.to_dict()

    def build(keys, values):
        for key, value in values.items():
            if not isinstance(value, dict) or not value:
                setattr(keys, key, value)
                continue
            try:
                child = getattr(keys, key)
            except AttributeError:
                child = keys.add(key)
            build(child, value)

    model = simflex.Model()
    build(model, said)
    assert model.to_dict() == said
    assert simflex.Model.from_dict(said).to_dict() == said


def test_numbers_are_what_yaml_says():
    text = (KEYS / "keys.yaml").read_text()
    ours, theirs = simflex.Model(KEYS / "keys.yaml").to_dict(), yaml.load(text, yaml.BaseLoader)

    def compare(a, b):
        if isinstance(b, dict):
            assert list(a) == list(b)
            for key, value in b.items():
                compare(a[key], value)
        elif isinstance(b, list):
            assert len(a) == len(b)
            for one, other in zip(a, b):
                compare(one, other)
        elif isinstance(a, bool):
            assert b == str(a).lower()
        elif isinstance(a, (int, float)):
            assert a == float(b)
        else:
            assert a == b

    compare(ours, theirs)


def test_a_model_built_in_python_moves():
    model = simflex.Model()
    model.gravity = [0, -9.81, 0]
    model.parameters.length = 1
    bob = model.bodies.add("bob", mass=1, inertia=[0.02, 0.02, 0.02])
    bob.place.position = [0, "-length", 0]
    model.joints.add("pivot", type="pin", axis="z", between=["ground", {"on": "bob", "position": [0, "length", 0]}])
    model.initial.joints = {"pivot": 0.3}
    model.probes.bob = {"position": "bob"}
    model.solver.accuracy = 1e-8
    model.solver.maximum_step = 0.01
    session, same = simflex.Session(model), simflex.Session(make_pendulum(initial={"joints": {"pivot": 0.3}}))
    session.run(0.5)
    same.run(0.5)
    assert list(session["bob"]) == list(same["bob"])


def test_keys_are_read_set_and_removed():
    model = make_pendulum()
    assert model.bodies.bob.mass == 1 and model.bodies.bob.color is None
    assert model.bodies.bob.inertia == [0.02, 0.02, 0.02]
    model.bodies.bob.mass = 3
    model.bodies["bob"]["color"] = "steel"
    assert model.bodies.bob.to_dict()["mass"] == 3 and "color" in model.bodies.bob
    assert list(model.joints) == ["pivot"] and len(model.joints) == 1
    model.parameters.width = 2
    assert model.parameters.to_dict() == {"length": 1, "width": 2}
    del model.bodies.bob.color
    del model.parameters["width"]
    assert "color" not in model.bodies.bob and "width" not in model.parameters
    assert model.pictures.to_dict() == {} and len(model.pictures) == 0
    for clone in (copy.copy(model), copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
        clone.bodies.bob.mass = 5
        assert clone.bodies.bob.mass == 5 and model.bodies.bob.mass == 3
    # Keys stay valid without another reference to their model.
    bob = make_pendulum().bodies.bob
    bob.mass = 4
    assert bob.mass == 4


def test_names_that_are_none_are_refused_at_once():
    model = make_pendulum()
    with pytest.raises(AttributeError, match="'bodies.bob' has no key 'mas'; did you mean 'mass'"):
        model.bodies.bob.mas = 1
    with pytest.raises(AttributeError, match="a model has no key 'bodys'; did you mean 'bodies'"):
        model.bodys = {}
    with pytest.raises(AttributeError, match="did you mean 'bob'"):
        model.bodies.bobb
    with pytest.raises(KeyError, match="did you mean 'bob'"):
        model.bodies["bobb"]
    with pytest.raises(AttributeError, match="no key 'mas'"):
        model.bodies.add("rod", mas=1)
    with pytest.raises(KeyError, match="there already"):
        model.bodies.add("bob", mass=1)
    with pytest.raises(TypeError, match="keys of its own"):
        model.solver.add("bob")
    with pytest.raises(AttributeError):
        del model.gravty
    with pytest.raises(AttributeError):
        model.path = "elsewhere"
    assert "no key" not in simflex.keys("joints") and "axis" in simflex.keys("joints")
    with pytest.raises(RuntimeError, match="did you mean"):
        simflex.keys("joint")
