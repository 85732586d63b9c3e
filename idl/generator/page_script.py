"""messages.js: the enumerations and the fields of messages for the page of takt view."""
import json

import python_api
import requests
from ros import referenced


def script(reader):
    text = "// The enumerations and the messages of takt. Generated from idl/*.idl.\n"
    used = python_api.used_enumerations(reader, ("server", *requests.BESIDE))
    for one in [*used, *(reader.enumerations[name] for name in ("ControlResult", "GripperSignal"))]:
        values = ", ".join(f"{of.name}: {of.value}" for of in one.enumerators)
        text += f"export const {one.name} = Object.freeze({{{values}}});\n"
    text += ("\n// The name of a number; the number itself where it has none.\nexport const nameOf = (enumeration, value) => "
             "Object.keys(enumeration).find((name) => enumeration[name] === value) ?? String(value);\n"
             "\n// Fields of messages by type: `type` of a field that is a message; `list`; `order`, `key` and `index` as in the IDL;\n"
             "// `signal`: its numbers can be plotted; `unit`: theirs, which a message without units has from the field that holds it.\nexport const messages = Object.freeze({\n")
    sent = [struct for struct in reader.structs.values() if struct.has("topic")]
    names = {struct.full_name for struct in sent}.union(*(referenced(struct, reader) for struct in sent))
    for name in sorted(names):
        fields = {field.name: described(field) for field in reader.structs[name].fields}
        text += f"  {json.dumps(name)}: {json.dumps(fields)},\n"
    return text + "});\n"


def described(field):
    made = {"list": True} if field.sequence else {}
    if field.kind == "message":
        made["type"] = field.type
    made |= {key: field.annotation(key) for key in ("order", "key", "index", "unit") if field.has(key)}
    stamp = field.type in ("builtin_interfaces/msg/Time", "std_msgs/msg/Header")
    if field.kind != "string" and not (stamp or field.has("identity") or field.has("hexadecimal")):
        made["signal"] = True
    return made
