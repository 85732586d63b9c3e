"""The package folder takt_msgs for ROS 2 says what the IDL says, and its type hashes are those on the wire.
Usage: ros_package_test.py GENERATED_DIRECTORY IDL_DIRECTORY"""
import hashlib
import json
import re
import sys
import unittest
from pathlib import Path

GENERATED, IDL = Path(sys.argv.pop(1)), Path(sys.argv.pop(1))
PACKAGE = GENERATED / "ros" / "takt_msgs"
sys.path.insert(0, str(IDL / "generator"))
import idl  # noqa: E402
import ros  # noqa: E402

READER = idl.read(sorted(IDL.glob("*.idl")))
# As `ros2 topic info --verbose` of Jazzy shows them.
PUBLISHED = {
    "builtin_interfaces/msg/Time": "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197",
    "std_msgs/msg/String": "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "sensor_msgs/msg/JointState": "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
    "rosgraph_msgs/msg/Clock": "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    "trajectory_msgs/msg/JointTrajectory": "179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e",
    "tf2_msgs/msg/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}
# FieldType.msg of type_description_interfaces.
NUMBERS = {"uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9, "float32": 10,
           "float64": 11, "bool": 15, "string": 17}
LINE = re.compile(r"(?P<type>[A-Za-z0-9_/]+)(<=(?P<letters>\d+))?(?P<many>\[(<=(?P<bound>\d+))?\])? (?P<name>[a-z][a-z0-9_]*)$")


def read_definition(name):
    """Fields of a .msg file, as the type description of ROS 2; constants and comments left out."""
    fields = []
    for line in (PACKAGE / "msg" / f"{name}.msg").read_text(encoding="utf-8").splitlines():
        line = line.split("#")[0].strip()
        if not line or re.match(r"\S+ [A-Z][A-Z0-9_]*=", line):
            continue
        match = LINE.match(line)
        assert match, f"{name}.msg: {line!r} is no field"
        kind, nested = NUMBERS.get(match["type"]), ""
        if kind is None:
            package, _, last = match["type"].rpartition("/")
            kind, nested = 1, f"{package or 'takt_msgs'}/msg/{last}"
        if match["letters"]:
            kind = 21
        if match["many"]:
            kind += 96 if match["bound"] else 144
        fields.append({"name": match["name"], "type": {
            "type_id": kind, "capacity": int(match["bound"] or 0), "string_capacity": int(match["letters"] or 0),
            "nested_type_name": nested}})
    return {"type_name": f"takt_msgs/msg/{name}", "fields": fields}


def describe(full_name, found):
    """The type and those it holds, into `found`; types of other packages from the IDL."""
    if full_name in found:
        return
    package, _, name = full_name.split("/")
    found[full_name] = read_definition(name) if package == "takt_msgs" else ros.described(READER.structs[full_name])
    for field in found[full_name]["fields"]:
        if field["type"]["nested_type_name"]:
            describe(field["type"]["nested_type_name"], found)


class RosPackage(unittest.TestCase):
    def test_hashes_of_standard_types_are_the_published_ones(self):
        for name, published in PUBLISHED.items():
            with self.subTest(name):
                self.assertEqual(ros.type_hash(READER.structs[name], READER), "RIHS01_" + published)

    def test_each_message_on_the_wire_announces_the_hash_of_its_definition(self):
        header = (GENERATED / "takt_msgs.h").read_text(encoding="utf-8")
        topics = [s for s in READER.structs.values() if s.has("topic") and s.scope == ("takt_msgs", "msg")]
        self.assertGreater(len(topics), 5)
        for struct in topics:
            with self.subTest(struct.name):
                found = {}
                describe(struct.full_name, found)
                own = found.pop(struct.full_name)
                text = json.dumps({"type_description": own,
                                   "referenced_type_descriptions": [found[name] for name in sorted(found)]})
                announced = re.search(r'struct MessageTable<takt_msgs::msg::%s>.*?"(RIHS01_\w+)"' % struct.name, header,
                                      re.DOTALL)
                self.assertEqual(announced[1], "RIHS01_" + hashlib.sha256(text.encode()).hexdigest())

    def test_names_are_allowed_in_ros(self):
        for struct in READER.structs.values():
            if struct.scope[0] != "takt_msgs":
                continue
            self.assertRegex(struct.name, r"^[A-Z][A-Za-z0-9]*(_Request|_Response)?$")
            for field in struct.fields:
                self.assertRegex(field.name, r"^(?!.*__)(?!.*_$)[a-z][a-z0-9_]*$", struct.name)

    def test_the_package_lists_each_definition(self):
        listed = re.findall(r'"((?:msg|srv)/\w+\.\w+)"', (PACKAGE / "CMakeLists.txt").read_text(encoding="utf-8"))
        there = sorted(str(path.relative_to(PACKAGE)) for path in PACKAGE.glob("*/*"))
        self.assertEqual(listed, there)


if __name__ == "__main__":
    unittest.main()
