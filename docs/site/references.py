"""Generated references: docs/topics.md from idl/, docs/scenes.md from the heads of scenario files; in the site the command
lines of the programs from their --help and the Python API from the docstrings of the package. Called as a program it writes
both pages."""
import inspect
import importlib
import itertools
import os
import re
import subprocess
import sys
from pathlib import Path

PROGRAMS = ("takt", "takt-server", "takt-run", "takt-controller", "takt-ur", "takt-rsi", "takt-egm", "takt-modbus")
OPTIONAL_PROGRAMS = ("takt-from-cad", "takt-opcua")  # built where their libraries are
DELIVERY = {"instant": "best effort", "latched": "reliable, transient local", "latched_large": "reliable, transient local"}
SCENES = (("Cells", "config/scenarios"), ("Surface contact", "config/scenarios/contact"), ("Devices", "config/devices"))
SUBCOMMAND = re.compile(r"^  ([a-z][a-z_-]*) {2,}")


class ReferenceError(Exception):
    pass


def write(folder, programs, python):
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (("command_lines", command_lines(programs)), ("python", python_api(python))):
        (folder / f"{name}.md").write_text(text, encoding="utf-8")


def cell(text):
    return text.replace("|", "\\|").replace("\n", " ")


# --- topics -----------------------------------------------------------------------------------------------------------

def topics(idl_folder):
    """docs/topics.md"""
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(idl_folder / "generator"))
    idl = importlib.import_module("idl")
    reader = idl.read([str(idl_folder / name) for name in ("takt_player.idl", "takt_pendant.idl", "takt_events.idl", "ros2_msgs.idl")])
    structs = [struct for struct in reader.structs.values() if "/msg/" in struct.full_name]
    lines = ["# Topics and messages", "", "<!-- Written by docs/site/references.py from idl/; `./dev docs` renews it. -->", "",
             "`{cell}`, `{robot}`, `{gripper}` and `{device}` stand for names. Units are SI and radians. "
             "[Topics, requests and services](interface.md) has the rules of commands.", "",
             "| topic | message | sent by | delivery | content |", "|---|---|---|---|---|"]
    for struct in structs:
        for annotation in struct.annotations:
            if annotation.name == "topic":
                values = annotation.arguments
                delivery = DELIVERY.get(values["qos"], "reliable")
                lines.append(f"| `/{values['name']}` | {message_link(struct)} | {values['by']} | {delivery} | {cell(struct.doc)} |")
    lines += ["", "## Messages", ""]
    for struct in structs:
        lines += [f"### {struct.full_name}", "", struct.doc, ""] if struct.doc else [f"### {struct.full_name}", ""]
        if struct.fields:
            lines += ["| field | type | unit | meaning |", "|---|---|---|---|"]
        for field in struct.fields:
            kind = field.annotation("enumeration") or field.type
            kind = f"[{kind.split('/')[-1]}](#{anchor(kind)})" if field.kind == "message" else f"`{kind}`"
            many = f" [{field.array}]" if field.array else " [ ]" if field.sequence else ""
            lines.append(f"| `{field.name}` | {kind}{many} | {cell(field.annotation('unit'))} | {cell(field.doc)} |")
        lines.append("")
    return "\n".join(lines)


def anchor(name):
    return re.sub(r"[^a-z0-9_-]", "", name.lower())


def message_link(struct):
    return f"[{struct.full_name}](#{anchor(struct.full_name)})"


# --- scenarios --------------------------------------------------------------------------------------------------------

def head(text):
    """The comment at the beginning of a file as Markdown: paragraphs, and commands (indented) as code."""
    lines = []
    for line in itertools.takewhile(lambda line: line.startswith("#"), text.splitlines()):
        if "yaml-language-server" not in line:
            command = line.startswith("#   ")
            lines.append("    " + line[4:] if command else re.sub(r"([*<_])", r"\\\1", line[2:]))
    groups = itertools.groupby(lines, lambda line: line.startswith("    "))
    return "\n\n".join("\n".join(group).strip("\n") for _, group in groups).replace("`", "")


def scenes(root):
    """docs/scenes.md"""
    lines = ["# Shipped scenarios", "", "<!-- Written by docs/site/references.py from the heads of the files; `./dev docs` renews it. -->",
             "", "`takt-run run FILE` runs each of them. `expected` and `assertions` of a file hold the result that is known. "
             "Meshes: [config/meshes](../config/meshes/README.md).", ""]
    for title, folder in SCENES:
        lines += [f"## {title}", ""]
        for file in sorted((root / folder).glob("*.yaml")):
            text = file.read_text(encoding="utf-8")
            description = re.search(r"^description: *(.*)$", text, re.MULTILINE)
            if not description:
                raise ReferenceError(f"{file}: found no description; say in one line what happens")
            description = description[1][0].upper() + description[1][1:]
            lines += [f"### `{file.stem}`", "", f"[{folder}/{file.name}](../{folder}/{file.name}): {description}.", ""]
            picture = root / "docs/images/devices" / f"{file.stem}.png"
            if folder == "config/devices":
                if not picture.exists():
                    raise ReferenceError(f"there is no {picture}; ./dev figures site makes it by the command in the head of {file}")
                lines += [f"![{description}](images/devices/{file.stem}.png)", ""]
            lines += [head(text), ""]
    return "\n".join(lines)


# --- command lines ----------------------------------------------------------------------------------------------------

def command_lines(folder):
    lines = ["# Command lines", "", "The `--help` of each program and of each of its subcommands. "
             "[Command-line tools](../tools.md) shows their use.", ""]
    if folder is None:
        return "\n".join(lines + ["This build of the site had no programs: `./dev docs` builds them first.", ""])
    for program in (*PROGRAMS, *(name for name in OPTIONAL_PROGRAMS if (folder / name).exists())):
        if not (folder / program).exists():
            raise ReferenceError(f"there is no {folder / program}; build it first")
        text = help_of([folder / program])
        lines += [f"## {program}", "", "```text", text, "```", ""]
        for name in subcommands(text):
            lines += [f"### {program} {name}", "", "```text", help_of([folder / program, name]), "```", ""]
    return "\n".join(lines)


def help_of(command):
    result = subprocess.run([*map(str, command), "--help"], text=True, capture_output=True, timeout=60)
    if result.returncode != 0:
        raise ReferenceError(f"{' '.join(map(str, command))} --help ended with code {result.returncode}: {result.stderr}")
    return result.stdout.rstrip()


def subcommands(text):
    listed, found = False, []
    for line in text.splitlines():
        if line.lower().startswith("subcommands"):
            listed = True
        elif line and not line.startswith(" "):
            listed = False
        elif listed and (match := SUBCOMMAND.match(line)):
            found.append(match[1])
    return found


# --- Python -----------------------------------------------------------------------------------------------------------

def python_api(folder):
    lines = ["# Python", "", "The package `takt`, from its docstrings. [Clients in C++ and Python](../clients.md) shows "
             "its use; fields of messages: [topics and messages](../topics.md).", ""]
    if folder is None:
        return "\n".join(lines + ["This build of the site had no Python package: `./dev docs` builds it first.", ""])
    sys.path.insert(0, str(folder))
    takt = importlib.import_module("takt")
    undocumented = []

    def documented(name, value):
        if not inspect.getdoc(value):
            undocumented.append(name)

    for name in sorted(name for name in dir(takt) if not name.startswith("_")):
        value = getattr(takt, name)
        if not getattr(value, "__module__", "").startswith("takt"):
            continue
        if not inspect.isclass(value):
            if callable(value):
                documented(name, value)
                lines += [f"## {name}", "", *entry(name, value), ""]
            continue
        if is_message(value):
            continue
        documented(name, value)
        lines += [f"## {name}", "", inspect.getdoc(value) or "", ""]
        for member in sorted(vars(value)):
            attribute = getattr(value, member)
            if member.startswith("_") or not (callable(attribute) or isinstance(vars(value)[member], property)):
                continue
            documented(f"{name}.{member}", vars(value)[member])
            lines += [f"### {name}.{member}", "", *entry(f"{name}.{member}", attribute, vars(value)[member]), ""]
    if undocumented:
        raise ReferenceError(f"these names of the Python package have no docstring: {', '.join(undocumented)}")
    return "\n".join(lines)


def is_message(value):
    return value.__module__.endswith("messages")


def entry(name, value, declared=None):
    """Signature and docstring; pybind11 puts the signature into the first line of the docstring."""
    text = inspect.getdoc(declared if isinstance(declared, property) else value) or ""
    first, _, rest = text.partition("\n")
    if re.match(rf"^{re.escape(name.split('.')[-1])}\(.*\)", first):
        return ["```python", first, "```", "", rest.strip()]
    if isinstance(declared, property):
        return [text]
    try:
        return ["```python", f"{name}{inspect.signature(value)}", "```", "", text]
    except (TypeError, ValueError):
        return [text]


if __name__ == "__main__":
    here = Path(__file__).resolve().parents[2]
    (here / "docs/topics.md").write_text(topics(here / "idl"), encoding="utf-8")
    (here / "docs/scenes.md").write_text(scenes(here), encoding="utf-8")
