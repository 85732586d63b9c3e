#!/usr/bin/env python3
"""Writes what is generated from takt's IDL. Usage: generate.py OUTPUT_DIRECTORY FILE.idl...
Into the directory: C++ headers, and below ros/takt_msgs the package folder for ROS 2.
A file is written only when its text changes, so that a build repeats no work."""
import sys
from pathlib import Path

import cpp
import idl
import ros


def write(path, text):
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def main(arguments):
    if len(arguments) < 2:
        sys.exit(__doc__)
    output = Path(arguments[0])
    try:
        reader = idl.read(arguments[1:])
    except (idl.IdlError, OSError) as error:
        sys.exit(str(error))
    gaps = list(idl.find_gaps(reader))
    if gaps:
        sys.exit("\n".join(gaps))
    output.mkdir(parents=True, exist_ok=True)
    for file in reader.files.values():
        write(output / f"{file.path.stem}.h", cpp.types_header(file, reader))
    write(output / "takt_topics.h", cpp.topics_header(reader))
    for path, text in ros.package(reader).items():
        file = output / "ros" / ros.PACKAGE / path
        file.parent.mkdir(parents=True, exist_ok=True)
        write(file, text)


main(sys.argv[1:])
