#!/usr/bin/python3
"""Shapes of the devices in config/devices, so that pictures and the page show what they are: config/devices/meshes/NAME.obj, each
of closed convex solids that do not touch. Frame: that of the small scenario. Usage: device_shapes.py [FOLDER]"""
import math
import sys
from pathlib import Path

SIDES = 24  # of a cylinder


def box(center, size):
    """Eight vertices and six faces, counter-clockwise seen from outside."""
    x, y, z = (0.5 * s for s in size)
    vertices = [(center[0] + a * x, center[1] + b * y, center[2] + c * z) for c in (-1, 1) for b in (-1, 1) for a in (-1, 1)]
    return vertices, [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def cylinder(begin, axis, length, radius, end_radius=None):
    """Along the axis 0, 1 or 2; with another radius at its end a cone."""
    vertices = []
    for along, r in ((0.0, radius), (length, radius if end_radius is None else end_radius)):
        for k in range(SIDES):
            point = [0.0, 0.0, 0.0]
            point[axis] = along
            point[(axis + 1) % 3] = r * math.cos(2 * math.pi * k / SIDES)
            point[(axis + 2) % 3] = r * math.sin(2 * math.pi * k / SIDES)
            vertices.append(tuple(b + p for b, p in zip(begin, point)))
    ring = range(SIDES)
    faces = [(k, (k + 1) % SIDES, SIDES + (k + 1) % SIDES, SIDES + k) for k in ring]
    return vertices, [*faces, tuple(reversed(ring)), tuple(SIDES + k for k in ring)]


def legs(x, y, top, width=0.03):
    return [box((a * x, b * y, 0.5 * top), (width, width, top)) for a in (-1, 1) for b in (-1, 1)]


def post(x, z, y=0.0):
    """Of a light barrier: a pole with a housing at the height z."""
    return [box((x, y, 0.01), (0.1, 0.1, 0.02)), box((x, y, 0.021 + 0.5 * (z - 0.07)), (0.02, 0.02, z - 0.072)),
            box((x, y, z), (0.04, 0.05, 0.09))]


def probe(tip, axis, sense, radius=0.02, length=0.09):
    """A threaded sensor with two nuts; its face is at `tip`."""
    def at(distance):
        return tuple(t - sense * distance * (k == axis) for k, t in enumerate(tip))

    def piece(near, far, r):
        begin = at(far) if sense > 0 else at(near)
        return cylinder(begin, axis, far - near, r)
    return [piece(0.0, 0.015, 0.85 * radius), piece(0.0155, 0.04, radius), piece(0.0405, 0.05, 1.6 * radius),
            piece(0.0505, length, radius), piece(length + 0.0005, length + 0.06, 0.35 * radius)]


SHAPES = {
    # oven.yaml: a cabinet that is open towards -y, its door, heaters and a tray
    "oven": [box((0, 0, 0.16), (0.7, 0.6, 0.06)), box((0, 0, 0.88), (0.7, 0.6, 0.06)), box((-0.32, 0, 0.52), (0.06, 0.6, 0.658)),
             box((0.32, 0, 0.52), (0.06, 0.6, 0.658)), box((0, 0.27, 0.52), (0.578, 0.06, 0.658)),
             box((0.45, 0, 0.52), (0.198, 0.6, 0.78)), cylinder((0.1, 0.1, 0.911), 2, 0.15, 0.05), *legs(0.3, 0.25, 0.129, 0.05)],
    "oven_door": [box((-0.29, 0, 0), (0.08, 0.03, 0.66)), box((0.29, 0, 0), (0.08, 0.03, 0.66)),
                  box((0, 0, -0.28), (0.499, 0.03, 0.1)), box((0, 0, 0.28), (0.499, 0.03, 0.1)),
                  box((0.31, -0.05, 0), (0.02, 0.02, 0.4)), box((0.31, -0.027, 0.15), (0.02, 0.022, 0.02)),
                  box((0.31, -0.027, -0.15), (0.02, 0.022, 0.02))],
    "oven_heaters": [cylinder((-0.27, y, 0.215), 0, 0.54, 0.012) for y in (-0.2, -0.1, 0.0, 0.1, 0.2)] +
                    [cylinder((-0.27, y, 0.83), 0, 0.54, 0.012) for y in (-0.2, -0.1, 0.0, 0.1, 0.2)],
    "oven_panel": [box((0.45, -0.306, 0.75), (0.14, 0.01, 0.09)), box((0.45, -0.306, 0.58), (0.05, 0.01, 0.05)),
                   box((0.45, -0.306, 0.48), (0.05, 0.01, 0.05))],
    # pump.yaml: motor, volute and pipe; a tank with the water at its level, 0.51 m
    "pump": [box((-0.5, 0, 0.03), (0.5, 0.24, 0.06)), cylinder((-0.72, 0, 0.19), 0, 0.2, 0.1),
             *(cylinder((x, 0, 0.19), 0, 0.012, 0.115) for x in (-0.735, -0.5195)), box((-0.6, 0, 0.3), (0.1, 0.08, 0.03)),
             cylinder((-0.506, 0, 0.19), 0, 0.1, 0.03), cylinder((-0.405, 0, 0.19), 0, 0.07, 0.12),
             cylinder((-0.37, 0.0, 0.311), 2, 0.639, 0.03), cylinder((-0.37, 0.0, 0.951), 2, 0.06, 0.03),
             cylinder((-0.339, 0, 0.98), 0, 0.3, 0.03), cylinder((-0.335, 0, 0.19), 0, 0.06, 0.045)],
    "tank": [cylinder((0.1, 0, 0.1), 2, 0.04, 0.32), cylinder((0.1, 0, 0.85), 2, 0.03, 0.32),
             *(cylinder((0.1 + 0.3 * math.cos(a), 0.3 * math.sin(a), 0.141), 2, 0.708, 0.015)
               for a in (k * math.pi / 4 for k in range(8))),
             *(box((0.1 + 0.22 * a, 0.22 * b, 0.05), (0.05, 0.05, 0.098)) for a in (-1, 1) for b in (-1, 1)),
             cylinder((0.421, 0, 0.12), 0, 0.12, 0.025), box((0.6, 0, 0.12), (0.06, 0.05, 0.05))],
    "water": [cylinder((0.1, 0, 0.141), 2, 0.51, 0.28)],
    # welding_gun.yaml: a C-frame with a cylinder above and two electrodes, and two sheets between them
    "welding_gun": [box((-0.4, 0, 0.62), (0.16, 0.12, 0.7)), box((-0.14, 0, 0.3), (0.358, 0.08, 0.08)),
                    box((-0.14, 0, 0.95), (0.358, 0.08, 0.08)), cylinder((0, 0, 0.991), 2, 0.24, 0.07),
                    cylinder((0, 0, 0.79), 2, 0.119, 0.05), box((-0.4, 0, 1.02), (0.2, 0.16, 0.09)),
                    box((-0.4, 0, 0.13), (0.08, 0.08, 0.278)), box((-0.4, 0, -0.02), (0.5, 0.5, 0.02))],
    "electrodes": [cylinder((0, 0, 0.341), 2, 0.15, 0.03), cylinder((0, 0, 0.492), 2, 0.06, 0.022, 0.008),
                   cylinder((0, 0, 0.628), 2, 0.161, 0.03), cylinder((0, 0, 0.568), 2, 0.059, 0.008, 0.022)],
    "sheets": [box((0.12, 0, 0.5565), (0.6, 0.4, 0.005)), box((0.22, 0, 0.5625), (0.6, 0.4, 0.005))],
    # light_barrier.yaml, light_curtain.yaml: housings; beams where nothing passes
    "light_barrier": post(-0.53, 0.5) + post(0.53, 0.5),
    "light_curtain": [box((s * 0.53, 0.005, z), size) for s in (-1, 1)
                      for z, size in ((0.01, (0.14, 0.12, 0.02)), (0.13, (0.03, 0.03, 0.216)), (0.395, (0.05, 0.06, 0.31)))],
    "beam": [cylinder((x, 0, 0.5), 0, 0.42, 0.004) for x in (-0.505, 0.085)],
    "beams": [cylinder((x, 0.005, 0.29 + 0.03 * k), 0, 0.42, 0.003) for k in range(8) for x in (-0.503, 0.083)],
    # distance_sensor.yaml, proximity_box.yaml, identification_reader.yaml, temperature_sensor.yaml
    "distance_sensor": probe((-0.002, 0, 0), 0, 1, 0.025, 0.1) + [box((-0.045, 0, -0.11), (0.03, 0.06, 0.13)), box((-0.045, 0, -0.19), (0.2, 0.16, 0.02))],
    "proximity_switch": probe((0.5, 0, 0.09), 2, -1) + [box((0.5, 0.09, 0.135), (0.05, 0.1, 0.008)), box((0.5, 0.16, 0.03), (0.04, 0.03, 0.22))],
    "reader": [box((0.5, 0, -0.11), (0.26, 0.26, 0.04)), box((0.5, 0, -0.16), (0.1, 0.1, 0.058)), box((0.5, 0, -0.2), (0.3, 0.3, 0.02))],
    "reader_antenna": [box((0.5, 0, -0.087), (0.2, 0.2, 0.005))],
    "pyrometer": probe((0.14, 0, 0.02), 0, -1, 0.03, 0.14) + [box((0.185, 0, -0.02), (0.03, 0.08, 0.02)), box((0.185, 0, -0.045), (0.16, 0.14, 0.01))],
    "hot_plate": [box((0, 0, -0.076), (0.3, 0.3, 0.05))],
    # force_switch.yaml, limit_switch.yaml, safety.yaml
    "force_plate": [box((0, 0, -0.066), (0.3, 0.3, 0.03)), box((0, 0, -0.09), (0.16, 0.16, 0.016))],
    "limit_switch": [box((0.3, 0.16, 0.05), (0.06, 0.05, 0.1)), box((0.3, 0.16, 0.115), (0.012, 0.012, 0.028)), cylinder((0.288, 0.16, 0.142), 0, 0.024, 0.012)],
    "fence": [*(box((x, y, 0.55), (0.04, 0.04, 1.1)) for x, y in ((-0.75, 0.6), (0.0, 0.6), (0.75, 0.6), (-0.75, -0.6))),
              *(box((x, 0.6, z), (0.708, 0.015, 0.015)) for x in (-0.375, 0.375) for z in (0.2, 0.4, 0.6, 0.8, 1.0)),
              *(box((-0.75, 0.0, z), (0.015, 1.158, 0.015)) for z in (0.2, 0.4, 0.6, 0.8, 1.0))],
    "stop_box": [box((0.62, -0.5, 0.375), (0.05, 0.05, 0.75)), box((0.62, -0.5, 0.81), (0.12, 0.1, 0.11))],
    "stop_button": [cylinder((0.62, -0.5, 0.866), 2, 0.02, 0.022), cylinder((0.62, -0.5, 0.887), 2, 0.02, 0.042)],
    # transport: frames below belts, platforms and tables
    "belt_frame": [box((0, s * 0.115, -0.0375), (1.04, 0.02, 0.065)) for s in (-1, 1)] +
                  [box((x, s * 0.115, -0.2325), (0.04, 0.04, 0.323)) for x in (-0.42, 0.42) for s in (-1, 1)] +
                  [cylinder((x, -0.1, -0.075), 1, 0.2, 0.02) for x in (-0.47, -0.235, 0.0, 0.235, 0.47)],
    "cylinder_barrel": [cylinder((-0.46, 0, 0.05), 0, 0.2, 0.03), box((-0.47, 0, 0.05), (0.018, 0.08, 0.08)), box((-0.2505, 0, 0.05), (0.018, 0.08, 0.08)),
                        box((-0.36, 0, -0.005), (0.16, 0.05, 0.03))],
    "cylinder_rod": [cylinder((-0.2405, 0, 0.05), 0, 0.1, 0.012)],
    "lift_mast": [box((-0.26, s * 0.12, 0.2), (0.06, 0.06, 0.9)) for s in (-1, 1)] + [box((-0.26, 0, 0.67), (0.08, 0.32, 0.03)), box((-0.1, 0, -0.27), (0.5, 0.44, 0.03))],
    "turntable_base": [cylinder((0, 0, -0.05), 2, 0.029, 0.16), cylinder((0, 0, -0.2), 2, 0.149, 0.1), cylinder((0, 0, -0.24), 2, 0.039, 0.2)],
    # source_and_sink.yaml: a hopper above the table
    "hopper": [box((s * 0.11, 0, 1.3), (0.02, 0.24, 0.26)) for s in (-1, 1)] + [box((0, s * 0.11, 1.3), (0.198, 0.02, 0.26)) for s in (-1, 1)] +
              [box((s * 0.15, 0.15, 0.94), (0.02, 0.02, 0.478)) for s in (-1, 1)] + [box((0, 0.13, 1.2), (0.4, 0.018, 0.03))],
    "bin": [box((s * 0.13, 0, 0.74), (0.02, 0.28, 0.07)) for s in (-1, 1)] + [box((0, s * 0.13, 0.74), (0.238, 0.02, 0.07)) for s in (-1, 1)],
}


def text_of(name, solids):
    lines, before = [f"# {name}: made by docs/figures/device_shapes.py"], 1
    for number, (vertices, faces) in enumerate(solids, 1):
        lines.append(f"o {name}_{number}")
        lines += ["v " + " ".join(f"{c:.5f}".rstrip("0").rstrip(".") for c in vertex) for vertex in vertices]
        lines += ["f " + " ".join(str(before + k) for k in face) for face in faces]
        before += len(vertices)
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).resolve().parents[2] / "config/devices/meshes")
    for shape, solids in SHAPES.items():
        (folder / f"{shape}.obj").write_text(text_of(shape, solids), encoding="utf-8")
