"""Messages as ROS 2 knows them: definitions (.msg, .srv), the package folder around them, and type hashes."""
import hashlib
import json

from idl import PRIMITIVES

ROS_TYPES = {kind: ros for kind, _, ros in PRIMITIVES.values()}
# FieldType.msg of type_description_interfaces.
TYPE_IDS = {"message": 1, "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9,
            "float32": 10, "float64": 11, "boolean": 15, "string": 17}
BOUNDED_STRING, ARRAY, BOUNDED_SEQUENCE, UNBOUNDED_SEQUENCE = 21, 48, 96, 144
PACKAGE = "takt_msgs"


def described(struct):
    fields = []
    for field in struct.fields:
        type_id = BOUNDED_STRING if field.string_bound else TYPE_IDS[field.kind]
        if field.sequence:
            type_id += BOUNDED_SEQUENCE if field.bound else UNBOUNDED_SEQUENCE
        if field.array:
            type_id += ARRAY
        fields.append({"name": field.name, "type": {
            "type_id": type_id, "capacity": field.array or field.bound, "string_capacity": field.string_bound,
            "nested_type_name": field.type if field.kind == "message" else ""}})
    return {"type_name": struct.full_name, "fields": fields}


def referenced(struct, reader):
    """Full names of the types that the struct holds, at any depth."""
    names = set()
    for field in struct.fields:
        if field.kind == "message" and field.type not in names:
            names |= {field.type} | referenced(reader.structs[field.type], reader)
    return names


def type_hash(struct, reader):
    """RIHS01 of REP 2016: nodes from Iron on compare it, and `ros2 topic info --verbose` shows it."""
    text = json.dumps({"type_description": described(struct),
                       "referenced_type_descriptions": [described(reader.structs[name])
                                                        for name in sorted(referenced(struct, reader))]})
    return "RIHS01_" + hashlib.sha256(text.encode("utf-8")).hexdigest()


def ros_type(field):
    text = ROS_TYPES.get(field.kind)
    if field.kind == "message":
        package, _, name = field.type.split("/")
        text = name if package == PACKAGE else f"{package}/{name}"
    if field.string_bound:
        text += f"<={field.string_bound}"
    if field.sequence:
        text += f"[<={field.bound}]" if field.bound else "[]"
    return text


def comment(text):
    return f"# {text}\n" if text else ""


def definition(struct, reader):
    """The fields as lines of a .msg file, and the numbers of enumerations as constants."""
    text = comment(struct.doc)
    for field in struct.fields:
        one = reader.enumerations.get(field.annotation("enumeration"))
        for of in one.enumerators if one else []:
            text += f"{ros_type(field).split('[')[0]} {field.name.upper()}_{of.name.upper()}={of.value}"
            text += f"  # {of.doc}\n" if of.doc else "\n"
        frame = field.annotation("frame")
        meaning = [part for part in (field.annotation("unit"), frame and f"in {frame}", field.doc) if part]
        text += f"{ros_type(field)} {field.name}" + (f"  # {', '.join(meaning)}" if meaning else "") + "\n"
    return text


def own(reader, folder):
    return [s for s in reader.structs.values() if s.scope == (PACKAGE, folder)]


def package(reader):
    """Files of the package folder: path in it to text."""
    files = {f"msg/{s.name}.msg": definition(s, reader) for s in own(reader, "msg")}
    for request in own(reader, "srv"):
        if not request.name.endswith("_Request"):
            continue
        name = request.name.removesuffix("_Request")
        response = reader.structs[request.full_name.replace("_Request", "_Response")]
        files[f"srv/{name}.srv"] = definition(request, reader) + "---\n" + definition(response, reader)
    needed = sorted({name.split("/")[0] for folder in ("msg", "srv") for s in own(reader, folder)
                     for name in referenced(s, reader)} - {PACKAGE})
    interfaces = "".join(f'  "{path}"\n' for path in sorted(files))
    files["package.xml"] = f"""<?xml version="1.0"?>
<package format="3">
  <name>{PACKAGE}</name>
  <version>0.1.0</version>
  <description>Messages and services of takt, a simulation of robotic assembly.</description>
  <maintainer email="takt@localhost">takt</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
{"".join(f"  <depend>{name}</depend>" + chr(10) for name in needed)}\
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""
    files["CMakeLists.txt"] = f"""# Generated from takt's IDL.
cmake_minimum_required(VERSION 3.16)
project({PACKAGE})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{"".join(f"find_package({name} REQUIRED)" + chr(10) for name in needed)}\
rosidl_generate_interfaces(${{PROJECT_NAME}}
{interfaces}  DEPENDENCIES {" ".join(needed)})
ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""
    return files
