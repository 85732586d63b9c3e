"""The runner of tutorials: what it takes for a step, and that it fails where a page is wrong."""
import argparse
import sys
import tempfile
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import tutorial  # noqa: E402

FILE = '```python title="a.py"\nprint("one  1.25 mm")\n```\n'
RUN = "```bash\npython3 a.py\n```\n"


class Tutorials(unittest.TestCase):
    def steps(self, text):
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder) / "page.md"
            page.write_text(text)
            return tutorial.steps_of(page)

    def follow(self, text):
        steps = self.steps(text)
        arguments = argparse.Namespace(bin=Path("/usr/bin"), config=Path("/tmp"), python=None, install=None, timeout=240)
        tutorial.follow(Path("page.md"), steps, arguments)

    def test_files_commands_and_expected_lines_are_steps_and_illustrations_are_not(self):
        steps = self.steps(FILE + RUN + "```text\none ... mm\n```\n```console\nros2 topic list\n```\n```yaml\na: 1\n```\n")
        self.assertEqual([(step.kind, step.name, step.expected) for step in steps],
                         [("file", "a.py", []), ("commands", "", ["one ... mm"])])

    def test_a_page_that_works_passes(self):
        self.follow(FILE + RUN + "```text\n...\none 1... mm\n```\n")

    def test_a_command_that_fails_is_reported_with_its_line(self):
        with self.assertRaisesRegex(tutorial.TutorialError, "page.md:4: this step failed with code 3"):
            self.follow('```bash title="x"\n\n```\n```bash\necho seen; exit 3\n```\n')

    def test_a_line_that_is_not_printed_is_reported(self):
        with self.assertRaisesRegex(tutorial.TutorialError, "the page promises this line:\none 1.26 mm"):
            self.follow(FILE + RUN + "```text\none 1.26 mm\n```\n")

    def test_lines_must_come_in_order(self):
        self.assertEqual(tutorial.missing_line(["b", "a"], "a\nb\n"), "a")
        self.assertIsNone(tutorial.missing_line(["a", "...", "b"], "a\nx\nb\n"))

    def test_expected_lines_without_commands_are_refused(self):
        with self.assertRaises(tutorial.TutorialError):
            self.steps("```text\na\n```\n")

    def test_a_background_job_does_not_outlive_its_page(self):
        with tempfile.TemporaryDirectory() as folder:
            self.follow(f"```bash\n(while :; do read -rt 0.05 <> <(:) || true; date >{folder}/alive; done) &\necho $! >{folder}/pid\n```\n")
            number = int((Path(folder) / "pid").read_text())
            end = time.monotonic() + 60
            while self.runs(number) and time.monotonic() < end:
                pass
            self.assertFalse(self.runs(number))

    def runs(self, number):
        try:
            return Path(f"/proc/{number}/stat").read_text().split(")")[1].split()[0] != "Z"
        except (FileNotFoundError, ProcessLookupError):
            return False


if __name__ == "__main__":
    unittest.main()
