"""Messages of ABB's EGM by hand, from the numbers of fields in the fact sheet. No packages."""
import struct


def varint(n):
    out = b""
    while True:
        byte, n = n & 127, n >> 7
        if not n:
            return out + bytes([byte])
        out += bytes([byte | 128])


def unsigned(field, value):
    return varint(field << 3) + varint(value)


def double(field, value):
    return varint(field << 3 | 1) + struct.pack("<d", value)


def message(field, content):
    return varint(field << 3 | 2) + varint(len(content)) + content


def joints(values):
    return b"".join(double(1, v) for v in values)


def sensor(seqno, values, tm=None, kind=3, speeds=None, digital=None):
    header = unsigned(1, seqno) + (b"" if tm is None else unsigned(2, tm)) + unsigned(3, kind)
    out = message(1, header) + message(2, message(1, joints(values)))
    if speeds is not None:
        out += message(3, message(1, joints(speeds)))
    if digital is not None:
        out += message(4, unsigned(1, digital))
    return out


def path_correction(seqno, y, z):
    pos = double(1, 0.0) + double(2, y) + double(3, z)
    return message(1, unsigned(1, seqno) + unsigned(3, 4)) + message(2, message(1, pos) + unsigned(2, 1))


def robot(seqno, values, tm, motors=1, mci=3, digital=None):
    pose = (message(1, double(1, 1.0) + double(2, 2.0) + double(3, 3.0)) +
            message(2, double(1, 1.0) + double(2, 0.0) + double(3, 0.0) + double(4, 0.0)))
    motion = message(1, joints(values)) + message(2, pose) + message(4, unsigned(1, tm // 1000) + unsigned(2, tm % 1000 * 1000))
    out = message(1, unsigned(1, seqno) + unsigned(2, tm) + unsigned(3, 2)) + message(2, motion)
    out += message(3, motion)
    out += message(4, unsigned(1, motors)) + message(5, unsigned(1, mci)) + unsigned(6, 0) + message(8, unsigned(1, 2)) + double(10, 12.5)
    if digital is not None:
        out += message(13, unsigned(1, digital))
    return out


def fields(data):
    """Of one message: number -> list of values."""
    found, at = {}, 0

    def read():
        nonlocal at
        n = shift = 0
        while True:
            n |= (data[at] & 127) << shift
            shift, at = shift + 7, at + 1
            if data[at - 1] < 128:
                return n

    while at < len(data):
        key = read()
        kind = key & 7
        if kind == 0:
            value = read()
        elif kind == 1:
            value, at = struct.unpack("<d", data[at:at + 8])[0], at + 8
        elif kind == 2:
            length = read()
            value, at = data[at:at + length], at + length
        else:
            raise ValueError(kind)
        found.setdefault(key >> 3, []).append(value)
    return found


def joints_of(robot_fields, motion=2):
    return fields(fields(robot_fields[motion][0])[1][0])[1]
