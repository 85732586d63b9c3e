"""Builds the site of the documentation: stages the pages, makes the generated references, runs MkDocs in strict mode
and checks every link and anchor of the result.

Usage: build.py OUTPUT [--bin DIRECTORY] [--python DIRECTORY]
OUTPUT receives pages/ (what MkDocs reads) and site/ (the result). --bin has takt's programs for the reference of command
lines; --python has the Python package. Without them these two pages say how to make them. Exit code 1 after a fault."""
import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import links
import references

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
KATEX = Path("/usr/share/javascript/katex")
LINK = re.compile(r"(\]\(|<img src=\")([^)\s\"]+)")
EXTERNAL = re.compile(r"^[a-z]+:|^#")
FORMULAS = """document$.subscribe(() => renderMathInElement(document.body, {
  delimiters: [{left: "\\\\(", right: "\\\\)", display: false}, {left: "\\\\[", right: "\\\\]", display: true}]}));
"""
# Index and worker of the theme's search, for pages that are opened as files: of a folder browsers load no worker. The theme
# gives its worker one message at a time and keeps only the latest of those that wait: words that are typed before the
# answer to its first, empty query would displace the index, and the search would find nothing until the page is loaded
# again. Queries ahead of the index are answered here.
SEARCH_OF_FILES = """var __index = %s;
var __search = {index: Promise.resolve(__index)};
{
  const SETUP = 0, QUERY = 2, RESULT = 3;
  const source = new Blob([%s], {type: "text/javascript"});
  class SearchWorker extends Worker {
    prepared = false;
    constructor() { super(URL.createObjectURL(source)); }
    postMessage(message) {
      this.prepared ||= message.type === SETUP;
      if (this.prepared || message.type !== QUERY) return super.postMessage(message);
      queueMicrotask(() => this.dispatchEvent(new MessageEvent("message", {data: {type: RESULT, data: {items: []}}})));
    }
  }
  window.Worker = new Proxy(Worker, {
    construct: (Stock, [url, ...options]) => /\\/workers\\/search\\./.test(url) ? new SearchWorker() : new Stock(url, ...options),
  });
}
"""


class SiteError(Exception):
    pass


class Pages:
    """The folder that MkDocs reads. A file outside docs/ that a page links to goes to source/."""

    def __init__(self, folder):
        self.folder = folder
        self.staged = {}

    def place(self, file):
        """Path of a file of the repository in the folder of pages."""
        return file.relative_to(DOCS) if file.is_relative_to(DOCS) else Path("source") / file.relative_to(ROOT)

    def add(self, file):
        if file in self.staged:
            return
        place = self.staged[file] = self.place(file)
        target = self.folder / place
        target.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix == ".md":
            target.write_text(self.relinked(file), encoding="utf-8")
        else:
            shutil.copyfile(file, target)

    def relinked(self, file):
        lines, code = [], False
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(keepends=True), 1):
            if line.lstrip().startswith("```"):
                code = not code
            if not code:
                line = LINK.sub(lambda match: match[1] + self.link(file, number, match[2]), line)
            lines.append(line)
        return "".join(lines)

    def link(self, file, number, target):
        if EXTERNAL.match(target):
            return target
        path, mark, anchor = target.partition("#")
        linked = Path(os.path.normpath(file.parent / path))
        if not linked.is_relative_to(ROOT) or not linked.exists():
            raise SiteError(f"{file.relative_to(ROOT)}:{number}: found the link '{target}'; allowed: an existing file of "
                            "the repository")
        if linked.is_dir():
            raise SiteError(f"{file.relative_to(ROOT)}:{number}: found a link to the folder '{target}'; allowed: a file")
        self.add(linked)
        return os.path.relpath(self.place(linked), self.place(file).parent) + mark + anchor


def stage(output):
    pages = output / "pages"
    shutil.rmtree(pages, ignore_errors=True)
    staged = Pages(pages)
    for file in sorted(DOCS.rglob("*.md")):
        staged.add(file)
    staged.add(ROOT / "README.md")
    for name in re.findall(r"source/(\S+\.md)", (DOCS / "site/mkdocs.yml").read_text(encoding="utf-8")):
        staged.add(ROOT / name)
    assets = pages / "assets"
    (assets / "katex").mkdir(parents=True, exist_ok=True)
    if KATEX.is_dir():
        for name in ("katex.min.css", "katex.min.js", "contrib/auto-render.js"):
            shutil.copyfile(KATEX / name, assets / "katex" / Path(name).name)
        shutil.copytree(KATEX / "fonts", assets / "katex/fonts")
        (assets / "formulas.js").write_text(FORMULAS, encoding="utf-8")
    else:
        raise SiteError(f"there is no {KATEX}; install the Debian package libjs-katex")


def run(command, folder, name):
    result = subprocess.run(command, cwd=folder, text=True, capture_output=True)
    if result.returncode != 0:
        raise SiteError(f"{name} failed:\n{result.stdout}{result.stderr}")
    return result.stdout + result.stderr


def doxygen(output):
    """The C++ API. Warnings are faults: a public name without documentation, an unknown parameter."""
    text = (DOCS / "site/Doxyfile").read_text(encoding="utf-8")
    (output / "Doxyfile").write_text(f"{text}\nOUTPUT_DIRECTORY = {output}/cpp\n", encoding="utf-8")
    shutil.rmtree(output / "cpp", ignore_errors=True)
    (output / "cpp").mkdir()
    run(["doxygen", str(output / "Doxyfile")], ROOT, "doxygen")
    shutil.copytree(output / "cpp/html", output / "pages/cpp")


def search_of_files(site):
    """Writes search/search_of_files.js, which docs/site/theme/main.html loads. Newer versions of the theme (9.6) load
    search/search_index.js as well."""
    worker, = (site / "assets/javascripts/workers").glob("search.*.js")
    index = json.loads((site / "search/search_index.json").read_text(encoding="utf-8"))
    text = SEARCH_OF_FILES % (json.dumps(index), json.dumps(worker.read_text(encoding="utf-8")))
    (site / "search/search_of_files.js").write_text(text, encoding="utf-8")
    (site / "search/search_index.js").write_text("// search_of_files.js has __index.\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("output", type=Path)
    parser.add_argument("--bin", type=Path)
    parser.add_argument("--python", type=Path)
    arguments = parser.parse_args()
    output = arguments.output.resolve()
    try:
        stage(output)
        references.write(output / "pages/reference", arguments.bin, arguments.python)
        doxygen(output)
        shutil.copyfile(DOCS / "site/mkdocs.yml", output / "mkdocs.yml")
        shutil.copytree(DOCS / "site/theme", output / "theme", dirs_exist_ok=True)
        run(["mkdocs", "build", "--quiet", "--strict", "--clean"], output, "mkdocs")
        search_of_files(output / "site")
        faults, pages, checked = links.check(output / "site")
    except (SiteError, references.ReferenceError) as error:
        sys.exit(f"site: {error}")
    for fault in faults:
        print(fault)
    print(f"site: {output / 'site/index.html'}: {pages} pages, {checked} links, {len(faults)} dead")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
