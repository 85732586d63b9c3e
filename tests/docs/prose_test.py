"""The prose that users read: words of tests/docs/words.txt in pages, in the help of programs, in events, requests and keys, in
the texts of programs and of the page (errors, notes, labels); numbers of decisions that pages and code cite; the words of all hand-written pages together. Usage: prose_test.py [--bin DIR]"""
import argparse
import re
import sys
import tempfile
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT / "docs/site"))
import references  # noqa: E402

GENERATED = {f"docs/{name}.md" for name in ("requests", "events", "topics", "scenes", "scenario_reference", "signals", "lua", "urscript")}
MOST_WORDS = 29_000  # of all hand-written pages; a subject that is added has to replace words elsewhere
SOURCES = ("server", "client_lib", "idl", "plant_models")
LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
LITERAL_OF_PAGE = re.compile(r"""(["'`])((?:(?!\1)[^\\\n]|\\.)*)\1""")
CITED = re.compile(r"[Dd]ecisions? (\d+)")
programs = None


def pages():
    return sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])


def rules():
    for line in (HERE / "words.txt").read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            pattern, remedy = line.split("\t")
            yield re.compile(pattern), remedy


def faults(name, text):
    """One sentence for each forbidden word outside of code blocks and code spans."""
    found, code = [], False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            code = not code
        if code:
            continue
        prose = re.sub(r"`[^`]*`", "`", line)
        for pattern, remedy in rules():
            if match := pattern.search(prose):
                found.append(f"{name}:{number}: found '{match[0].strip()}'; better: {remedy}")
    return found


def texts(file):
    """String literals of a source that have several words; adjacent ones are one text."""
    text = re.sub(r"^\s*(//|#include).*$", "", file.read_text(encoding="utf-8"), flags=re.MULTILINE)
    if file.suffix == ".js":
        found = (match[2] for match in LITERAL_OF_PAGE.finditer(text))
    else:
        found = (match[1] for match in LITERAL.finditer(re.sub(r'(?<!\\)"\s*\n\s*"', "", text)))
    return [one for one in found if " " in one]


class Prose(unittest.TestCase):
    def test_pages_have_none_of_the_words(self):
        found = []
        for page in pages():
            if page.name != "writing.md":  # which shows bad sentences
                found += faults(page.relative_to(ROOT), page.read_text(encoding="utf-8"))
        self.assertEqual(found, [], "\n" + "\n".join(found))

    def test_help_has_none_of_the_words(self):
        found = [] if programs is None else faults("help", references.command_lines(programs).replace("```", ""))
        self.assertEqual(found, [], "\n" + "\n".join(found))

    def test_texts_of_programs_and_page_have_none_of_the_words(self):
        found, count = [], 0
        for folder in SOURCES:
            for file in (ROOT / folder).rglob("*"):
                if file.suffix in (".cpp", ".h", ".js", ".html") and not {"node_modules", "standard"} & set(file.parts):
                    for one in texts(file):
                        count += 1
                        found += faults(file.relative_to(ROOT), one.replace("\\n", " "))
        self.assertEqual(found, [], "\n" + "\n".join(found))
        self.assertGreater(count, 5000)

    def test_generated_pages_are_those_of_their_sources(self):
        for name, text in (("topics", references.topics(ROOT / "idl")), ("scenes", references.scenes(ROOT))):
            self.assertEqual((ROOT / f"docs/{name}.md").read_text(encoding="utf-8"), text,
                             f"docs/{name}.md is renewed by: python3 -B docs/site/references.py")

    def test_the_head_of_a_scenario_becomes_text_and_commands(self):
        text = "# yaml-language-server: x\n# A b_c.\n#   run x\n#\n# Last.\ntakt_scenario: 1\n# not this\n"
        self.assertEqual(references.head(text), "A b\\_c.\n\n    run x\n\nLast.")

    def test_a_forbidden_word_is_found_and_code_is_passed_over(self):
        with tempfile.TemporaryDirectory() as folder:
            source, page = Path(folder) / "a.cpp", Path(folder) / "a.js"
            source.write_text('f("the error"\n  " is told");  // is told\n')
            page.write_text("tell(`is ${told} of before`);\n")
            self.assertEqual(texts(source), ["the error is told"])
            self.assertEqual(texts(page), ["is ${told} of before"])
        self.assertEqual(len(faults("x", "The error is told.\n`told`\n```\ntold\n```\nWho asks twice waits.")), 2)

    def test_cited_decisions_exist(self):
        text = (ROOT / "docs/decisions.md").read_text(encoding="utf-8")
        known = set(re.findall(r"^\*\*(\d+)\. ", text, re.MULTILINE))
        missing = []
        for folder in ("docs", "server", "client_lib", "idl", "plant_models", "config", "tests"):
            for file in (ROOT / folder).rglob("*"):
                if file.suffix in (".md", ".h", ".cpp", ".idl", ".yaml", ".lua", ".py") and "node_modules" not in file.parts:
                    cited = set(CITED.findall(file.read_text(encoding="utf-8", errors="replace")))
                    missing += [f"{file.relative_to(ROOT)}: decision {number}" for number in cited - known]
        self.assertEqual(missing, [])

    def test_records_of_decisions_are_short(self):
        text = (ROOT / "docs/decisions.md").read_text(encoding="utf-8")
        long = [record.split(".")[0] for record in re.split(r"\n\n\*\*", text)[1:] if len(record.split()) > 75]
        self.assertEqual(long, [])

    def test_all_pages_together_stay_within_their_limit(self):
        words = {page: len(page.read_text(encoding="utf-8").split()) for page in pages()
                 if str(page.relative_to(ROOT)) not in GENERATED}
        print(f"{sum(words.values())} words in {len(words)} hand-written pages")
        self.assertLessEqual(sum(words.values()), MOST_WORDS)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=Path)
    known, rest = parser.parse_known_args()
    programs = known.bin
    unittest.main(argv=[sys.argv[0], *rest])
