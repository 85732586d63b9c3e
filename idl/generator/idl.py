"""Reads takt's IDL files into plain objects. README.md beside this file describes the form."""
import re
from dataclasses import dataclass, field
from pathlib import Path

PRIMITIVES = {  # IDL: (name of its kind, C++, ROS 2)
    "boolean": ("boolean", "bool", "bool"),
    "octet": ("uint8", "std::uint8_t", "uint8"),
    "int8": ("int8", "std::int8_t", "int8"),
    "short": ("int16", "std::int16_t", "int16"),
    "unsigned short": ("uint16", "std::uint16_t", "uint16"),
    "long": ("int32", "std::int32_t", "int32"),
    "unsigned long": ("uint32", "std::uint32_t", "uint32"),
    "long long": ("int64", "std::int64_t", "int64"),
    "unsigned long long": ("uint64", "std::uint64_t", "uint64"),
    "float": ("float32", "float", "float32"),
    "double": ("float64", "double", "float64"),
    "string": ("string", "std::string", "string"),
}


class IdlError(Exception):
    """FILE:LINE: what was found, what is allowed."""


@dataclass
class Annotation:
    name: str
    arguments: dict  # key to text; a single argument without a key has the key "value"


@dataclass
class Annotated:
    name: str
    doc: str
    annotations: list
    line: int

    def annotation(self, name, key="value"):
        """The argument `key` of the first annotation `name`, or an empty text."""
        return next((a.arguments.get(key, "") for a in self.annotations if a.name == name), "")

    def has(self, name):
        return any(a.name == name for a in self.annotations)


@dataclass
class Enumerator(Annotated):
    value: int


@dataclass
class Enumeration(Annotated):
    scope: tuple
    enumerators: list


@dataclass
class Field(Annotated):
    kind: str            # of PRIMITIVES, or "message"
    type: str            # IDL's word of a primitive, or pkg/msg/Name
    string_bound: int    # 0: any length
    sequence: bool
    bound: int           # of the sequence, 0: any length
    array: int = 0       # number of elements; 0: no array


@dataclass
class Struct(Annotated):
    scope: tuple         # ("takt_msgs", "msg")
    fields: list         # those of `base` first
    base: str = ""       # full name of the struct that this one extends

    @property
    def full_name(self):
        return "/".join(self.scope + (self.name,))

    @property
    def dds_type(self):
        return "::".join(self.scope) + "::dds_::" + self.name + "_"


@dataclass
class IdlFile:
    path: Path
    includes: list = field(default_factory=list)  # names of files
    structs: list = field(default_factory=list)
    enumerations: list = field(default_factory=list)


TOKEN = re.compile(r'[ \t\r]+|(?P<newline>\n)|(?P<comment>//[^\n]*)|(?P<include>\#include[ \t]+"[^"]*")|(?P<text>"(?:[^"\\\n]|\\.)*")|(?P<word>[A-Za-z_]\w*)|(?P<number>-?\d[\w.+-]*)|(?P<mark>::|.)')


class Tokens:
    """Words and marks. A comment belongs to what follows it; behind a declaration on its line, and on lines below that
    begin in the same column, to that declaration."""

    def __init__(self, path):
        self.path, self.items, self.place = path, [], 0
        line, line_begin, trailing_column, trailing_line, above, above_line = 1, 0, None, 0, [], 0
        code_on_line = False
        for match in TOKEN.finditer(path.read_text(encoding="utf-8")):
            kind, text, column = match.lastgroup, match.group(), match.start() - line_begin
            if kind == "newline":
                if not code_on_line and above_line != line and trailing_column is None:
                    above = []  # an empty line ends a comment
                if not code_on_line and trailing_column is not None and trailing_line != line:
                    trailing_column = None
                line, line_begin, code_on_line = line + 1, match.end(), False
            elif kind == "comment":
                words = text[2:].strip()
                if code_on_line or column == trailing_column:
                    self.items[-1][3].append(words)
                    trailing_column, trailing_line = column, line
                else:
                    above, above_line, trailing_column = above + [words], line, None
            elif kind is not None:
                self.items.append((kind, text, line, [], above))
                above, code_on_line = [], True
                trailing_column = None
        self.items.append(("end", "the end of the file", line, [], []))

    def now(self):
        return self.items[self.place][1]

    def line(self):
        return self.items[self.place][2]

    def above(self):
        return self.items[self.place][4]

    def behind(self):
        """Comment behind the token that was taken last."""
        return self.items[self.place - 1][3]

    def kind(self):
        return self.items[self.place][0]

    def fail(self, wanted):
        raise IdlError(f"{self.path}:{self.line()}: found {self.now()!r}; expected {wanted}")

    def take(self, kind=None, wanted=None):
        if kind is not None and self.kind() != kind:
            self.fail(wanted or f"a {kind}")
        text = self.now()
        self.place += 1
        return text

    def accept(self, text):
        if self.now() != text or self.kind() == "text":
            return False
        self.place += 1
        return True

    def expect(self, text):
        if not self.accept(text):
            self.fail(f"'{text}'")


def value_of(tokens):
    if tokens.kind() == "text":
        return re.sub(r"\\(.)", r"\1", tokens.take()[1:-1])
    if tokens.kind() in ("word", "number"):
        return tokens.take()
    return tokens.fail("a text in quotes, a number or a name")


def annotations_of(tokens):
    found = []
    while tokens.accept("@"):
        name, arguments = tokens.take("word", "the name of an annotation"), {}
        if tokens.accept("("):
            while not tokens.accept(")"):
                key = "value"
                if tokens.kind() == "word" and tokens.items[tokens.place + 1][1] == "=":
                    key = tokens.take()
                    tokens.expect("=")
                arguments[key] = value_of(tokens)
                while tokens.kind() == "text":  # "one long text " "in pieces"
                    arguments[key] += value_of(tokens)
                if tokens.now() != ")":
                    tokens.expect(",")
        found.append(Annotation(name, arguments))
    return found


def plain(name):
    """An underscore escapes names that are words of a language."""
    return name[1:] if name.startswith("_") else name


def number_of(tokens):
    text = tokens.take("number", "a number")
    if not text.isdigit():
        tokens.place -= 1
        tokens.fail("a whole number")
    return int(text)


class Reader:
    def __init__(self):
        self.files = {}       # name to IdlFile, in the order of reading
        self.structs = {}     # full name to Struct
        self.enumerations = {}

    def read(self, path):
        path = Path(path)
        if path.name in self.files:
            return
        tokens, file = Tokens(path), IdlFile(path)
        while tokens.kind() == "include":
            file.includes.append(tokens.take().split('"')[1])
            self.read(path.parent / file.includes[-1])
        self.files[path.name] = file
        self._definitions(tokens, file, ())
        if tokens.kind() != "end":
            tokens.fail("a module, a struct or an enum")

    def _definitions(self, tokens, file, scope):
        while tokens.kind() != "end" and tokens.now() != "}":
            doc, line = tokens.above(), tokens.line()
            notes = annotations_of(tokens)
            if tokens.accept("module"):
                inner = scope + (tokens.take("word", "the name of a module"),)
                tokens.expect("{")
                self._definitions(tokens, file, inner)
                tokens.expect("}")
                tokens.expect(";")
            elif tokens.accept("struct"):
                self._struct(tokens, file, scope, " ".join(doc), notes, line)
            elif tokens.accept("enum"):
                self._enumeration(tokens, file, scope, " ".join(doc), notes, line)
            else:
                tokens.fail("a module, a struct or an enum")

    def _struct(self, tokens, file, scope, doc, notes, line):
        struct = Struct(plain(tokens.take("word", "the name of a struct")), doc, notes, line, scope, [])
        if not struct.has("final"):
            raise IdlError(f"{file.path}:{line}: struct {struct.name} is not @final; all types of takt are")
        if tokens.accept(":"):
            struct.base = self._type(tokens, scope)[1]
            struct.fields += self.structs[struct.base].fields
        tokens.expect("{")
        while not tokens.accept("}"):
            struct.fields.append(self._field(tokens, file, scope))
        tokens.expect(";")
        names = [f.name for f in struct.fields]
        if (not names and scope[0] != "takt") or len(set(names)) != len(names):
            raise IdlError(f"{file.path}:{line}: struct {struct.name} has {'a field twice' if names else 'no field'}; "
                           "each message of DDS has at least one field, each name once")
        if struct.full_name in self.structs:
            raise IdlError(f"{file.path}:{line}: struct {struct.full_name} is defined twice; remove one of them")
        self.structs[struct.full_name] = struct
        file.structs.append(struct)

    def _field(self, tokens, file, scope):
        doc, line = list(tokens.above()), tokens.line()
        notes = annotations_of(tokens)
        sequence, bound = tokens.accept("sequence"), 0
        if sequence:
            tokens.expect("<")
        kind, type_name, string_bound = self._type(tokens, scope)
        if sequence:
            if tokens.accept(","):
                bound = number_of(tokens)
            tokens.expect(">")
            if kind == "boolean":
                tokens.fail("a sequence of another type: std::vector<bool> has no elements to refer to")
        name = plain(tokens.take("word", "the name of a field"))
        array = 0
        if not sequence and tokens.accept("["):
            array = number_of(tokens)
            tokens.expect("]")
        tokens.expect(";")
        made = Field(name, " ".join(doc + tokens.behind()), notes, line, kind, type_name, string_bound, sequence, bound, array)
        wanted = made.annotation("enumeration")
        if wanted and wanted not in self.enumerations:
            raise IdlError(f"{file.path}:{line}: there is no enumeration {wanted!r}; there are "
                           + ", ".join(sorted(self.enumerations)))
        return made

    def _type(self, tokens, scope):
        words = tokens.take("word", "a type")
        while words.split()[0] in ("unsigned", "long") and tokens.now() in ("long", "short"):
            words += " " + tokens.take()
        if words in PRIMITIVES:
            bound = 0
            if words == "string" and tokens.accept("<"):
                bound = number_of(tokens)
                tokens.expect(">")
            return PRIMITIVES[words][0], words, bound
        parts = [words]
        while tokens.accept("::"):
            parts.append(tokens.take("word", "a name"))
        parts[-1] = plain(parts[-1])
        name = "/".join(parts if len(parts) > 1 else list(scope) + parts)
        if name not in self.structs:
            tokens.place -= 1
            tokens.fail("a type that is defined above, or in an included file")
        return "message", name, 0

    def _enumeration(self, tokens, file, scope, doc, notes, line):
        made = Enumeration(tokens.take("word", "the name of an enumeration"), doc, notes, line, scope, [])
        tokens.expect("{")
        value = 0
        while not tokens.accept("}"):
            above, at = list(tokens.above()), tokens.line()
            of = annotations_of(tokens)
            name = tokens.take("word", "the name of an enumerator")
            one = Enumerator(name, "", of, at, value)
            value = one.value = int(one.annotation("value") or value)
            behind = list(tokens.behind())
            if tokens.now() != "}":
                tokens.expect(",")
                behind += tokens.behind()
            one.doc = " ".join(above + behind)
            made.enumerators.append(one)
            value += 1
        tokens.expect(";")
        if made.name in self.enumerations:
            raise IdlError(f"{file.path}:{line}: enumeration {made.name} is defined twice; remove one of them")
        self.enumerations[made.name] = made
        file.enumerations.append(made)


def member(name, kind, type_name, sequence=False):
    return Field(name, "", [], 0, kind, type_name, 0, sequence, 0)


def add_action_messages(reader):
    """The messages that rosidl makes of each action: of its services send_goal and get_result, and of its feedback."""
    goal_id = member("goal_id", "message", "unique_identifier_msgs/msg/UUID")
    for file in reader.files.values():
        for goal in [struct for struct in file.structs if struct.has("action")]:
            where = f"{file.path}:{goal.line}: action {goal.name}"
            if not goal.name.endswith("_Goal"):
                raise IdlError(f"{where} must be named ..._Goal")
            name = goal.full_name.removesuffix("_Goal")
            for part in ("Result", "Feedback"):
                if f"{name}_{part}" not in reader.structs:
                    raise IdlError(f"{where} has no struct {name}_{part}; add one")
            for suffix, fields in (
                    ("SendGoal_Request", [goal_id, member("goal", "message", goal.full_name)]),
                    ("SendGoal_Response", [member("accepted", "boolean", "boolean"),
                                           member("stamp", "message", "builtin_interfaces/msg/Time")]),
                    ("GetResult_Request", [goal_id]),
                    ("GetResult_Response", [member("status", "int8", "int8"),
                                            member("result", "message", f"{name}_Result")]),
                    ("FeedbackMessage", [goal_id, member("feedback", "message", f"{name}_Feedback")])):
                made = Struct(f"{goal.name.removesuffix('Goal')}{suffix}", "", [], goal.line, goal.scope, fields)
                reader.structs[made.full_name] = made
                file.structs.append(made)


def read(paths):
    """Reads the files and those they include. Throws IdlError."""
    reader = Reader()
    for path in paths:
        reader.read(path)
    add_action_messages(reader)
    return reader


def find_gaps(reader):
    """What the types of takt's own modules leave unsaid: a field without meaning, a number without unit, a unit of another
    spelling than that of scenario keys (server/fields/rules.h)."""
    for file in reader.files.values():
        for struct in file.structs:
            if struct.scope not in (("takt_msgs", "msg"), ("takt", "requests"), ("takt", "events"),
                                    ("takt", "player"), ("takt", "pendant"), ("takt_player", "msg")) or struct.has("quantity"):
                continue
            for one in struct.fields:
                where = f"{file.path}:{one.line}: {struct.name}.{one.name}"
                if not one.doc and not one.annotation("enumeration"):
                    yield f"{where} has no comment; say in one line what it means"
                if one.kind in ("float32", "float64") and not one.has("unit"):
                    yield f"{where} has no unit; add @unit(\"m\"), or @unit(\"1\") for a pure number"
                for wrong in re.findall(r"[A-Za-z]\d\S*", one.annotation("unit")):
                    yield f"{where} has the unit {one.annotation('unit')!r}; powers are written m^2, m/s^2, not {wrong}"
