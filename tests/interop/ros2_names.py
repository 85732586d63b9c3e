#!/usr/bin/env python3
"""takt's IDL with the names of the ROS 2 mapping spelt out, for generators without that mapping (idlc): every struct goes
into a module dds_ and gets an underscore at its end. Annotations and enumerations are takt's own and are left out. The
generated header `peers` has PEER(C++ type, descriptor of Cyclone) for each struct.
Usage: ros2_names.py OUTPUT_DIRECTORY FILE.idl..."""
import re
import sys
from pathlib import Path

ANNOTATION = r'@(?!final\b)\w+\s*(\((?:[^()"]|"(?:[^"\\]|\\.)*")*\))?'


def spelt_out(text):
    text = re.sub(r"//[^\n]*", "", text)
    text = re.sub(ANNOTATION, "", text)
    text = re.sub(r"\bmodule takt\s*\{.*?\n\};", "", text, flags=re.S)
    text = re.sub(r'#include "takt_enumerations.idl"', "", text)
    text = re.sub(r'#include "(\w+)\.idl"', r'#include "ros2_names_\1.idl"', text)
    structs = {name: name.lstrip("_") + "_" for name in re.findall(r"\bstruct\s+(\w+)", text)}
    text = re.sub(r"\b(\w+)::(msg|srv)::_?(\w+)", r"\1::\2::dds_::\3@@", text)
    text = re.sub(r"\b\w+\b(?!@@)", lambda word: structs.get(word.group(), word.group()), text).replace("@@", "_")
    result, open_blocks = "", []
    for piece in re.split(r"(\bmodule\s+(?:msg|srv)\s*\{|\{|\};)", text):
        if re.match(r"module", piece):
            open_blocks.append("}; };")
            piece += " module dds_ {"
        elif piece == "{":
            open_blocks.append("};")
        elif piece == "};":
            piece = open_blocks.pop()
        result += piece
    return result


def main(output, files):
    peers = ""
    for file in map(Path, files):
        text = spelt_out(file.read_text(encoding="utf-8"))
        (output / f"ros2_names_{file.name}").write_text(text, encoding="utf-8")
        package = kind = ""
        for module, struct in re.findall(r"\bmodule\s+(\w+)|\bstruct\s+(\w+)_\s*(?::\s*\w+_\s*)?\{", text):
            if module in ("msg", "srv"):
                kind = module
            elif module and module != "dds_":
                package = module
            elif struct:
                peers += f"PEER({package}::{kind}::{struct}, {package}_{kind}_dds__{struct}__desc)\n"
    (output / "peers.h").write_text(peers, encoding="utf-8")


main(Path(sys.argv[1]), sys.argv[2:])
