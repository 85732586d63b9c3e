#!/usr/bin/python3
"""Joins PNG files of one size to a small moving picture (APNG) with one palette. Usage: moving_picture.py OUTPUT.png WIDTH
SECONDS FRAME.png... ; each frame is shown for SECONDS. Needs Debian's python3-pil."""
import sys
from pathlib import Path

from PIL import Image

COLOURS = 256


def main(output, width, seconds, names):
    frames = [Image.open(name).convert("RGB") for name in names]
    size = (width, round(frames[0].height * width / frames[0].width))
    frames = [frame.resize(size, Image.LANCZOS) for frame in frames]
    sheet = Image.new("RGB", (size[0], size[1] * len(frames)))  # the palette is that of all frames
    for index, frame in enumerate(frames):
        sheet.paste(frame, (0, index * size[1]))
    palette = sheet.quantize(COLOURS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    frames = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    frames[0].save(output, format="PNG", save_all=True, append_images=frames[1:], duration=round(seconds * 1000), loop=0, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), sys.argv[4:])
