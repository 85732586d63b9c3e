"""The control vocabulary (idl/takt_requests.idl): its table in C++, and its page in docs/."""
import re

from cpp import doc_lines, quoted, type_of
from idl import IdlError

PHASES = {
    "at_once": "at once, in any thread",
    "loop": "between two steps",
    "query": "between two steps, at most one per step",
    "host": "in the thread that exchanges the scenario",
}
CHANGES = {"": "nothing", "bits": "bits", "effect": "effect", "model": "model"}
RESERVED = ("self", "timeout")  # parameters of every call in Python
KEYS = ("phase", "results", "changes", "renews", "service", "of")


def words(text):
    return [word.strip() for word in text.split(",") if word.strip()]


def snake(name):
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


class Request:
    def __init__(self, reader, file, struct):
        notes = next(a.arguments for a in struct.annotations if a.name == "request")
        where = f"{file.path}:{struct.line}: request {struct.name}"
        for key in notes:
            if key not in KEYS:
                raise IdlError(f"{where} has {key}; allowed are {', '.join(KEYS)}")
        self.struct, self.name = struct, snake(struct.name)
        self.phase, self.changes = notes.get("phase", ""), notes.get("changes", "")
        self.renews, self.service = words(notes.get("renews", "")), notes.get("service", "")
        self.results, self.of = words(notes.get("results", "")), notes.get("of", "server")
        if self.phase not in PHASES or self.changes not in CHANGES:
            raise IdlError(f"{where} has phase {self.phase!r} and changes {self.changes!r}; allowed are the phases "
                           f"{', '.join(PHASES)} and the changes {', '.join(filter(None, CHANGES))}")
        codes = {one.name: one for one in reader.enumerations["ControlResult"].enumerators}
        for result in self.results:
            if result not in codes:
                raise IdlError(f"{where} has result {result!r}; ControlResult has {', '.join(codes)}")
        self.codes = [codes[name] for name in ["ok", "failed"] + self.results]
        if len({code.value for code in self.codes}) != len(self.codes):
            raise IdlError(f"{where} has two results of one number; give one of them another @value")
        for field in struct.fields:
            if field.name in RESERVED:
                raise IdlError(f"{where} has an argument {field.name}, which the calls of Python have already; rename it")
        self.response = reader.structs.get(struct.full_name + "Response")
        if self.response is None:
            raise IdlError(f"{where} has no struct {struct.name}Response; add one, without fields if need be")


def of(reader, receiver="server"):
    every = [Request(reader, file, struct)
             for file in reader.files.values() for struct in file.structs if struct.has("request")]
    return [one for one in every if one.of == receiver]


def table_rows(every):
    text = ""
    for one in every:
        request, response = type_of(one.struct.full_name), type_of(one.response.full_name)
        codes = ", ".join(f"ControlResult::{code.name}" for code in one.codes)
        text += (f"template <>\nstruct RequestTable<{request}> {{\n  using Response = {response};\n"
                 f"  static constexpr ControlResult results[] = {{{codes}}};\n"
                 f"  static constexpr RequestInfo info{{{quoted(one.name)}, RequestPhase::{one.phase}, "
                 f"RequestChanges::{CHANGES[one.changes]}, {str('state' in one.renews).lower()}, "
                 f"{str('status' in one.renews).lower()}, results, &MessageTable<{request}>::info, "
                 f"&MessageTable<{response}>::info}};\n}};\n\n")
    return text


# What is requested of another than a server, and which program answers.
BESIDE = {"player": "by `takt view FILE`, not by a server", "pendant": "by `takt view` of a running cell"}


def table_header_beside(reader, receiver):
    """takt_player_table.h, takt_pendant_table.h"""
    every = of(reader, receiver)
    text = "#pragma once\n// Generated from @request in idl/*.idl.\n"
    text += f'#include "idl/vocabulary/request.h"\n#include "takt_{receiver}.h"\n\n'
    text += f"// Of macros that want all requests of a {receiver}.\n#define TAKT_FOR_EACH_{receiver.upper()}_REQUEST(Macro)"
    text += "".join(f" \\\n  Macro({one.struct.name})" for one in every)
    return text + "\n\nnamespace takt {\n\n" + table_rows(every) + "}  // namespace takt\n"


def table_header(reader):
    """takt_request_table.h"""
    every = of(reader)
    text = "#pragma once\n// Generated from @request in idl/*.idl.\n#include <variant>\n\n"
    text += '#include "idl/vocabulary/request.h"\n#include "takt_requests.h"\n\n'
    text += "// Of macros that want all requests.\n#define TAKT_FOR_EACH_REQUEST(Macro)"
    text += "".join(f" \\\n  Macro({one.struct.name})" for one in every)
    text += "\n// Of macros that want all that are services of simulation_interfaces: service, its name, request.\n"
    text += "#define TAKT_FOR_EACH_ROS_SERVICE(Macro)"
    text += "".join(f" \\\n  Macro({one.service}, {quoted(snake(one.service))}, {one.struct.name})"
                    for one in every if one.service) + "\n\nnamespace takt {\n\n"
    text += table_rows(every) + "namespace requests {\n\nusing Any = std::variant<" + ", ".join(one.struct.name for one in every) + ">;\n"
    text += "/// In the order of the variant.\ninline constexpr const RequestInfo* kAll[] = {\n"
    text += "".join(f"    &RequestTable<{one.struct.name}>::info,\n" for one in every)
    return text + "};\n\n}  // namespace requests\n}  // namespace takt\n"


def kind_of(field, reader):
    if field.annotation("enumeration"):
        return "one of " + ", ".join(words(field.annotation("one_of")) or
                                     [e.name for e in reader.enumerations[field.annotation("enumeration")].enumerators])
    if field.kind == "message":
        struct = reader.structs[field.type]
        if struct.has("quantity"):
            return "numbers " + " ".join(f.name for f in struct.fields)
        return ("list of " if field.sequence else "") + f"{struct.name} (JSON)"
    if field.has("hexadecimal"):
        return "text, 0x and 16 hexadecimal digits"
    kind = {"boolean": "boolean", "string": "text", "float32": "number", "float64": "number"}.get(field.kind, "integer")
    kind = {"text": "texts", "number": "numbers", "integer": "integers"}[kind] if field.sequence else kind
    if field.has("names"):
        kind += f" (name of a {field.annotation('names')})"
    if field.has("one_of"):
        return f"{kind}, one of {field.annotation('one_of')}"
    low, high = field.annotation("min"), field.annotation("max")
    return kind + (f" from {low} to {high}" if low or high else "")


def wanted(field):
    if field.has("optional"):
        return "optional"
    return f"default {field.annotation('default') or 'none given'}" if field.has("default") else "required"


def cell(text):
    return text.replace("|", "\\|")


def rows(fields, reader, is_request):
    text = "| argument | kind | | unit | meaning |\n|---|---|---|---|---|\n" if is_request else \
        "| result | kind | unit | meaning |\n|---|---|---|---|\n"
    for field in fields:
        unit = field.annotation("unit") + (f", in {field.annotation('frame')}" if field.has("frame") else "")
        text += (f"| `{field.name}` | {cell(kind_of(field, reader))} | " + (f"{wanted(field)} | " if is_request else "")
                 + f"{cell(unit.lstrip(', '))} | {cell(field.doc)} |\n")
    return text


def nested(struct, reader):
    for field in struct.fields:
        if field.kind == "message" and not reader.structs[field.type].has("quantity"):
            yield reader.structs[field.type]


def page(reader):
    """docs/requests.md"""
    every = of(reader)
    text = ("# Requests\n\n<!-- Written by idl/generator from idl/takt_requests.idl; `./dev docs` renews it. -->\n\n"
            "Every request of the control vocabulary. The same request is `takt request NAME KEY=VALUE ...` on the command "
            "line, `client.call(takt::requests::Name{...})` in C++, `cell.name(...)` in Python, and a sample of "
            "`takt_msgs/msg/ControlRequest` or the ROS 2 service `/CELL/control` on the wire. Units are SI, quaternions "
            "x y z w.\n\n| request | what it does | executed | ROS 2 service |\n|---|---|---|---|\n")
    for one in every:
        service = f"`simulation_interfaces/srv/{one.service}`" if one.service else ""
        text += f"| [`{one.name}`](#{one.name}) | {one.struct.doc.split('. ')[0].rstrip('.')} | {PHASES[one.phase]} | {service} |\n"
    beside = [one for receiver in BESIDE for one in of(reader, receiver)]
    for one in beside:
        text += f"| [`{one.name}`](#{one.name}) | {one.struct.doc.split('. ')[0].rstrip('.')} | {BESIDE[one.of]} | |\n"
    for one in every + beside:
        text += f"\n## {one.name}\n\n{one.struct.doc}\n\n"
        if one.struct.fields:
            text += rows(one.struct.fields, reader, True) + "\n"
        if one.response.fields:
            text += rows(one.response.fields, reader, False) + "\n"
            for struct in dict.fromkeys(s.full_name for s in nested(one.response, reader)):
                made = reader.structs[struct]
                text += f"{made.name}" + (f": {made.doc}" if made.doc else "") + "\n\n" + rows(made.fields, reader, False) + "\n"
        text += "Codes: " + ", ".join(f"{code.value} {code.name}" for code in one.codes) + "."
        text += {"bits": " In the command log; replayed.", "effect": " Its changes are in the command log.",
                 "model": " In the command log, as part of the loaded scenario.", "nothing": ""}[CHANGES[one.changes]] + "\n"
    return text
