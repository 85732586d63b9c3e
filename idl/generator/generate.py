#!/usr/bin/env python3
"""Writes what is generated from takt's IDL. Usage: generate.py OUTPUT_DIRECTORY FILE.idl..., or
generate.py --docs DIRECTORY FILE.idl... for the pages that are made of it, or
generate.py --permissions DIRECTORY FILE.idl... for the permissions of a secured cell. A file is written only when its text
changes, so that a build repeats no work."""
import sys
from pathlib import Path

import cpp
import events
import idl
import page_script
import permissions
import python_api
import requests
import ros


def write(path, text):
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def main(arguments):
    only = arguments[0] if arguments[:1] in (["--docs"], ["--permissions"]) else None
    arguments = arguments[1:] if only else arguments
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
    try:
        requests.of(reader)  # of whatever receiver
        events.of(reader)
    except idl.IdlError as error:
        sys.exit(str(error))
    output.mkdir(parents=True, exist_ok=True)
    if only == "--docs":
        write(output / "requests.md", requests.page(reader))
        write(output / "events.md", events.page(reader))
        return
    if only == "--permissions":
        for name, text in permissions.documents(reader).items():
            write(output / name, text)
        return
    for file in reader.files.values():
        write(output / f"{file.path.stem}.h", cpp.types_header(file, reader))
    write(output / "takt_topics.h", cpp.topics_header(reader))
    write(output / "takt_actions.h", cpp.actions_header(reader))
    write(output / "takt_request_table.h", requests.table_header(reader))
    for receiver in requests.BESIDE:
        write(output / f"takt_{receiver}_table.h", requests.table_header_beside(reader, receiver))
    write(output / "takt_event_table.h", events.table_header(reader))
    for name, text in (("requests.py", python_api.module), ("enumerations.py", python_api.enumerations),
                       ("messages.pyi", python_api.messages), ("topics.py", python_api.topics), ("messages.js", page_script.script)):
        write(output / name, text(reader))
    package, files = output / "ros" / ros.PACKAGE, ros.package(reader)
    for path, text in files.items():
        file = package / path
        file.parent.mkdir(parents=True, exist_ok=True)
        write(file, text)
    for file in package.rglob("*"):
        if file.is_file() and str(file.relative_to(package)) not in files:
            file.unlink()  # of a definition that is gone


main(sys.argv[1:])
