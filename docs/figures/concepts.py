#!/usr/bin/env python3
"""Draws the pictures of docs/concepts.md. Usage: concepts.py OUTPUT_DIRECTORY"""
import sys
from pathlib import Path

BLUE, GREEN, ORANGE, GREY, INK = "#2f6db5", "#2e8b57", "#d9822b", "#8a8f98", "#222831"
TYPES = {"gripper": BLUE, "ground": GREY, "part": ORANGE}


class Picture:
    def __init__(self, width, height):
        self.size, self.items = (width, height), []

    def add(self, text):
        self.items.append(text)

    def box(self, x, y, w, h, fill, text="", ink="#ffffff", radius=6):
        self.add(f'<rect x="{x}" y="{y}" width="{w}" height="{h}" rx="{radius}" fill="{fill}"/>')
        if text:
            self.text(x + w / 2, y + h / 2 + 5, text, ink, "middle")

    def text(self, x, y, text, ink=INK, anchor="start", size=14, weight="normal"):
        self.add(f'<text x="{x}" y="{y}" fill="{ink}" text-anchor="{anchor}" font-size="{size}" font-weight="{weight}">{text}</text>')

    def line(self, x1, y1, x2, y2, ink=INK, width=2, arrow=False, dash=""):
        end = ' marker-end="url(#arrow)"' if arrow else ""
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.add(f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="{ink}" stroke-width="{width}"{end}{dashes}/>')

    def path(self, points, ink=INK, width=2):
        self.add(f'<polyline points="{" ".join(f"{x},{y}" for x, y in points)}" fill="none" stroke="{ink}" stroke-width="{width}"/>')

    def node(self, x, y, text, kind, ring=False):
        if ring:
            self.add(f'<circle cx="{x}" cy="{y}" r="27" fill="none" stroke="{GREEN}" stroke-width="4"/>')
        self.add(f'<circle cx="{x}" cy="{y}" r="21" fill="{TYPES[kind]}"/>')
        self.text(x, y + 5, text, "#ffffff", "middle", 15, "bold")

    def spring(self, x1, x2, y, ink=INK):
        coils, points = 7, [(x1, y), (x1 + 12, y)]
        for i in range(coils * 2):
            points.append((x1 + 12 + (x2 - x1 - 24) * (i + 0.5) / (coils * 2), y + (7 if i % 2 else -7)))
        self.path(points + [(x2 - 12, y), (x2, y)], ink)

    def damper(self, x1, x2, y, ink=INK):
        middle = (x1 + x2) / 2
        self.line(x1, y, middle - 12, y, ink)
        self.path([(middle + 12, y - 9), (middle - 12, y - 9), (middle - 12, y + 9), (middle + 12, y + 9)], ink)
        self.line(middle + 2, y - 7, middle + 2, y + 7, ink, 3)
        self.line(middle + 2, y, x2, y, ink)

    def write(self, path):
        width, height = self.size
        head = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
                'font-family="sans-serif"><defs><marker id="arrow" viewBox="0 0 10 10" refX="9" refY="5" markerUnits="userSpaceOnUse" markerWidth="11" '
                f'markerHeight="11" orient="auto-start-reverse"><path d="M0 0 10 5 0 10z" fill="{INK}"/></marker></defs>'
                f'<rect width="{width}" height="{height}" fill="#ffffff"/>')
        path.write_text(head + "\n" + "\n".join(self.items) + "\n</svg>\n", encoding="utf-8")


def components():
    """The three types, and the pairs that interact."""
    p = Picture(640, 210)
    p.node(120, 60, "G", "gripper")
    p.node(120, 160, "T", "ground")
    p.node(320, 110, "P", "part")
    p.node(520, 110, "O", "part")
    for x, y in ((120, 60), (120, 160)):
        p.line(x + 24, y + (8 if y < 110 else -8), 296, 110 + (-8 if y < 110 else 8), INK)
    p.line(344, 110, 496, 110, INK)
    p.line(120, 84, 120, 136, GREY, 2, dash="4 5")
    p.text(84, 38, "Gripper", BLUE)
    p.text(84, 200, "Ground", GREY)
    p.text(300, 80, "Part", ORANGE)
    p.text(500, 80, "Part", ORANGE)
    p.text(180, 60, "grasped", INK)
    p.text(180, 178, "placed", INK)
    p.text(382, 102, "assembled", INK)
    p.text(20, 116, "no pair", GREY)
    return p


def partner_search():
    """The contact graph of the block assembly and the search of P for its partner."""
    p = Picture(700, 260)
    places = {"T": (80, 200, "ground"), "B": (200, 140, "part"), "C": (200, 50, "part"), "O": (340, 140, "part"),
              "P": (460, 70, "part"), "G": (460, 200, "gripper")}
    for a, b in (("T", "B"), ("B", "C"), ("B", "O"), ("O", "P"), ("B", "P"), ("O", "G")):
        p.line(*places[a][:2], *places[b][:2], GREY, 2)
    for a, b in (("P", "O"), ("O", "G")):
        (x1, y1, _), (x2, y2, _) = places[a], places[b]
        k = 28 / ((x2 - x1) ** 2 + (y2 - y1) ** 2) ** 0.5
        p.line(x1 + (x2 - x1) * k, y1 + (y2 - y1) * k, x2 - (x2 - x1) * k, y2 - (y2 - y1) * k, GREEN, 4, True)
    for name, (x, y, kind) in places.items():
        p.node(x, y, name, kind, ring=name == "G")
    for name, level in (("B", 4), ("C", 3), ("O", 3), ("P", 2)):
        x, y, _ = places[name]
        p.text(x + 6, y - 28, str(level), ORANGE, size=13, weight="bold")
    p.text(510, 74, "the search starts here", INK)
    p.text(510, 204, "the partner of P", GREEN)
    p.text(20, 244, "P may go on to O and B (higher), never from B back to O or C (lower).", INK)
    return p


def substitute_force():
    p = Picture(700, 190)
    p.box(40, 50, 110, 90, BLUE, "Target")
    p.box(420, 60, 110, 70, ORANGE, "Base")
    p.spring(150, 420, 78)
    p.damper(150, 420, 112)
    p.text(285, 60, "k", INK, "middle")
    p.text(285, 142, "d", INK, "middle")
    p.line(475, 58, 475, 18, GREEN, 3, True)
    p.text(486, 30, "weight as feed-forward", GREEN)
    p.add(f'<rect x="408" y="52" width="134" height="86" rx="6" fill="none" stroke="{GREY}" stroke-dasharray="5 4"/>')
    p.text(475, 160, "pose at which the connection closed", GREY, "middle")
    return p


def levels():
    p = Picture(700, 250)
    titles = ("1 kinematic", "2 dynamic", "3 surface contact")
    notes = (("joints follow set-points", "substitute force holds"), ("masses, drives, torques", "substitute force holds"),
             ("masses, drives, torques", "pressure and friction hold"))
    for i, title in enumerate(titles):
        x = 30 + i * 225
        p.text(x + 90, 30, title, INK, "middle", 16, "bold")
        p.line(x + 90, 50, x + 90, 80, BLUE, 8)
        p.box(x + 40, 80, 100, 14, BLUE)
        for jaw in (x + 40, x + 128):
            p.box(jaw, 94, 12, 60, BLUE, radius=2)
        p.box(x + 55, 110, 70, 60, ORANGE, "Part")
        if i < 2:
            p.add(f'<rect x="{x + 52}" y="104" width="76" height="70" rx="4" fill="none" stroke="{GREEN}" stroke-width="3" stroke-dasharray="6 4"/>')
        else:
            for k in range(4):
                p.line(x + 30, 116 + 10 * k, x + 53, 116 + 10 * k, GREEN, 2, True)
                p.line(x + 150, 116 + 10 * k, x + 127, 116 + 10 * k, GREEN, 2, True)
        if i:
            p.text(x + 104, 66, "M", ORANGE, size=15, weight="bold")
            p.add(f'<circle cx="{x + 90}" cy="62" r="10" fill="none" stroke="{ORANGE}" stroke-width="3"/>')
        for k, note in enumerate(notes[i]):
            p.text(x + 90, 204 + 20 * k, note, INK, "middle", 13)
    return p


def pace():
    """Simulated over wall time at the three paces."""
    p = Picture(640, 260)
    p.line(60, 220, 600, 220, INK, 2, True)
    p.line(60, 220, 60, 20, INK, 2, True)
    p.text(600, 244, "wall time", INK, "end")
    p.text(70, 30, "simulated time", INK)
    p.line(60, 220, 170, 40, BLUE, 3)
    p.text(176, 50, "free: as fast as the machine can", BLUE)
    p.line(60, 220, 420, 70, GREEN, 3)
    p.text(428, 76, "realtime: factor 1", GREEN)
    points, x, y = [(60, 220)], 60, 220
    for wait in (40, 90, 30, 120, 50):
        points += [(x + wait, y), (x + wait + 6, y - 22)]
        x, y = x + wait + 6, y - 22
    p.path(points, ORANGE, 3)
    p.text(432, 122, "lockstep: stands until", ORANGE)
    p.text(432, 140, "the commands are there", ORANGE)
    return p


def lockstep():
    p = Picture(640, 250)
    for y, name in ((60, "controller"), (180, "cell")):
        p.text(20, y + 5, name, INK)
        p.line(110, y, 620, y, GREY, 2)
    for k in range(3):
        x = 150 + 160 * k
        p.line(x, 176, x + 26, 66, BLUE, 2, True)
        p.box(x + 26, 48, 50, 24, ORANGE, "think", radius=3)
        p.line(x + 76, 66, x + 102, 174, GREEN, 2, True)
        p.box(x + 102, 168, 54, 24, BLUE, "8 ms", radius=3)
        p.text(x - 4, 212, f"t = {8 * k} ms", INK, "middle", 13)
    p.text(172, 120, "state", BLUE, "end", 13)
    p.text(250, 36, "commands for t + 8 ms", GREEN, size=13)
    p.text(110, 240, "The cell stands between two boxes, however long the controller thinks.", INK)
    return p


def epoch():
    p = Picture(640, 170)
    for x, w, text, fill in ((60, 180, "epoch 0", BLUE), (250, 150, "epoch 1", BLUE), (410, 170, "epoch 2", BLUE)):
        p.box(x, 50, w, 30, fill, text, radius=3)
    p.text(245, 40, "reset", INK, "middle")
    p.text(405, 40, "restore", INK, "middle")
    p.line(245, 44, 245, 96, INK, 2)
    p.line(405, 44, 405, 96, INK, 2)
    for x, text in ((60, "step 0"), (250, "step 0"), (410, "step 800")):
        p.text(x, 100, text, GREY, size=13)
    p.text(60, 140, "Epoch and step together name one instant of the run.", INK)
    return p


def main():
    output = Path(sys.argv[1])
    for draw in (components, partner_search, substitute_force, levels, pace, lockstep, epoch):
        draw().write(output / f"concept_{draw.__name__}.svg")


if __name__ == "__main__":
    main()
