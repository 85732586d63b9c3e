# A Modbus TCP master with the standard library alone, from the fact sheet: modbus_raw.py PORT TASK [ARGUMENT...]. Prints
# results as JSON. Tasks:
#   hostile            malformed requests, many connections, pipelined requests; the server must stay
#   lockstep N COIL    N periods: coil 0 alternates each 10 periods, COIL allows the step; registers are read each period
#   write COIL VALUE   writes one coil and stays connected without a request until standard input closes
import json
import socket
import struct
import sys

port, task, arguments = int(sys.argv[1]), sys.argv[2], sys.argv[3:]


def connect():
    connection = socket.create_connection(("127.0.0.1", port), timeout=60)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connection


def frame(transaction, pdu, unit=1, protocol=0, length=None):
    return struct.pack(">HHHB", transaction, protocol, 1 + len(pdu) if length is None else length, unit) + pdu


def receive(connection, count):
    data = b""
    while len(data) < count:
        part = connection.recv(count - len(data))
        if not part:
            raise EOFError
        data += part
    return data


def reply(connection):
    transaction, protocol, length, unit = struct.unpack(">HHHB", receive(connection, 7))
    assert protocol == 0
    return transaction, unit, receive(connection, length - 1)


def ask(connection, pdu, transaction=7):
    connection.sendall(frame(transaction, pdu))
    found, _, data = reply(connection)
    assert found == transaction
    return data


def closed(data):
    connection = connect()
    connection.sendall(data)
    connection.settimeout(30)
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True


def hostile():
    good = b"\x01\x00\x00\x00\x01"
    results = {}
    results["protocol"] = closed(frame(1, good, protocol=1))
    results["length_0"] = closed(frame(1, good, length=0))
    results["length_65535"] = closed(frame(1, good, length=65535))
    results["http"] = closed(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
    half = connect()
    half.sendall(frame(1, good)[:9])
    half.close()
    one = connect()
    results["function_99"] = ask(one, b"\x63").hex()
    results["address"] = ask(one, struct.pack(">BHH", 3, 65535, 2)).hex()
    results["count"] = ask(one, struct.pack(">BHH", 1, 0, 2001)).hex()
    results["coil_value"] = ask(one, struct.pack(">BHH", 5, 0, 1)).hex()
    # Ten requests in one packet, cut in the middle of the fifth.
    block = b"".join(frame(100 + i, good) for i in range(10))
    one.sendall(block[:55])
    one.sendall(block[55:])
    results["pipelined"] = [reply(one)[0] for _ in range(10)]
    many = [connect() for _ in range(30)]
    results["many"] = sum(ask(each, good, 3)[0] == 1 for each in many)
    one.sendall(frame(5, good, unit=9))
    results["unit"] = reply(one)[1:][0]
    print(json.dumps(results), flush=True)


def lockstep():
    periods, allow = int(arguments[0]), int(arguments[1])
    one = connect()
    steps, values = [], []
    for i in range(periods):
        coil = (i // 10) % 2
        ask(one, struct.pack(">BHH", 5, 0, 0xFF00 if coil else 0))
        ask(one, struct.pack(">BHH", 5, allow, 0xFF00))
        while ask(one, struct.pack(">BHH", 1, allow, 1))[2] & 1:
            pass
        data = ask(one, struct.pack(">BHH", 4, 0, 4))
        step, width = struct.unpack(">If", data[2:])
        steps.append(step)
        values.append(width)
    print(json.dumps({"steps": steps, "values": values}), flush=True)


def write():
    one = connect()
    data = ask(one, struct.pack(">BHH", 5, int(arguments[0]), 0xFF00 if int(arguments[1]) else 0))
    print(json.dumps({"reply": data.hex()}), flush=True)
    sys.stdin.read()


{"hostile": hostile, "lockstep": lockstep, "write": write}[task]()
