"""The catalogue of events (idl/takt_events.idl): its table in C++, and its page in docs/."""
import re

from cpp import quoted, type_of
from idl import IdlError
from requests import cell, snake

KEYS = ("severity", "subject", "says", "remedy", "code", "of")


class Event:
    def __init__(self, reader, file, struct):
        notes = next(a.arguments for a in struct.annotations if a.name == "event")
        where = f"{file.path}:{struct.line}: event {struct.name}"
        for key in notes:
            if key not in KEYS:
                raise IdlError(f"{where} has {key}; allowed are {', '.join(KEYS)}")
        severities = [one.name for one in reader.enumerations["Severity"].enumerators]
        self.struct, self.severity = struct, notes.get("severity", "")
        if self.severity not in severities:
            raise IdlError(f"{where} has severity {self.severity!r}; allowed are {', '.join(severities)}")
        self.code, self.of_loop = notes.get("code") or snake(struct.name), notes.get("of") == "loop"
        self.says, self.subject, self.remedy = (notes.get(key, "") for key in ("says", "subject", "remedy"))
        if not self.says:
            raise IdlError(f"{where} says nothing; add says=\"a sentence\"")
        names = [field.name for field in struct.fields] + ["scenario"]
        for name in re.findall(r"\{[?!]?(\w+)", self.says + self.subject):
            if name not in names:
                raise IdlError(f"{where} speaks of {{{name}}}; it has {', '.join(names) or 'no fields'}")
        for field in struct.fields:
            if self.of_loop and field.kind == "string" and not field.has("fixed"):
                raise IdlError(f"{where}: {field.name} allocates in the step loop; make it a @fixed string<N>")


def of(reader):
    return [Event(reader, file, struct)
            for file in reader.files.values() for struct in file.structs if struct.has("event")]


def table_header(reader):
    """takt_event_table.h"""
    every = of(reader)
    text = "#pragma once\n// Generated from @event in idl/*.idl.\n#include <variant>\n\n"
    text += '#include "idl/vocabulary/event.h"\n#include "takt_events.h"\n\nnamespace takt {\n\n'
    for one in every:
        event = type_of(one.struct.full_name)
        text += (f"template <>\nstruct EventTable<{event}> {{\n  static constexpr EventInfo info{{{quoted(one.code)}, "
                 f"Severity::{one.severity}, {quoted(one.subject)}, {quoted(one.says)}, {quoted(one.remedy)}, "
                 f"&MessageTable<{event}>::info}};\n}};\n\n")
    text += "namespace events {\n\n/// What the step loop writes, of fixed size.\nusing OfLoop = std::variant<"
    text += ", ".join(one.struct.name for one in every if one.of_loop) + ">;\n"
    text += "inline constexpr const EventInfo* kAll[] = {\n"
    text += "".join(f"    &EventTable<{one.struct.name}>::info,\n" for one in every)
    return text + "};\n\n}  // namespace events\n}  // namespace takt\n"


def shown(text):
    """The sentence without its conditions, for people."""
    text = re.sub(r"\{[?!]\w+:((?:[^{}]|\{\w+\})*)\}", r"[\1]", text)
    return cell(re.sub(r"\{(\w+)\}", r"*\1*", text))


def page(reader):
    """docs/events.md"""
    every = sorted(of(reader), key=lambda one: (one.code, one.struct.name))
    text = ("# Events\n\n<!-- Written by idl/generator from idl/takt_events.idl; `./dev docs` renews it. -->\n\n"
            "Every event is a sample of `takt_msgs/msg/Event` on `/CELL/events`, a line of "
            "`takt events`, `wait_for(takt::topics::event)` in C++, `wait_for_event()` in Python. A program reads the code, a person the sentence. "
            f"There are {len({one.code for one in every})} codes. Values stand in italics; text in brackets is said "
            "where it applies.\n\n| code | severity | sentence | remedy |\n|---|---|---|---|\n")
    for one in every:
        remedy = re.sub("^Remedy: ", "", one.remedy)
        text += f"| `{one.code}` | {one.severity} | {shown(one.says)} | {cell(remedy)} |\n"
    return text
