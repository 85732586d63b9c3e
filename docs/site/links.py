"""Checks the links of a folder of HTML pages: the file of each link and the anchor in it exist. Nothing is fetched."""
import os
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ATTRIBUTES = {"a": "href", "link": "href", "img": "src", "script": "src", "iframe": "src"}


class Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.anchors, self.links = {"", "top"}, []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.anchors.update(value for key in ("id", "name") if (value := values.get(key)))
        if tag in ATTRIBUTES and values.get(ATTRIBUTES[tag]):
            self.links.append((self.getpos()[0], values[ATTRIBUTES[tag]]))


def check(site):
    """Faults as sentences, the number of pages and of links inside the site. Pages of Doxygen count as targets only:
    their links are Doxygen's own."""
    pages = {}

    def page(file):
        if file not in pages:
            pages[file] = Page(file.read_text(encoding="utf-8"))
        return pages[file]

    faults, checked, read = [], 0, 0
    for file in sorted(Path(site).rglob("*.html")):
        name = file.relative_to(site)
        if name.parts[0] == "cpp" or name.name == "404.html":
            continue
        read += 1
        for line, link in page(file).links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            checked += 1
            path = unquote(parts.path)
            target = Path(os.path.normpath(file.parent / path)) if path else file
            if target.is_dir():
                target /= "index.html"
            if not target.is_file():
                faults.append(f"{name}:{line}: found the link '{link}'; there is no such file in the site")
            elif target.suffix == ".html" and parts.fragment and unquote(parts.fragment) not in page(target).anchors:
                faults.append(f"{name}:{line}: found the link '{link}'; there is no such anchor in that page")
    return faults, read, checked
