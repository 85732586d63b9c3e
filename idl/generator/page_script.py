"""enumerations.js: the enumerations for the page of takt view."""
import python_api


def script(reader):
    text = "// The enumerations of takt. Generated from idl/takt_enumerations.idl.\n"
    for one in python_api.used_enumerations(reader):
        values = ", ".join(f"{of.name}: {of.value}" for of in one.enumerators)
        text += f"export const {one.name} = Object.freeze({{{values}}});\n"
    return text + ("\n// The name of a number; the number itself where it has none.\nexport const nameOf = (enumeration, value) => "
                   "Object.keys(enumeration).find((name) => enumeration[name] === value) ?? String(value);\n")
