#!/usr/bin/env python3
"""Messages of actions as bytes, by an encoder of plain CDR that shares nothing with takt's: the layouts are written out
from the .action files. Prints the lines of action_messages.golden: NAME HEX. With --check FILE: whether FILE has these
lines, and whether the feedback reads the same by the definition of control_msgs 5 (Humble, Jazzy)."""
import struct
import sys
from pathlib import Path


class Writer:
    def __init__(self):
        self.bytes = b""

    def number(self, code, value):
        size = struct.calcsize("<" + code)
        self.bytes += b"\0" * (-len(self.bytes) % size) + struct.pack("<" + code, value)

    def text(self, value):
        data = value.encode() + b"\0"
        self.number("I", len(data))
        self.bytes += data

    def list(self, values, put):
        self.number("I", len(values))
        for value in values:
            put(value)

    def doubles(self, values):
        self.list(values, lambda value: self.number("d", value))

    def time(self, sec, nanosec):
        self.number("i", sec)
        self.number("I", nanosec)

    def header(self, sec, nanosec, frame):
        self.time(sec, nanosec)
        self.text(frame)

    def point(self, positions, velocities, accelerations, effort, time):
        for values in (positions, velocities, accelerations, effort):
            self.doubles(values)
        self.time(*time)

    def empty_multi_point(self):
        for _ in range(3):
            self.number("I", 0)
        self.time(0, 0)

    def sample(self):
        return (b"\0\1\0\0" + self.bytes).hex()


class Reader:
    def __init__(self, sample):
        self.bytes, self.at = bytes.fromhex(sample)[4:], 0

    def number(self, code):
        size = struct.calcsize("<" + code)
        self.at += -self.at % size
        self.at += size
        return struct.unpack_from("<" + code, self.bytes, self.at - size)[0]

    def text(self):
        length = self.number("I")
        self.at += length
        return self.bytes[self.at - length:self.at - 1].decode()

    def list(self, get):
        return [get() for _ in range(self.number("I"))]

    def point(self):
        return [self.list(lambda: self.number("d")) for _ in range(4)] + [(self.number("i"), self.number("I"))]

    def multi_point(self):
        return [self.number("I") for _ in range(3)] + [(self.number("i"), self.number("I"))]


ID = bytes(range(1, 17))
DESIRED = ([0.25, -1.5], [0.5, 0.0], [1.0, 2.0], [], (1, 50_000_000))
ACTUAL = ([0.24, -1.5], [0.5, 0.0], [], [], (1, 50_000_000))
ERROR = ([0.01, 0.0], [0.0, 0.0], [], [], (1, 50_000_000))


def feedback():
    out = Writer()
    out.bytes += ID
    out.header(3, 7, "")
    out.list(["a", "elbow"], out.text)
    for point in (DESIRED, ACTUAL, ERROR):
        out.point(*point)
    out.number("i", 0)           # index
    out.number("I", 0)           # multi_dof_joint_names
    for _ in range(3):
        out.empty_multi_point()
    out.number("i", 0)           # multi_dof_index
    return out.sample()


def send_goal():
    out = Writer()
    out.bytes += ID
    out.header(3, 7, "base")
    out.list(["a", "elbow"], out.text)
    out.list([DESIRED, ACTUAL], lambda point: out.point(*point))
    out.header(0, 0, "")         # multi_dof_trajectory
    out.number("I", 0)
    out.number("I", 0)

    def tolerance(name, values):
        out.text(name)
        for value in values:
            out.number("d", value)
    out.list([("a", (0.1, 0.2, 0.0))], lambda one: tolerance(*one))
    out.number("I", 0)           # component_path_tolerance
    out.list([("elbow", (0.01, -1.0, 0.0))], lambda one: tolerance(*one))
    out.number("I", 0)           # component_goal_tolerance
    out.time(2, 500_000_000)
    return out.sample()


def result():
    out = Writer()
    out.number("b", 6)
    out.number("i", -4)
    out.text("off")
    return out.sample()


def gripper_result():
    out = Writer()
    out.number("b", 4)
    out.number("d", 0.05)
    out.number("d", 12.5)
    out.number("?", True)
    out.number("?", False)
    return out.sample()


def status():
    out = Writer()

    def one(state):
        out.bytes += ID
        out.time(3, 7)
        out.number("b", state)
    out.list([2, 5], one)
    return out.sample()


def cancel_response():
    out = Writer()
    out.number("b", 0)

    def one(_):
        out.bytes += ID
        out.time(3, 7)
    out.list([0], one)
    return out.sample()


def steps_feedback():
    out = Writer()
    out.bytes += ID
    out.number("Q", 3)
    out.number("Q", 1 << 40)
    return out.sample()


GOLDEN = {"FollowJointTrajectory_FeedbackMessage": feedback(), "FollowJointTrajectory_SendGoal_Request": send_goal(),
          "FollowJointTrajectory_GetResult_Response": result(), "GripperCommand_GetResult_Response": gripper_result(),
          "GoalStatusArray": status(), "CancelGoal_Response": cancel_response(),
          "SimulateSteps_FeedbackMessage": steps_feedback()}
TEXT = "".join(f"{name} {sample}\n" for name, sample in GOLDEN.items())


def read_by_old_definition(sample):
    reader = Reader(sample)
    reader.at = len(ID)
    header = (reader.number("i"), reader.number("I"), reader.text())
    names = reader.list(reader.text)
    points = [reader.point() for _ in range(3)]
    multi = (reader.list(reader.text), [reader.multi_point() for _ in range(3)])
    return header, names, points, multi, len(reader.bytes) - reader.at


def main(arguments):
    if arguments[:1] != ["--check"]:
        sys.stdout.write(TEXT)
        return
    if Path(arguments[1]).read_text(encoding="utf-8") != TEXT:
        sys.exit(f"{arguments[1]} is not what this script writes; write it again with {sys.argv[0]} > {arguments[1]}")
    header, names, points, multi, rest = read_by_old_definition(GOLDEN["FollowJointTrajectory_FeedbackMessage"])
    wanted = [list(point) for point in (DESIRED, ACTUAL, ERROR)]
    if (header, names, points) != ((3, 7, ""), ["a", "elbow"], wanted):
        sys.exit(f"read by the old definition the feedback is {header} {names} {points}")
    if multi != ([], [[0, 0, 0, (0, 0)]] * 3) or rest != 8:
        sys.exit(f"behind the error the old definition finds {multi} and leaves {rest} bytes; 8 are expected")


main(sys.argv[1:])
