# pymodbus (Debian: python3-pymodbus) against takt-modbus: modbus_pymodbus.py PORT client | server. Prints results as JSON.
# client: good and bad requests to takt's server. server: a PLC's memory that takt polls, with a program: discrete input 0
# is 1 at first, and 0 when coil 1 (closed) is set and holding registers 4 and 5 (time) are not zero.
import asyncio
import json
import sys
import threading

port, role = int(sys.argv[1]), sys.argv[2]


def client():
    from pymodbus.client import ModbusTcpClient

    one = ModbusTcpClient("127.0.0.1", port=port)
    assert one.connect()
    results = {}
    results["write_coil"] = not one.write_coil(0, True, slave=1).isError()
    results["coil"] = one.read_coils(0, 1, slave=1).bits[0]
    results["write_width"] = not one.write_registers(0, [20], slave=1).isError()
    results["holding"] = one.read_holding_registers(0, 1, slave=1).registers
    results["combined"] = one.readwrite_registers(
        read_address=0, read_count=1, write_address=0, write_registers=[25], unit=1
    ).registers
    results["too_wide"] = one.write_registers(0, [60000], slave=1).exception_code
    results["inputs"] = len(one.read_discrete_inputs(0, 2, slave=1).bits) >= 2
    results["beyond"] = one.read_input_registers(60000, 2, slave=1).exception_code
    objects = one.execute(device_identification()).information
    results["device_identification"] = [objects[number].decode() for number in sorted(objects)]
    one.close()
    print(json.dumps(results), flush=True)


def device_identification():
    from pymodbus.mei_message import ReadDeviceInformationRequest

    return ReadDeviceInformationRequest(unit=1)


def server():
    from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
    from pymodbus.server import StartAsyncTcpServer

    # ModbusSlaveContext counts from 1 without zero_mode.
    memory = ModbusSlaveContext(
        di=ModbusSequentialDataBlock(0, [1] + [0] * 99),
        co=ModbusSequentialDataBlock(0, [0] * 100),
        hr=ModbusSequentialDataBlock(0, [0] * 100),
        ir=ModbusSequentialDataBlock(0, [30] + [0] * 99),
        zero_mode=True,
    )

    def cycle():
        # The PLC's program: the gripper opens when it is closed and the time of the cell arrives.
        closed, time_ms = memory.getValues(1, 1, 1)[0], memory.getValues(3, 4, 2)
        if closed and time_ms[0] + time_ms[1] and memory.getValues(2, 0, 1)[0]:
            memory.setValues(2, 0, [0])
            print("opens", flush=True)
        threading.Timer(0.01, cycle).start()

    cycle()
    print("ready", flush=True)
    asyncio.run(
        StartAsyncTcpServer(
            context=ModbusServerContext(slaves=memory, single=True),
            address=("127.0.0.1", port),
            allow_reuse_address=True,
        )
    )


{"client": client, "server": server}[role]()
