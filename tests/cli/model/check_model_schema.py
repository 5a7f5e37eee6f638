"""Validates models against the JSON schema, then mutations of them.

check_model_schema.py FOLDER MODEL...: FOLDER/schema.json is the schema. Ends with status 1 if a model is
refused. Each mutation is left as FOLDER/NUMBER_accept.json or NUMBER_refuse.json: what the schema says.
"""

import copy
import json
import re
import sys

import jsonschema
import yaml


class Loader(yaml.SafeLoader):
    """YAML 1.2: `on` is a word, 1e-5 a number."""


Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers
            if not tag.endswith((":bool", ":float", ":int", ":timestamp"))]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()}
Loader.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile("^(?:true|false)$"), "tf")
Loader.add_implicit_resolver("tag:yaml.org,2002:int", re.compile(r"^[-+]?[0-9]+$"), "-+0123456789")
Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?$"), "-+.0123456789")


def walk(value, path=()):
    yield path, value
    if isinstance(value, dict):
        for key, child in value.items():
            yield from walk(child, path + (key,))
    if isinstance(value, list):
        for index, child in enumerate(value):
            yield from walk(child, path + (index,))


def replace(model, path, change):
    """A copy of the model in which change(parent, last key) was made."""
    model = copy.deepcopy(model)
    parent = model
    for key in path[:-1]:
        parent = parent[key]
    change(parent, path[-1])
    return model


def with_text_keys(value):
    if isinstance(value, dict):
        return {str(key): with_text_keys(child) for key, child in value.items()}
    if isinstance(value, list):
        return [with_text_keys(child) for child in value]
    return value


def mutate(model):
    """Pairs of a mutation and whether the reader must accept it if the schema does."""
    for path, value in walk(model):
        if not path or path[0] in ("simflex", "parameters", "tables"):
            continue
        for wrong in ([[["x"]]], {"nonsense": {"more": 1}}, "no such choice"):
            yield replace(model, path, lambda parent, key: parent.__setitem__(key, wrong)), not isinstance(wrong, str)
        if isinstance(value, dict):
            yield replace(model, path, lambda parent, key: parent[key].__setitem__("nonsense", [[1]])), True
        if isinstance(path[-1], str):
            yield replace(model, path, lambda parent, key: parent.pop(key)), False


def main():
    folder, models = sys.argv[1], sys.argv[2:]
    with open(folder + "/schema.json", encoding="utf-8") as file:
        schema = json.load(file)
    jsonschema.Draft7Validator.check_schema(schema)
    validator = jsonschema.Draft7Validator(schema)
    status = 0
    number = 0
    for path in models:
        with open(path, encoding="utf-8") as file:
            model = with_text_keys(yaml.load(file, Loader))
        for error in validator.iter_errors(model):
            print(path, list(error.absolute_path), error.message[:300], file=sys.stderr)
            status = 1
        if not path.endswith(("keys.yaml", "mechanisms.yaml")):
            continue
        for index, (mutation, is_two_sided) in enumerate(mutate(model)):
            if index % 8 != 0:
                continue
            is_valid = validator.is_valid(mutation)
            if is_valid and not is_two_sided:
                continue
            number += 1
            verdict = "accept" if is_valid else "refuse"
            with open(f"{folder}/{number:05d}_{verdict}.json", "w", encoding="utf-8") as file:
                json.dump(mutation, file)
    return status


sys.exit(main())
