#!/usr/bin/python3
"""Pictures of the small scenarios of config/devices for docs/scenes.md, by the command in the head of each file: small, with one
palette. Usage: device_pictures.py TAKT_RUN [NAME ...]. Needs Debian's python3-pil."""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
WIDTH, COLOURS = 560, 255


def main(program, names):
    out = ROOT / "docs/images/devices"
    out.mkdir(parents=True, exist_ok=True)
    for file in sorted((ROOT / "config/devices").glob("*.yaml")):
        if names and file.stem not in names:
            continue
        instant, view = re.search(r"--picture \S+@(\S+) --picture-view (\S+)", file.read_text(encoding="utf-8")).groups()
        with tempfile.TemporaryDirectory() as folder:
            picture = Path(folder) / "a.png"
            subprocess.run([program, "run", str(file), "--quiet", "--picture", f"{picture}@{instant}", "--picture-view", view],
                           cwd=ROOT, check=True)
            image = Image.open(picture).convert("RGB")
        image = image.resize((WIDTH, round(image.height * WIDTH / image.width)), Image.LANCZOS)
        image.quantize(COLOURS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(
            out / f"{file.stem}.png", format="PNG", optimize=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
