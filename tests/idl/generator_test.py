"""The reader of IDL files: what it takes over, and what it says of a mistake."""
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "idl" / "generator"))
import cpp  # noqa: E402
import events  # noqa: E402
import idl  # noqa: E402
import permissions  # noqa: E402
import requests  # noqa: E402


def read(text, **others):
    with tempfile.TemporaryDirectory() as directory:
        for name, content in others.items():
            (Path(directory) / f"{name}.idl").write_text(content)
        path = Path(directory) / "own.idl"
        path.write_text(text)
        try:
            return idl.read([path])
        except idl.IdlError as error:
            raise idl.IdlError(str(error).replace(directory + "/", "")) from None


def in_module(text):
    return f"module a {{\nmodule msg {{\n{text}\n}};\n}};\n"


class Reading(unittest.TestCase):
    def test_types_bounds_and_escaped_names(self):
        reader = read('#include "other.idl"\n' + in_module(
            "@final struct T { sequence<string<4>, 2> tags; unsigned long long id; b::msg::Time t; T2 own; double _pose; };"
        ).replace("@final struct T ", "@final struct T2 { octet x; };\n@final struct T "),
            other="module b { module msg { @final struct Time { long sec; }; }; };")
        fields = {f.name: f for f in reader.structs["a/msg/T"].fields}
        self.assertEqual(list(fields), ["tags", "id", "t", "own", "pose"])
        tags = fields["tags"]
        self.assertEqual((tags.kind, tags.string_bound, tags.sequence, tags.bound), ("string", 4, True, 2))
        self.assertEqual(fields["id"].kind, "uint64")
        self.assertEqual(fields["t"].type, "b/msg/Time")
        self.assertEqual(fields["own"].type, "a/msg/T2")
        self.assertEqual(reader.structs["a/msg/T"].dds_type, "a::msg::dds_::T_")
        self.assertEqual(cpp.cpp_type(tags), "std::vector<std::string>")

    def test_an_array_is_its_elements_on_the_wire(self):
        reader = read(in_module("@final struct T { octet id[3]; long last; };"))
        array = reader.structs["a/msg/T"].fields[0]
        self.assertEqual(array.array, 3)
        self.assertEqual(cpp.cpp_type(array), "std::array<std::uint8_t, 3>")
        self.assertEqual([value for _, _, value in cpp.table_rows(reader.structs["a/msg/T"])],
                         ["id[0]", "id[1]", "id[2]", "last"])

    ACTION = """module unique_identifier_msgs { module msg { @final struct UUID { octet uuid[16]; }; }; };
module builtin_interfaces { module msg { @final struct Time { long sec; unsigned long nanosec; }; }; };
module a { module action {
@final @action(id="go", name="{cell}/go") struct Go_Goal { double x; };
@final struct Go_Result { double y; };
%s
}; };
"""

    def test_an_action_has_the_messages_of_its_services_and_topics(self):
        reader = read(self.ACTION % "@final struct Go_Feedback { double z; };")
        fields = {name: [field.name for field in reader.structs[f"a/action/Go_{name}"].fields]
                  for name in ("SendGoal_Request", "SendGoal_Response", "GetResult_Request", "GetResult_Response",
                               "FeedbackMessage")}
        self.assertEqual(fields, {"SendGoal_Request": ["goal_id", "goal"], "SendGoal_Response": ["accepted", "stamp"],
                                  "GetResult_Request": ["goal_id"], "GetResult_Response": ["status", "result"],
                                  "FeedbackMessage": ["goal_id", "feedback"]})
        with self.assertRaisesRegex(idl.IdlError, "own.idl:4: action Go_Goal has no struct a/action/Go_Feedback; add one"):
            read(self.ACTION % "")

    def test_comments_belong_to_what_they_stand_at(self):
        reader = read(in_module("""
// Of nothing.

// A struct
// of two lines.
@final struct T {
  double x;   // behind x,
              // and on
  // above y
  double y;
  double z;
};"""))
        struct = reader.structs["a/msg/T"]
        self.assertEqual(struct.doc, "A struct of two lines.")
        self.assertEqual([f.doc for f in struct.fields], ["behind x, and on", "above y", ""])

    def test_annotations_are_carried_with_all_their_arguments(self):
        reader = read(in_module(
            '@final @request(name="step", phase=now, order=-3) @event(sentence="Part {part} (%) "\n  "is \\"free\\".") '
            '@bare struct T { @unit("N m") @range(min=1, max=2.5) double x; };'))
        struct = reader.structs["a/msg/T"]
        self.assertEqual(struct.annotation("request", "name"), "step")
        self.assertEqual(struct.annotation("request", "phase"), "now")
        self.assertEqual(struct.annotation("request", "order"), "-3")
        self.assertEqual(struct.annotation("event", "sentence"), 'Part {part} (%) is "free".')
        self.assertTrue(struct.has("bare"))
        self.assertEqual(struct.fields[0].annotation("unit"), "N m")
        self.assertEqual(struct.fields[0].annotation("range", "max"), "2.5")
        table = cpp.table(struct, reader)
        self.assertIn('{"event", "sentence", "Part {part} (%) is \\"free\\"."}', table)
        self.assertIn('{"bare", "", ""}', table)

    def test_enumerations_count_on_from_given_values(self):
        reader = read("module takt {\n// Which.\nenum E {\n  a,   // first\n  @value(7) b,\n  c    // last\n};\n};\n" + in_module(
            "@final struct T { @enumeration(E) @default(c) octet e; };"))
        one = reader.enumerations["E"]
        self.assertEqual([(e.name, e.value, e.doc) for e in one.enumerators], [("a", 0, "first"), ("b", 7, ""), ("c", 8, "last")])
        self.assertEqual(one.doc, "Which.")
        field = reader.structs["a/msg/T"].fields[0]
        self.assertEqual(cpp.cpp_type(field) + cpp.initial(field), "takt::E = takt::E::c")


class Mistakes(unittest.TestCase):
    def expect(self, text, sentence):
        with self.assertRaises(idl.IdlError) as raised:
            read(text)
        self.assertIn(sentence, str(raised.exception))

    def test_are_reported_with_line_and_what_is_expected(self):
        for field, sentence in (
                ("string<x> s;", "own.idl:3: found 'x'; expected a number"),
                ("string<-1> s;", "own.idl:3: found '-1'; expected a whole number"),
                ("double x", "own.idl:3: found '}'; expected ';'"),
                ("Nothing x;", "expected a type that is defined above"),
                ("@enumeration(E) octet x;", "own.idl:3: there is no enumeration 'E'"),
                ("sequence<boolean> x;", "std::vector<bool>"),
                ("double x; long x;", "a field twice"),
                ("", "no field")):
            with self.subTest(field):
                self.expect(in_module(f"@final struct T {{ {field} }};"), sentence)

    def test_of_structs_and_files(self):
        self.expect(in_module("struct T { double x; };"), "own.idl:3: struct T is not @final")
        self.expect(in_module("@final struct T { double x; };\n@final struct T { double x; };"), "own.idl:4: struct a/msg/T is defined twice")
        self.expect(in_module("union U { };"), "own.idl:3: found 'union'; expected a module, a struct or an enum")
        self.expect("module a {", "found 'the end of the file'; expected '}'")

    def test_a_field_of_takt_needs_meaning_and_unit(self):
        text = "module takt_msgs { module msg {\n@final struct T {\n  double x;\n  @unit(\"m\") double y;  // yes\n};\n}; };\n"
        gaps = [gap.split("own.idl")[1] for gap in idl.find_gaps(read(text))]
        self.assertEqual(gaps, [":3: T.x has no comment; say in one line what it means",
                                ':3: T.x has no unit; add @unit("m"), or @unit("1") for a pure number'])


ROOT = Path(__file__).resolve().parents[2]
ENUMERATIONS = """
module takt {
enum Severity { information, warning };
@bit_bound(32) enum ControlResult { unsupported, ok, not_found, incorrect_state, failed, @value(101) taken, @value(101) gone };
"""


class Vocabulary(unittest.TestCase):
    def table(self, kind, text, module):
        return kind.of(read(f"{ENUMERATIONS}module {module} {{\n{text}\n}};\n}};\n"))

    def test_a_request_has_the_name_of_its_struct_and_a_response(self):
        request, = self.table(requests, """
// Does it.
@final @request(phase="loop", results="not_found, taken", changes="bits", renews="state") struct DoIt {};
@final struct DoItResponse {};""", "requests")
        self.assertEqual((request.name, request.phase, request.changes, request.renews),
                         ("do_it", "loop", "bits", ["state"]))
        self.assertEqual([code.value for code in request.codes], [1, 4, 2, 101])

    def test_a_request_of_the_player_is_none_of_the_server(self):
        text = """// Does it.
@final @request(phase="at_once", of="player") struct DoIt {};
@final struct DoItResponse {};"""
        self.assertEqual(self.table(requests, text, "player"), [])
        reader = read(f"{ENUMERATIONS}module player {{\n{text}\n}};\n}};\n")
        self.assertEqual([one.name for one in requests.of(reader, "player")], ["do_it"])

    def test_mistakes_in_a_request_are_named_with_what_is_allowed(self):
        for words, text in (
                ("has an argument timeout, which the calls of Python have already",
                 '@final @request(phase="loop") struct DoIt { double timeout; };'),
                ("has no struct DoItResponse", '@final @request(phase="loop") struct DoIt {};'),
                ("allowed are the phases at_once, loop", '@final @request(phase="later") struct DoIt {};'),
                ("has result 'lost'; ControlResult has unsupported", '@final @request(phase="loop", results="lost") struct DoIt {};'),
                ("two results of one number", '@final @request(phase="loop", results="taken, gone") struct DoIt {};'),
                ("allowed are phase, results", '@final @request(phase="loop", resluts="taken") struct DoIt {};')):
            with self.assertRaises(idl.IdlError) as caught:
                self.table(requests, text, "requests")
            self.assertIn(words, str(caught.exception))

    def test_an_event_says_its_fields_and_does_not_allocate_in_the_loop(self):
        event, = self.table(events, '@final @event(of="loop", severity="warning", says="{part}{?n: {n}}") '
                            'struct GoneBad { @fixed string<8> part; long n; };', "events")
        self.assertEqual((event.code, event.of_loop), ("gone_bad", True))
        for words, text in (
                ("speaks of {parts}; it has part", 'severity="warning", says="{parts}") struct E { string part; };'),
                ("allowed are information, warning", 'severity="bad", says="x") struct E {};'),
                ("says nothing", 'severity="warning") struct E {};'),
                ("allocates in the step loop", 'of="loop", severity="warning", says="x") struct E { string part; };')):
            with self.assertRaises(idl.IdlError) as caught:
                self.table(events, "@final @event(" + text, "events")
            self.assertIn(words, str(caught.exception))

    def test_the_pages_are_those_of_the_idl(self):
        reader = idl.read([ROOT / "idl" / f"takt_{name}.idl" for name in ("player", "pendant", "events")])
        for name, text in (("requests", requests.page(reader)), ("events", events.page(reader))):
            page = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
            self.assertTrue(page == text, f"docs/{name}.md differs from the IDL: ./dev docs writes it")

    def test_the_permissions_are_those_of_the_idl(self):
        reader = idl.read([ROOT / "idl" / f"{name}_msgs.idl" for name in ("takt", "ros2")])
        for name, text in permissions.documents(reader).items():
            file = ROOT / "config" / "dds" / "security" / name
            self.assertTrue(file.read_text(encoding="utf-8") == text, f"{file} differs from the IDL: ./dev docs writes it")

    def test_a_controller_may_write_each_topic_of_clients_once(self):
        reader = read(in_module(
            '@final @topic(id="a", name="{cell}/{robot}/go", by="client", qos="command")\n'
            '@topic(id="b", name="{cell}/{device}/go", by="client", qos="command") struct A { octet x; };\n'
            '@final @topic(id="c", name="{cell}/state", by="server", qos="instant") struct B { octet x; };'))
        self.assertEqual(permissions.written_by_clients(reader), ["rt/*/go", "rq/*"])


if __name__ == "__main__":
    unittest.main()
