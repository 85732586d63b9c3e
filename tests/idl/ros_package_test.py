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
    # Of actions: control_msgs 6.3 and newer, simulation_interfaces 2.1.
    "control_msgs/action/FollowJointTrajectory_SendGoal_Request": "179c93691f1f6d1d115881ff88c3917b7cc6eac2ba4bf56766cc7c4389e19ef1",
    "control_msgs/action/FollowJointTrajectory_SendGoal_Response": "e6a48ba740ae254500129a877f0b071be8663a115da1a539b74599cc97921fbf",
    "control_msgs/action/FollowJointTrajectory_GetResult_Request": "ecf7ea8463d3beec7084bca75216d0b01b87b6e1e4e09679bb26093041efcbe9",
    "control_msgs/action/FollowJointTrajectory_GetResult_Response": "08eefbaa146ce02ba45898d5e99160afd6c4c54a30d159aee0f2ca6035b1580f",
    "control_msgs/action/FollowJointTrajectory_FeedbackMessage": "95618cc73912d99b9acaa17d2da5e832cb0bfdeede7534fa8ec600feca2a6c4b",
    "control_msgs/action/GripperCommand_SendGoal_Request": "1b869b7b4042272dc0f8ed65468c4e57c9e532ea5e53ce74fda0767eefbfa983",
    "control_msgs/action/GripperCommand_SendGoal_Response": "0c8dda5e9d39ab5e3162b66e79b292a4258659ddfcf8722d39463f718b6c59bc",
    "control_msgs/action/GripperCommand_GetResult_Request": "1a3308da3acbc62cd8a3c823de80ba9e5f9b6bb6f6056d1ad6b29f5f285f97ae",
    "control_msgs/action/GripperCommand_GetResult_Response": "32ed5e1b5906767a3e9914dca4c4aed22529918f6c2360e6fb382363d4df4b45",
    "control_msgs/action/GripperCommand_FeedbackMessage": "392ff03fcd872f9dc2405cbeb2897fcf011ad9998458b6aa85c603b8a49e431d",
    "control_msgs/action/ParallelGripperCommand_SendGoal_Request": "dc8e5d95c0e15af6f03ff237eb8cfdaac14cc2b09f51b363311e98ec0a8487a0",
    "control_msgs/action/ParallelGripperCommand_SendGoal_Response": "613e4f060bff03b152eeaba1f8c6baa9d0309527b28b08bc9aae28ece7ef8b47",
    "control_msgs/action/ParallelGripperCommand_GetResult_Request": "cea82415cadc3288fdfa8aaba509e9939732aaecac6edf9cb954e5a7161646ec",
    "control_msgs/action/ParallelGripperCommand_GetResult_Response": "c973b1bb9b454de1c3f38a2af9d45bc1930b809f746d6d6ec91bb3c783cb09eb",
    "control_msgs/action/ParallelGripperCommand_FeedbackMessage": "c61f4cf99d06c5a3e24bed17c2910bdf66a30d89461e2ac7b5fd538a34b022cc",
    "simulation_interfaces/action/SimulateSteps_SendGoal_Request": "275e6fd2fafc5d33dcdc83bdea6de5cf29f30b9df74a3b9514a8c5d501fd0fe3",
    "simulation_interfaces/action/SimulateSteps_SendGoal_Response": "755f44a68d1e8d116f50dfed7ab30a140137fb71ad59eca4851d55abe2b3d4c2",
    "simulation_interfaces/action/SimulateSteps_GetResult_Request": "4591b0bfbcb881003bbd46a2acebcaddceb977e5352905218688ce5ed051fdeb",
    "simulation_interfaces/action/SimulateSteps_GetResult_Response": "5658172e771cb145a986a8ef4c2b80b5407b741038453b8539e35bed5ff23207",
    "simulation_interfaces/action/SimulateSteps_FeedbackMessage": "a30dee7ee7380769e616406ec5067b238aa2b27e1dbd7a5957fba1d908d7754d",
    # Of services: rosidl_generator_type_description on the .srv files of simulation_interfaces 2.1.
    "simulation_interfaces/srv/GetNamedPoses_Request": "3d85f7553c5fcb491256b6eab66204ee590edbd0ad2dd53bb4ddf8a95f16af6e",
    "simulation_interfaces/srv/GetNamedPoses_Response": "d0459c9da6adb831b3755778bc348cc88ad2b22fe864a11062df20610a12c320",
    "simulation_interfaces/srv/GetNamedPoseBounds_Request": "4a62596dff6478d6424267da8933b1446992f61c70c2c196aa36258a1f1d133f",
    "simulation_interfaces/srv/GetNamedPoseBounds_Response": "db03610df68de520b420ccc9dc8826a92547ab9e791ac2a36a7dc86e8f2aa180",
    "simulation_interfaces/srv/GetSpawnables_Request": "3e1d1577446a80da956db3e82363c2d66364f9802f6e9572d89497933207d921",
    "simulation_interfaces/srv/GetSpawnables_Response": "cb61fd741c429d6bc689514b7bfc65bb1518126961317acc6e414a841dc43daa",
    "simulation_interfaces/srv/SetEntityInfo_Request": "d80ba71f092c702485bdffcd35713793866df4e1a16ace6632c6d4a15bb1eb55",
    "simulation_interfaces/srv/SetEntityInfo_Response": "d17b31f0f6db0146ceb0b711d47dbf81c9c11c87ca4f64cfa671a95d9723c3d6",
    "simulation_interfaces/srv/GetAvailableWorlds_Request": "6335180e35038ba62eb2bae3d1c1bacd4b7791209137eacbddfee12629bf6c3a",
    "simulation_interfaces/srv/GetAvailableWorlds_Response": "0ce98a1547f1852fd6d95f794ae4bae8b1d97b9cfa83ea22b80f634999234a18",
    "simulation_interfaces/srv/GetCurrentWorld_Request": "414ac6e1c5fd5f8be0b828ca7ff8cbee7166297809de31a36129f1d0913cd877",
    "simulation_interfaces/srv/GetCurrentWorld_Response": "039f99eb4e156ac597efed7598249921f8e47e5bff8c299d86ab081983a3a52a",
    "simulation_interfaces/srv/LoadWorld_Request": "cd389402a680703d3f9b45b1c3d6bb09c0578b4644654227f0b2e98a2f059f48",
    "simulation_interfaces/srv/LoadWorld_Response": "7bab3265c2461d98a44dd04830c5dc997b3d8605c50861824066246c96a7716e",
    "simulation_interfaces/srv/UnloadWorld_Request": "22b41a53aecd3cd180a218b16d9428cddc10b9e592ae16eaa434be873387e972",
    "simulation_interfaces/srv/UnloadWorld_Response": "68d4ea5721903837edd7c7e90d86e62aafb861c1ace33b7c805931974a652d9e",
    "simulation_interfaces/srv/SpawnEntities_Request": "03f070057ac2ab26d723fe9f07c7d57bd39ace34ad34bb043cdbca36825c98d9",
    "simulation_interfaces/srv/SpawnEntities_Response": "85df56d44250220df64762bf3e769cce45f84730eff8b9823093ca3041ecbbf5",
    "simulation_interfaces/srv/GetEntities_Request": "f0a4c6c0c39c87f84cbd1ea31956b9f39b3fa538ae9c4aa7fc243a32360e8c70",
    "simulation_interfaces/srv/GetEntities_Response": "dd1916edbdc659d355e77980b16ed6eb4d41d5ff445557931ed65c58b00f7b2c",
    "action_msgs/srv/CancelGoal_Request": "3d3c84653c1f96918086887e1dcb236faec88b81a5b14fd4cf4840065bcdf8af",
    "action_msgs/srv/CancelGoal_Response": "35e682cf3f510e83c70a82a4aac888496dedee56773bf9d8e5e0aa81f9e1c960",
    "action_msgs/msg/GoalStatusArray": "6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e",
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
