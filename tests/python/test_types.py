"""Types of the module for editors and type checkers."""

import ast
import inspect
import pathlib
import runpy

import simflex

FOLDER = pathlib.Path(__file__).parents[2] / "plugin" / "python"


def test_types_are_those_of_the_module():
    written = (FOLDER / "__init__.pyi").read_text()
    assert runpy.run_path(str(FOLDER / "write_types.py"))["write_types"]() == written, "write it anew, as write_types.py says"


def test_types_are_read_beside_the_module():
    here = pathlib.Path(simflex.__file__).parent
    assert (here / "py.typed").exists()
    tree = ast.parse((here / "__init__.pyi").read_text())
    told = {node.name for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert told == {name for name in vars(simflex) if not name.startswith("_")}
    # Every name in a type is built in, or defined or imported in the file.
    known = told | {alias.asname or alias.name for node in tree.body if isinstance(node, (ast.Import, ast.ImportFrom))
                    for alias in node.names}
    known |= {"__version__", "str", "int", "float", "bool", "bytes", "complex", "property", "staticmethod", "RuntimeError", "UserWarning", "ValueError"}
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    assert names - known == set()


def test_all_is_documented():
    for name, value in vars(simflex).items():
        if name.startswith("_"):
            continue
        assert inspect.getdoc(value), name
        for member, method in vars(value).items() if inspect.isclass(value) else ():
            if not member.startswith("_") and not isinstance(method, property):
                said = inspect.getdoc(method).splitlines()[1:]
                assert any(said), f"{name}.{member} has no docstring"
