"""The link checker of the site reports what is dead: a file, an anchor in another page, an anchor in the same page."""
import re
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs/site"))
import build  # noqa: E402
import links  # noqa: E402


class Links(unittest.TestCase):
    def check(self, **pages):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in pages.items():
                (Path(folder) / f"{name}.html").write_text(text)
            return links.check(folder)

    def test_links_to_files_and_anchors_that_exist_pass(self):
        faults, pages, checked = self.check(a='<a href="b.html#x">b</a><a href="#y">y</a><h1 id="y">y</h1>', b='<h1 id="x">x</h1>')
        self.assertEqual((faults, pages, checked), ([], 2, 2))

    def test_a_missing_file_is_reported_with_page_and_line(self):
        faults, _, _ = self.check(a='\n<img src="no.png">')
        self.assertEqual(len(faults), 1)
        self.assertTrue(faults[0].startswith("a.html:2: found the link 'no.png'"), faults[0])

    def test_a_missing_anchor_is_reported_in_the_same_page_and_in_another(self):
        faults, _, _ = self.check(a='<a href="#no">a</a><a href="b.html#no">b</a>', b="")
        self.assertEqual(len(faults), 2)

    def test_links_to_other_sites_are_left_alone(self):
        faults, _, checked = self.check(a='<a href="https://a.example/b#c">a</a>')
        self.assertEqual((faults, checked), ([], 0))


class Staging(unittest.TestCase):
    def test_a_link_to_a_file_outside_docs_leads_to_its_copy(self):
        with tempfile.TemporaryDirectory() as folder:
            pages = build.Pages(Path(folder))
            link = pages.link(build.DOCS / "scenes.md", 1, "../config/meshes/README.md#a")
            self.assertEqual(link, "source/config/meshes/README.md#a")
            self.assertTrue((Path(folder) / "source/config/meshes/README.md").exists())

    def test_a_link_to_a_missing_file_is_refused(self):
        with tempfile.TemporaryDirectory() as folder, self.assertRaisesRegex(build.SiteError, "scenes.md:7: found the link 'no.md'"):
            build.Pages(Path(folder)).link(build.DOCS / "scenes.md", 7, "no.md")


class Ways(unittest.TestCase):
    """A reader with one of these things finds the page within two clicks from the first page."""

    GOALS = {"a URDF of a robot": "cells.md", "a PLC": "tutorials/plc.md", "ROS 2": "tutorials/ros2.md",
             "a UR driver": "tutorials/ur_driver.md", "nothing yet": "tutorials/first_cell.md", "a symptom": "troubleshooting.md"}

    def clicks(self, start):
        """Clicks from a page to each page, by the links in the text."""
        distance, queue = {start: 0}, [start]
        for page in queue:
            text = re.sub(r"(?ms)^```.*?^```", "", page.read_text(encoding="utf-8"))
            for link in re.findall(r"\]\(([^)#\s]+\.md)", text):
                target = (page.parent / link).resolve()
                if target.exists() and target not in distance:
                    distance[target] = distance[page] + 1
                    queue.append(target)
        return distance

    def test_each_reader_finds_the_page_within_two_clicks(self):
        for start in (build.DOCS / "README.md", build.ROOT / "README.md"):
            distance = self.clicks(start)
            for reader, goal in self.GOALS.items():
                self.assertLessEqual(distance[build.DOCS / goal], 2, f"{reader}: {goal} from {start}")


if __name__ == "__main__":
    unittest.main()
