#!/usr/bin/env python3
"""The vendor's Python client against takt-ur: rtde_python.py FOLDER HOST. Exit code 0 if what it writes comes back."""

import sys

sys.path.insert(0, sys.argv[1])
import rtde.rtde as vendor  # noqa: E402

client = vendor.RTDE(sys.argv[2], 30004)
client.connect()
version = client.get_controller_version()
outputs = ["timestamp", "actual_q", "actual_TCP_pose", "actual_digital_output_bits", "input_double_register_24", "robot_mode"]
assert client.send_output_setup(outputs, frequency=125)
written = client.send_input_setup(["standard_digital_output_mask", "standard_digital_output", "input_double_register_24"])
assert client.send_start()
first = client.receive()
written.standard_digital_output_mask = written.standard_digital_output = 1
written.input_double_register_24 = 0.25
client.send(written)
for _ in range(1000):
    state = client.receive()
    if state.actual_digital_output_bits & 1 and state.input_double_register_24 == 0.25:
        break
else:
    sys.exit("RTDE_Python_Client_Library: what was written did not come back")
written.standard_digital_output = 0
client.send(written)
client.send_pause()
client.disconnect()
print(f"RTDE_Python_Client_Library: controller {version}, time {first.timestamp:.3f} s, joints {first.actual_q}: passed")
