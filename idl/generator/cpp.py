"""C++ headers of what idl.py has read: plain types, enumerations, field tables, topics. No DDS in them."""
import json

from idl import PRIMITIVES
from ros import type_hash

CPP_TYPES = {kind: cpp for kind, cpp, _ in PRIMITIVES.values()}
OF_COLUMNS = ("unit", "frame", "enumeration", "final", "value", "bit_bound")


def quoted(text):
    return json.dumps(text, ensure_ascii=False)


def camel(text):
    return "".join(word.capitalize() for word in text.split("_"))


def doc_lines(doc, indent=""):
    return f"{indent}/// {doc}\n" if doc else ""


def namespace_of(scope):
    return "::".join(scope)


def type_of(full_name):
    return "::".join(full_name.split("/"))


def cpp_type(field):
    if field.annotation("enumeration"):
        single = "takt::" + field.annotation("enumeration")
    else:
        single = type_of(field.type) if field.kind == "message" else CPP_TYPES[field.kind]
    if field.has("fixed"):
        single = f"takt::FixedString<{field.string_bound}>"
    if field.has("optional"):
        return f"std::optional<{single}>"
    if field.array:
        return f"std::array<{single}, {field.array}>"
    return f"std::vector<{single}>" if field.sequence else single


def initial(field):
    default = field.annotation("default")
    if field.kind == "string" and default:
        return f" = {quoted(default)}"
    if field.array or field.sequence or field.has("optional") or field.kind in ("string", "message"):
        return "{}"
    if field.annotation("enumeration"):
        return f" = takt::{field.annotation('enumeration')}::{default}" if default else "{}"
    return f" = {default or {'boolean': 'false', 'float32': '0.0F', 'float64': '0.0'}.get(field.kind, '0')}"


def annotations(holder, more=()):
    rows = [f"{{{quoted(a.name)}, {quoted(key)}, {quoted(text)}}}"
            for a in holder.annotations if a.name not in OF_COLUMNS
            for key, text in (a.arguments or {"": ""}).items()]
    return ", ".join([*rows, *more])


def enumeration(one):
    underlying = {"": "std::uint8_t", "8": "std::uint8_t", "32": "std::int32_t"}[one.annotation("bit_bound")]
    text = f"{doc_lines(one.doc)}enum class {one.name} : {underlying} {{\n"
    for of in one.enumerators:
        text += f"  {of.name} = {of.value}," + (f"  ///< {of.doc}" if of.doc else "") + "\n"
    text += f"}};\ninline constexpr EnumeratorInfo k{one.name}Enumerators[] = {{\n"
    for of in one.enumerators:
        text += f"    {{{quoted(of.name)}, {of.value}, {quoted(of.doc)}}},\n"
    return text + (f"}};\ntemplate <>\ninline constexpr EnumerationInfo kEnumeration<{one.name}>{{{quoted(one.name)}, "
                   f"{quoted(one.doc)}, k{one.name}Enumerators}};\n\n")


def struct(one, reader):
    base, inherited = (f" : {type_of(one.base)}", reader.structs[one.base].fields) if one.base else ("", [])
    text = f"{doc_lines(one.doc)}struct {one.name}{base} {{\n"
    for field in one.fields[len(inherited):]:
        meaning = ", ".join(part for part in (field.annotation("unit"),
                                              field.annotation("frame") and "in " + field.annotation("frame"),
                                              field.doc) if part)
        text += f"  {cpp_type(field)} {field.name}{initial(field)};" + (f"  ///< {meaning}" if meaning else "") + "\n"
    return text + f"\n  bool operator==(const {one.name}&) const = default;\n}};\n"


def table_rows(one):
    """(field, its place in an array, its value): on the wire an array is its elements, one after the other."""
    return [(field, place, f"{field.name}[{place}]" if field.array else field.name)
            for field in one.fields for place in range(field.array or 1)]


def table(one, reader):
    name = type_of(one.full_name)
    on_topics = one.has("topic") or one.scope[1:] in (("srv",), ("action",)) or one.name == "GoalStatusArray"
    hashed = [f'{{"type_hash", "value", "{type_hash(one, reader)}"}}'] if on_topics else []
    text = f"template <>\nstruct MessageTable<{name}> {{\n"
    for field in one.fields:
        if annotations(field):
            text += f"  static constexpr AnnotationInfo {field.name}_annotations[] = {{{annotations(field)}}};\n"
    if annotations(one, hashed):
        text += f"  static constexpr AnnotationInfo annotations[] = {{{annotations(one, hashed)}}};\n"
    text += "  static constexpr FieldInfo fields[] = {\n" if one.fields else "  static constexpr std::span<const FieldInfo> fields{"
    rows = table_rows(one)
    for field in (field for field, _, _ in rows):
        message = f"&MessageTable<{type_of(field.type)}>::info" if field.kind == "message" else "nullptr"
        values = f"&kEnumeration<{field.annotation('enumeration')}>" if field.annotation("enumeration") else "nullptr"
        text += (f"      {{{quoted(field.name)}, {quoted(field.annotation('unit'))}, {quoted(field.annotation('frame'))}, "
                 f"{quoted(field.doc)}, FieldKind::{field.kind}, {str(field.sequence).lower()}, {field.bound}, "
                 f"{field.string_bound}, {message}, {values}, "
                 f"{f'{field.name}_annotations' if annotations(field) else '{}'}}},\n")
    text += (f"{'  ' if one.fields else ''}}};\n  static constexpr MessageInfo info{{{quoted(one.full_name)}, {quoted(one.dds_type)}, "
             f"{quoted(one.doc)}, fields, {'annotations' if annotations(one, hashed) else '{}'}}};\n")
    text += "  template <typename Message, typename Visitor>\n"
    unused = "" if one.fields else "[[maybe_unused]] "
    text += f"  static constexpr void visit({unused}Message& message, {unused}Visitor&& visitor) {{\n"
    for place, (_, _, value) in enumerate(rows):
        text += f"    visitor(fields[{place}], message.{value});\n"
    return text + "  }\n};\n"


def types_header(file, reader):
    """NAME.h of NAME.idl."""
    own = "".join(f'#include "{name.removesuffix(".idl")}.h"\n' for name in file.includes)
    text = f"#pragma once\n// Generated from idl/{file.path.name}.\n"
    optional = "#include <optional>\n" if any(f.has("optional") for s in file.structs for f in s.fields) else ""
    arrays = "#include <array>\n" if any(f.array for s in file.structs for f in s.fields) else ""
    text += f"{arrays}#include <cstdint>\n{optional}#include <string>\n#include <vector>\n\n" if file.structs else "#include <cstdint>\n\n"
    text += '#include "idl/common/enumeration.h"\n' + ('#include "idl/common/message.h"\n' if file.structs else "")
    if any(f.has("fixed") for s in file.structs for f in s.fields):
        text += '#include "idl/common/fixed_string.h"\n'
    text += own + "\n"
    scope = None
    for one in file.enumerations + file.structs:
        if one.scope != scope:
            text += f"}}  // namespace {namespace_of(scope)}\n\n" if scope else ""
            text += f"namespace {namespace_of(one.scope)} {{\n\n"
            scope = one.scope
        text += enumeration(one) if one in file.enumerations else struct(one, reader) + "\n"
    text += f"}}  // namespace {namespace_of(scope)}\n"
    if file.structs:
        text += "\nnamespace takt {\n\n" + "\n".join(table(one, reader) for one in file.structs) + "\n}  // namespace takt\n"
        types = ",\n    ".join(type_of(one.full_name) for one in file.structs)
        text += f"\nnamespace takt {{\n/// All messages of this file.\nusing {camel(file.path.stem)} = MessageList<\n    {types}>;\n}}\n"
    return text


def topics_header(reader):
    """takt_topics.h: a row for each @topic."""
    files = [file for file in reader.files.values() if any(s.has("topic") for s in file.structs)]
    rows, names = "", []
    for file in files:
        for one in file.structs:
            for note in one.annotations:
                if note.name != "topic":
                    continue
                get = note.arguments.get
                names.append(get("id"))
                rows += (f"inline constexpr Topic<{type_of(one.full_name)}> {get('id')}{{{{{quoted(get('id'))}, "
                         f"{quoted(get('name'))}, &MessageTable<{type_of(one.full_name)}>::info, "
                         f"TopicWriter::{get('by')}, TopicQos::{get('qos')}, {get('depth', '0')}}}}};\n")
    text = "#pragma once\n// Generated from @topic in idl/*.idl.\n"
    text += '#include "idl/common/topic.h"\n' + "".join(f'#include "{f.path.stem}.h"\n' for f in files)
    text += f"\nnamespace takt::topics {{\n\n{rows}\n"
    text += f"inline constexpr const TopicInfo* kAll[] = {{{', '.join('&' + name for name in names)}}};\n\n"
    text += "/// `visitor(const Topic<Message>&)` for each.\ntemplate <typename Visitor>\nconstexpr void for_each(Visitor&& visitor) {\n"
    return text + "".join(f"  visitor({name});\n" for name in names) + "}\n\n}  // namespace takt::topics\n"


def actions_header(reader):
    """takt_actions.h: a row for each @action."""
    files = [file for file in reader.files.values() if any(s.has("action") for s in file.structs)]
    text = "#pragma once\n// Generated from @action in idl/*.idl.\n"
    text += '#include "idl/common/action.h"\n' + "".join(f'#include "{f.path.stem}.h"\n' for f in files) + "\nnamespace takt {\n"
    names = []
    for file in files:
        for goal in [s for s in file.structs if s.has("action")]:
            name = type_of(goal.full_name).removesuffix("Goal")
            identifier = goal.annotation("action", "id")
            names.append(f"actions::{camel(identifier)}")
            text += f"\nnamespace actions {{\nstruct {camel(identifier)} {{\n"
            for part in ("Goal", "Result", "Feedback", "SendGoal_Request", "SendGoal_Response", "GetResult_Request",
                         "GetResult_Response", "FeedbackMessage"):
                text += f"  using {part.replace('_', '')} = {name}{part};\n"
            text += (f"  static constexpr ActionInfo info{{{quoted(identifier)}, "
                     f"{quoted(goal.annotation('action', 'name'))}}};\n}};\n}}  // namespace actions\n")
    return text + "\n}  // namespace takt\n"
