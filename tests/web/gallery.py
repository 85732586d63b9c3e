#!/usr/bin/python3
"""Makes docs/images/page_CELL.png of the pictures that look.mjs keeps: three sizes, light above dark, at one height.

gallery.py PICTURES docs/images
"""
import sys
from pathlib import Path

from PIL import Image

WIDTHS = (1400, 2560, 390)
HEIGHT, GAP, COLOURS = 430, 8, 160


def row(pictures: Path, cell: str, theme: str) -> list[Image.Image]:
    images = [Image.open(pictures / f"{cell}_{width}_{theme}.png").convert("RGB") for width in WIDTHS]
    return [i.resize((round(i.width * HEIGHT / i.height), HEIGHT), Image.LANCZOS) for i in images]


def gallery(pictures: Path, cell: str) -> Image.Image:
    rows = [row(pictures, cell, theme) for theme in ("light", "dark")]
    width = sum(image.width for image in rows[0]) + GAP * (len(WIDTHS) - 1)
    whole = Image.new("RGB", (width, 2 * HEIGHT + GAP), (128, 128, 128))
    for line, images in enumerate(rows):
        left = 0
        for image in images:
            whole.paste(image, (left, line * (HEIGHT + GAP)))
            left += image.width + GAP
    return whole.quantize(COLOURS, dither=Image.Dither.NONE)


def main() -> None:
    pictures, folder = Path(sys.argv[1]), Path(sys.argv[2])
    for first in sorted(pictures.glob("*_1400_light.png")):
        cell = first.name.removesuffix("_1400_light.png")
        gallery(pictures, cell).save(folder / f"page_{cell}.png", optimize=True)


if __name__ == "__main__":
    main()
