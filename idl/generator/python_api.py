"""Files of the Python package: enumerations.py; requests.py, the requests as methods and their responses as
dataclasses; topics.py, the waits for the samples of topics as methods; messages.pyi, the types of the messages
(client_lib/python/messages.h makes their classes)."""
import requests

PYTHON_TYPES = {"boolean": "bool", "string": "str", "float32": "float", "float64": "float"}
SAMPLES = {"CellDescription": "CellInfo", "CellState": "State", "Event": "Event"}  # classes that add to their message
ARRAY = "np.ndarray"

HEAD = '''"""Requests of the control vocabulary as methods of takt.Client. Generated from idl/takt_requests.idl."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from .enumerations import {enumerations}


def _enumerator(kind, name):
    return getattr(kind, name) if isinstance(name, str) else kind(name)


def _made(cls, values):
    """A response from the values of a reply; what a newer server adds is passed over."""
    made = {{}}
    for field in dataclasses.fields(cls):
        value = values.get(field.name)
        of = field.metadata.get("of")
        if value is not None and of is np.ndarray:
            made[field.name] = np.array(value, dtype=float)
            continue
        if value is not None and of is not None:
            make = (lambda one: _made(of, one)) if dataclasses.is_dataclass(of) else (lambda one: _enumerator(of, one))
            value = [make(one) for one in value] if isinstance(value, list) else make(value)
        elif value is not None and field.metadata.get("whole"):
            whole = lambda one: int(one, 16) if isinstance(one, str) else int(one)
            value = [whole(one) for one in value] if isinstance(value, list) else whole(value)
        made[field.name] = value
    return cls(**made)
'''


def single(field, reader):
    if field.annotation("enumeration"):
        return field.annotation("enumeration")
    if field.kind == "message":
        struct = reader.structs[field.type]
        return "Sequence[float] | " + ARRAY if struct.has("quantity") else struct.name
    return PYTHON_TYPES.get(field.kind, "int")


def is_array(field, reader):
    """A vector, a rotation, numbers."""
    if field.kind == "message":
        return reader.structs[field.type].has("quantity")
    return field.sequence and field.kind in ("float32", "float64", "uint32")


def annotation(field, reader, is_argument):
    kind = single(field, reader)
    if is_argument and field.annotation("enumeration"):
        kind += " | str"
    if not is_argument and is_array(field, reader):
        kind = ARRAY
    elif field.sequence:
        kind = f"{'Sequence' if is_argument else 'list'}[{kind}]" + (f" | {ARRAY}" if is_argument and kind == "float" else "")
    return kind + (" | None" if field.has("optional") else "")


def shape(field, reader):
    """Lengths of an array as Python writes them."""
    struct = reader.structs.get(field.type)
    text = field.annotation("shape") or (struct.annotation("shape") or str(len(struct.fields)) if struct else "")
    names = "" if text == "" or not struct or struct.annotation("shape") else " " + " ".join(f.name for f in struct.fields)
    text = text or field.annotation("order") or "n"
    return (f"({text})" if "," in text else f"({text},)") + names


def meaning(field, reader):
    """Text of a field or an argument. Its comment in the IDL may read on from the name: `state` // to be in."""
    unit, about = field.annotation("unit"), []
    if is_array(field, reader):
        about.append("array " + shape(field, reader))
    if unit == "1":
        about += ["without unit"] if field.kind in ("float32", "float64") else []
    elif unit:
        about.append(f"in the unit {unit}" if unit.startswith("of ") else f"in {unit}")
    if field.has("frame"):
        about.append(f"in frame {field.annotation('frame')}")
    text = field.doc or reader.enumerations[field.annotation("enumeration")].doc or field.annotation("enumeration")
    if field.has("index"):
        text = text.replace("-1", "None")
    if text.startswith(("of ", "to ", "in ", "from ")):
        text = f"{field.name.replace('_', ' ')} {text}"
    return text + (f" ({', '.join(about)})" if about else "")


def default(field, reader):
    """Of an argument; None leaves it out, so that the server takes its own."""
    text = field.annotation("default")
    if field.has("optional") or not text:
        return "None"
    if field.annotation("enumeration"):
        return f"{field.annotation('enumeration')}.{text}"
    if field.kind == "string":
        return repr(text)
    return text.capitalize() if field.kind == "boolean" else text


def dataclass(struct, reader, replies_to=""):
    doc = struct.doc or f"Reply to {replies_to}."
    text = f"\n\n@dataclasses.dataclass(frozen=True)\nclass {struct.name}:\n    \"\"\"{doc}\n\n"
    for field in struct.fields:
        text += f"    {field.name}: {meaning(field, reader)}\n"
    text += "    message: the server's sentence\n" if replies_to else ""
    text += '    """\n\n'
    for field in struct.fields:
        of = field.annotation("enumeration")
        if field.kind == "message" and not reader.structs[field.type].has("quantity"):
            of = reader.structs[field.type].name
        if annotation(field, reader, False).startswith(ARRAY):
            of = ARRAY
        metadata = f" = dataclasses.field(metadata={{\"of\": {of}}})" if of else ""
        if not of and PYTHON_TYPES.get(field.kind, "int") == "int" and field.kind != "message":
            metadata = " = dataclasses.field(metadata={\"whole\": True})"
        text += f"    {field.name}: {annotation(field, reader, False)}{metadata}\n"
    return text + ("    message: str\n" if replies_to else "")


def method(one, reader):
    required = [f for f in one.struct.fields if not f.has("optional") and not f.has("default")]
    others = [f for f in one.struct.fields if f not in required]
    signature = "".join(f", {f.name}: {annotation(f, reader, True)}" for f in required)
    for field in others:
        kind = annotation(field, reader, True)
        value = default(field, reader)
        if value == "None" and not kind.endswith("| None"):
            kind += " | None"
        signature += f", {field.name}: {kind} = {value}"
    text = f"\n    def {one.name}(self{signature}, *, timeout: float | None = None) -> {one.response.name}:\n"
    text += f'        """{one.struct.doc}\n\n'
    for field in one.struct.fields:
        text += f"        {field.name}: {meaning(field, reader)}\n"
    text += "        timeout: longest wait for the reply, in s; None: that of the client\n        \"\"\"\n"
    arguments = ", ".join(f"\"{f.name}\": {f.name}" for f in one.struct.fields)
    return text + f"        return self._call(\"{one.name}\", {{{arguments}}}, {one.response.name}, timeout)\n"


def module(reader):
    every = requests.of(reader)
    enumerations = sorted({f.annotation("enumeration") for one in every for s in (one.struct, one.response) for f in s.fields
                           if f.has("enumeration")})
    text = HEAD.format(enumerations=", ".join(enumerations))
    nested = dict.fromkeys(s.full_name for one in every for s in requests.nested(one.response, reader))
    for name in nested:
        text += dataclass(reader.structs[name], reader)
    for one in every:
        text += dataclass(one.response, reader, one.name)
    text += '''

class Requests:
    """The requests of takt.Client (docs/requests.md). Each waits for the reply and raises Refused with the server's sentence."""

    def _call(self, name, arguments, response, timeout):
        given = {key: value for key, value in arguments.items() if value is not None}
        reply = self.request(name, given, timeout)
        return _made(response, {**reply.values, "message": reply.message})
'''
    for one in every:
        text += method(one, reader)
    return text


def topics_of(reader):
    """(struct, arguments of @topic) of each topic that a client reads; those of ROS 2 have readers of their own."""
    return [(struct, note.arguments) for struct in reader.structs.values() if struct.scope == ("takt_msgs", "msg")
            for note in struct.annotations
            if note.name == "topic" and note.arguments["by"] == "server" and note.arguments["qos"] != "control"]


def closure(reader):
    """The messages of topics and the messages in them, parts first."""
    found = {}

    def add(name):
        struct = reader.structs[name]
        for field in struct.fields:
            part = reader.structs.get(field.type)
            if part and not part.has("quantity") and part.name != "Time":
                add(field.type)
        found[name] = struct

    for struct, _ in topics_of(reader):
        add(struct.full_name)
    return list(found.values())


def used_enumerations(reader, receivers=("server",)):
    """Of the messages that a client sees, of requests to these receivers, and of commands."""
    structs = closure(reader) + [s for receiver in receivers for one in requests.of(reader, receiver)
                                 for s in (one.struct, one.response)]
    structs += [s for one in requests.of(reader) for s in requests.nested(one.response, reader)]
    structs.append(reader.structs["takt_msgs/msg/GripperCommand"])
    names = {f.annotation("enumeration") for s in structs for f in s.fields if f.has("enumeration")}
    return [reader.enumerations[name] for name in sorted(names)]


def enumerations(reader):
    """enumerations.py"""
    text = '"""The enumerations of takt: their members have `name`, `value` and a docstring. Generated from idl/takt_enumerations.idl."""\n\n'
    text += "from __future__ import annotations\n\nimport enum\n"
    for one in used_enumerations(reader):
        text += f"\n\nclass {one.name}(enum.Enum):\n    \"\"\"{one.doc}\"\"\"\n\n"
        text += "".join(f"    {of.name} = {of.value}\n    \"\"\"{of.doc}\"\"\"\n" for of in one.enumerators) + "\n\n"
        text += "".join(f"{one.name}.{of.name}.__doc__ = {of.doc!r}\n" for of in one.enumerators)
    return text


def message_type(field, reader):
    if field.has("index"):
        return "str | None"
    struct = reader.structs.get(field.type)
    if struct and struct.name == "Time":
        return "float"
    if is_array(field, reader):
        kind = {"float32": "float32", "uint32": "uint32"}.get(field.kind, "float64")
        return f"NDArray[np.{kind}]"
    kind = struct.name if struct else single(field, reader)
    if not field.sequence:
        return kind
    return f"NamedList[{kind}]" if field.has("key") or field.has("order") else f"list[{kind}]"


def messages(reader):
    """messages.pyi"""
    every, samples = closure(reader), [struct for struct, _ in topics_of(reader)]
    kinds = sorted({f.annotation("enumeration") for s in every for f in s.fields if f.has("enumeration")})
    text = ("# Types of the messages that a client receives. Generated from idl/takt_msgs.idl.\nimport numpy as np\n"
            f"from numpy.typing import NDArray\n\nfrom .enumerations import {', '.join(kinds)}\n"
            "from .named_list import NamedList\n")
    for struct in every:
        text += f"\nclass {struct.name}:\n    \"\"\"{struct.doc or struct.name}\"\"\"\n"
        for field in struct.fields:
            text += (f"    @property\n    def {field.name}(self) -> {message_type(field, reader)}:\n"
                     f"        \"\"\"{meaning(field, reader)}\"\"\"\n")
        if struct in samples:
            text += ("    @property\n    def sample_number(self) -> int:\n"
                     "        \"\"\"Number of the sample among those received\"\"\"\n")
    return text


def wait(struct, topic, reader):
    element = topic["name"].partition("/{")[2].partition("}")[0]
    sample = SAMPLES.get(struct.name, "messages." + struct.name)
    every = topic["qos"] == "event"
    text = f"\n    def wait_for_{topic['id']}(self, {f'{element}: str, ' if element else ''}predicate: Callable[[{sample}], bool] | None = None,\n"
    text += f"        timeout: float | None = None) -> {sample} | None:\n"
    text += f"        \"\"\"{struct.doc}\n\n"
    text += f"        {'Next sample' if every else 'First sample, from the newest on,'} that fulfils the predicate; None after the timeout.\n"
    if every:
        text += ("        Samples are kept in order from the moment of connecting (the newest 10000); each is returned once, and\n"
                 "        those before it are passed over.\n")
    text += f"        Its class is takt.{sample}.\n\n"
    text += f"        {element}: name of the {element}\n" if element else ""
    text += ("        predicate: function of a sample; None: any sample\n"
             "        timeout: longest wait, in s of wall time; None: that of the client\n\n        Fields of the sample:\n\n")
    text += "".join(f"        {field.name}: {meaning(field, reader)}\n" for field in struct.fields) + "        \"\"\"\n"
    element = element or '""'
    return text + f"        return self._wait_for(\"{topic['id']}\", {element}, predicate, timeout)\n"


def topics(reader):
    """topics.py"""
    text = '''"""Topics of a cell as methods of takt.Client. Generated from idl/takt_msgs.idl."""

from __future__ import annotations

from collections.abc import Callable

from . import messages
from ._takt import {samples}


class Topics:
    """The waits of takt.Client for samples of topics.

    The predicate runs in this thread; a slow one sees the newest sample, not every one. State, status, events and
    description are received from the moment of connecting, every other topic from the first wait for it.
    """
'''.replace("{samples}", ", ".join(sorted(SAMPLES.values())))
    return text + "".join(wait(struct, topic, reader) for struct, topic in topics_of(reader))
