"""As much of rclpy as KUKA's rsi_simulator.py uses, without ROS."""
import time

_running = []


def init():
    pass


def shutdown():
    _running.clear()


def spin(node):
    _running.append(1)
    while _running:
        begin = time.monotonic()
        for _, call in node.timers:
            call()
        time.sleep(max(0.0, node.timers[0][0] - (time.monotonic() - begin)))
