#!/usr/bin/python3
"""Pictures of the page of takt view for docs/view.md: as wide as said at most, with one palette, so that they stay small.
Usage: page_pictures.py OUTPUT.png WIDTH INPUT.png [OUTPUT.png WIDTH INPUT.png ...]. Needs Debian's python3-pil."""
import sys
from pathlib import Path

from PIL import Image

COLOURS = 256


def main(output, width, name):
    picture = Image.open(name).convert("RGB")
    if picture.width > width:
        picture = picture.resize((width, round(picture.height * width / picture.width)), Image.LANCZOS)
    picture.quantize(COLOURS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(output, format="PNG", optimize=True)


if __name__ == "__main__":
    words = sys.argv[1:]
    for i in range(0, len(words), 3):
        main(Path(words[i]), int(words[i + 1]), words[i + 2])
