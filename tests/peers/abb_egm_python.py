"""Runs a program on ABB-EGM-Python with Debian's protobuf: its generated module wants a newer one, so that the classes
are made here of the descriptor in it. abb_egm_python.py FOLDER PROGRAM."""
import ast
import re
import runpy
import sys
import types

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

folder, program = sys.argv[1:3]
text = open(f"{folder}/src/ABBRobotEGM/_egm_protobuf/egm_pb2.py", encoding="utf-8").read()
serialized = ast.literal_eval(re.search(r"AddSerializedFile\((b'.*')\)", text).group(1))
file = descriptor_pb2.FileDescriptorProto.FromString(serialized)
pool = descriptor_pool.DescriptorPool()
pool.Add(file)
module = types.ModuleType("ABBRobotEGM._egm_protobuf.egm_pb2")
for message in file.message_type:
    descriptor = pool.FindMessageTypeByName(f"{file.package}.{message.name}")
    setattr(module, message.name, message_factory.MessageFactory(pool).GetPrototype(descriptor))
for enum in file.enum_type:
    for value in enum.value:
        setattr(module, value.name, value.number)
sys.path.insert(0, f"{folder}/src")
package = types.ModuleType("ABBRobotEGM._egm_protobuf")
package.egm_pb2 = module
sys.modules["ABBRobotEGM._egm_protobuf"] = package
sys.modules["ABBRobotEGM._egm_protobuf.egm_pb2"] = module
sys.argv = [program]
runpy.run_path(program, run_name="__main__")
