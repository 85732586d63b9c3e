"""requests.py of the Python package: the requests of takt_requests.idl as methods, their responses as dataclasses."""
import requests

PYTHON_TYPES = {"boolean": "bool", "string": "str", "float32": "float", "float64": "float"}

HEAD = '''"""Requests of the control vocabulary as methods of takt.Client. Generated from idl/takt_requests.idl."""

from __future__ import annotations

import dataclasses
from typing import Sequence

from ._takt import {enumerations}


def _enumerator(kind, name):
    return getattr(kind, name) if isinstance(name, str) else kind(name)


def _made(cls, values):
    """A response from the values of a reply; what a newer server adds is passed over."""
    made = {{}}
    for field in dataclasses.fields(cls):
        value = values.get(field.name)
        of = field.metadata.get("of")
        if value is not None and of is not None:
            make = (lambda one: _made(of, one)) if dataclasses.is_dataclass(of) else (lambda one: _enumerator(of, one))
            value = [make(one) for one in value] if isinstance(value, list) else make(value)
        elif value is not None and field.metadata.get("whole"):
            value = [int(one) for one in value] if isinstance(value, list) else int(value)
        made[field.name] = value
    return cls(**made)
'''


def single(field, reader):
    if field.annotation("enumeration"):
        return field.annotation("enumeration")
    if field.kind == "message":
        struct = reader.structs[field.type]
        return "Sequence[float]" if struct.has("quantity") else struct.name
    return PYTHON_TYPES.get(field.kind, "int")


def annotation(field, reader, is_argument):
    kind = single(field, reader)
    if is_argument and field.annotation("enumeration"):
        kind += " | str"
    if field.sequence:
        kind = f"{'Sequence' if is_argument else 'list'}[{kind}]"
    elif not is_argument:
        kind = kind.replace("Sequence[float]", "list[float]")
    return kind + (" | None" if field.has("optional") else "")


def meaning(field):
    unit = field.annotation("unit")
    parts = [f"in {unit}" if unit and unit != "1" else "", f"frame {field.annotation('frame')}" if field.has("frame") else ""]
    aside = ", ".join(part for part in parts if part)
    return f"{field.doc}{f' ({aside})' if aside else ''}".strip() or field.annotation("enumeration")


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
        text += f"    {field.name}: {meaning(field)}\n"
    text += "    message: the server's sentence\n" if replies_to else ""
    text += '    """\n\n'
    for field in struct.fields:
        of = field.annotation("enumeration")
        if field.kind == "message" and not reader.structs[field.type].has("quantity"):
            of = reader.structs[field.type].name
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
        text += f"        {field.name}: {meaning(field)}\n"
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
    """The requests of takt.Client. Each waits for the reply and raises Refused with the server's sentence."""

    def _call(self, name, arguments, response, timeout):
        given = {key: value for key, value in arguments.items() if value is not None}
        reply = self.request(name, given, timeout)
        return _made(response, {**reply.values, "message": reply.message})
'''
    for one in every:
        text += method(one, reader)
    return text
