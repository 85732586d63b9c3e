"""The package itself: every public name has a docstring, and the types that it promises are those it has."""

import ast
import dataclasses
import enum
import importlib
import inspect
import pkgutil
import pydoc
import re
from pathlib import Path

import takt
import takt.messages

FOLDER = Path(takt.__file__).parent


def modules():
    yield takt
    for found in pkgutil.iter_modules([str(FOLDER)]):
        yield importlib.import_module("takt." + found.name)


def belongs(value):
    return (getattr(value, "__module__", None) or "").split(".")[0] == "takt"


def text_of(value):
    """The docstring without the signature that pybind11 puts in front; nothing where it is inherited from a builtin."""
    own = vars(value).get("__doc__") if inspect.isclass(value) else getattr(value, "__doc__", None)
    first, _, rest = (own or "").partition("\n\n")
    return rest if re.match(r"\w+\(.*\) -> ", first) else (own or "")


def public_names():
    """(name, object) of all that a user can reach from the package by names without an underscore."""
    seen = set()

    def of_class(name, kind):
        for member, value in vars(kind).items():
            if member.startswith("_") or member in ("name", "value") and issubclass(kind, enum.Enum):
                continue
            value = getattr(kind, member) if isinstance(value, (classmethod, staticmethod)) else value
            if isinstance(value, property) or inspect.isroutine(value) or isinstance(value, enum.Enum):
                yield f"{name}.{member}", value
            elif inspect.isclass(value):
                yield f"{name}.{member}", value
                yield from of_class(f"{name}.{member}", value)

    for module in modules():
        if module.__name__ != "takt._takt":
            yield module.__name__, module
        for name, value in vars(module).items():
            if name.startswith("_") or not belongs(value) or id(value) in seen or inspect.ismodule(value):
                continue
            seen.add(id(value))
            yield f"{module.__name__}.{name}", value
            if inspect.isclass(value):
                yield from of_class(f"{module.__name__}.{name}", value)


def test_every_public_name_has_a_docstring():
    names = dict(public_names())
    assert {"takt.Client", "takt.Client.play", "takt._takt.Client.set_signals", "takt.Requests.step",
            "takt.Topics.wait_for_contacts", "takt.Pace.lockstep", "takt.Server.start", "takt.messages.ComponentState.partner"} <= set(names)
    assert [name for name, value in names.items() if not text_of(value).strip()] == []


def test_responses_say_what_each_field_means():
    for name, kind in inspect.getmembers(importlib.import_module("takt.requests"), dataclasses.is_dataclass):
        for field in dataclasses.fields(kind):
            text = inspect.getdoc(kind)
            assert re.search(rf"^{field.name}: \S", text, re.MULTILINE), f"{name}.{field.name}"


def test_help_says_how_to_step():
    text = pydoc.plain(pydoc.render_doc(takt.Client.step))
    assert re.search(r"step\(self, steps: .*Advances a paused .*steps: number of steps", text, re.DOTALL), text


def test_units_shapes_and_frames_come_from_the_table():
    assert takt.messages.RobotState.position.__doc__ == "position of each joint (array (joints,), in rad | m)"
    assert takt.messages.ComponentState.position.__doc__ == "position of the origin of B (array (3,) x y z, in m, in frame W)"
    assert takt.messages.SignalDescription.upper.__doc__.endswith("(in the unit of the signal)")
    assert "(array (vertices, 3), in m, in frame B)" in takt.messages.ComponentDescription.vertices.__doc__
    assert "None" in takt.messages.ComponentState.partner.__doc__


def test_help_says_what_a_sample_holds():
    text = takt.Topics.wait_for_contact_pressures.__doc__
    assert "pairs: pairs in the order of the request" in text and "time: simulated time (in s)" in text
    assert "(array (elements, 3, 3), in m, in frame base)" in takt.messages.ContactPressure.corners.__doc__


# --- stubs


def parameters_of_stub(node):
    """[(name, has a default, only by keyword)]"""
    positional = node.args.posonlyargs + node.args.args
    defaults = [None] * (len(positional) - len(node.args.defaults)) + node.args.defaults
    found = [(a.arg, d is not None, False) for a, d in zip(positional, defaults)]
    return found + [(a.arg, d is not None, True) for a, d in zip(node.args.kwonlyargs, node.args.kw_defaults)]


def parameters_of_module(value):
    """The same, of the signature that pybind11 writes: "f(self: T, a: int = 1, *, b: Dict[str, int]) -> None"."""
    signature = value.__doc__.partition("\n")[0]
    inside = signature[signature.index("(") + 1:signature.rindex(") -> ")]
    pieces, depth = [""], 0
    for letter in inside:
        depth += (letter in "[(") - (letter in ")]")
        if letter == "," and depth == 0:
            pieces.append("")
        else:
            pieces[-1] += letter
    found, by_keyword = [], False
    for piece in (p.strip() for p in pieces if p.strip()):
        by_keyword |= piece == "*"
        if piece != "*":
            found.append((piece.partition(":")[0], " = " in piece, by_keyword))
    return found


def test_stubs_and_module_have_the_same_names_and_parameters():
    compared = 0
    for stub, module in (("_takt.pyi", takt._takt), ("messages.pyi", takt.messages)):
        body = [n for n in ast.parse((FOLDER / stub).read_text()).body
                if isinstance(n, (ast.ClassDef, ast.FunctionDef)) and not n.name.startswith("_")]
        there = {name for name, value in vars(module).items() if not name.startswith("_") and not inspect.ismodule(value)}
        assert {n.name for n in body} == there
        for node in body:
            value = getattr(module, node.name)
            if isinstance(node, ast.FunctionDef):
                assert parameters_of_stub(node) == parameters_of_module(value), node.name
                continue
            members = {n.name: n for n in node.body if isinstance(n, ast.FunctionDef)}
            own = {m for m in vars(value) if not m.startswith("_")}
            assert set(members) - {"__init__"} == own, node.name
            for name, member in members.items():
                here = getattr(value, name)
                assert isinstance(here, property) == bool(member.decorator_list), f"{node.name}.{name}"
                if not isinstance(here, property):
                    assert parameters_of_stub(member) == parameters_of_module(here), f"{node.name}.{name}"
                compared += 1
    assert compared > 150


def test_each_name_that_a_stub_uses_is_there():
    for stub in ("_takt.pyi", "messages.pyi"):
        tree = ast.parse((FOLDER / stub).read_text())
        for node in (n for n in tree.body if isinstance(n, ast.ImportFrom) and n.level == 1):
            module = importlib.import_module("takt" + (f".{node.module}" if node.module else ""))
            for name in (n.name for n in node.names):
                assert hasattr(module, name) or importlib.import_module(f"takt.{name}"), f"{stub}: {name}"
