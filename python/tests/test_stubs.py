"""The stubs say what the compiled half has."""

import ast
import inspect
from pathlib import Path

import sph_prep
from sph_prep import _core


def test_stubs_have_the_functions_and_their_arguments():
    stubs = ast.parse((Path(sph_prep.__file__).parent / "_core.pyi").read_text())
    stated = {node.name: node for node in stubs.body if isinstance(node, ast.FunctionDef)}
    there = {name for name, value in vars(_core).items() if inspect.isroutine(value)}
    assert set(stated) == there
    for name, node in stated.items():
        found = inspect.signature(getattr(_core, name)).parameters.values()
        arguments = node.args.args
        assert [p.name for p in found] == [a.arg for a in arguments], name
        defaults = [p.default for p in found if p.default is not inspect.Parameter.empty]
        assert [ast.literal_eval(d) for d in node.args.defaults] == defaults, name
    classes = {node.name for node in stubs.body if isinstance(node, ast.ClassDef)}
    assert classes == {name for name, value in vars(_core).items() if inspect.isclass(value)}


def test_everything_public_has_types_and_a_docstring():
    assert (Path(sph_prep.__file__).parent / "py.typed").exists()
    for name in set(sph_prep.__all__) - {"__version__"}:
        value = getattr(sph_prep, name)
        assert inspect.getdoc(value), name
        members = [value] if inspect.isfunction(value) else [m for n, m in vars(value).items() if inspect.isfunction(m) and n[0] != "_"]
        for member in members:
            hints = inspect.signature(member)
            assert hints.return_annotation is not inspect.Signature.empty, (name, member)
            untyped = [p.name for p in hints.parameters.values() if p.annotation is inspect.Parameter.empty and p.name != "self"]
            assert not untyped and inspect.getdoc(member), (name, member, untyped)
