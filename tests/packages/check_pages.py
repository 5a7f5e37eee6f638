#!/usr/bin/python3
"""Do the pages refer to existing names?

    check_pages.py --source .

Classes, functions and headers in backticks on the pages on theory and code must be in the sources.
"""

import argparse
import re
import sys
import unittest
from pathlib import Path

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--source", type=Path, required=True)
OPTIONS = parser.parse_args()

GUIDE = OPTIONS.source / "examples/guide"
OF_OTHERS = {"MobilizedBody", "State"}  # of Simbody


def read_sources():
    files = [file for top in ("plugin", "forces", "render", "tests", "examples")
             for file in (OPTIONS.source / top).rglob("*") if file.suffix in (".h", ".cpp", ".in", ".sh")]
    words = set()
    for file in files:
        words.update(re.findall(r"\w+", file.read_text(encoding="utf-8")))
        words.add(file.stem)
    return words


def list_names(page):
    """Classes, functions and headers in backticks, outside blocks of code."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    for name in re.findall(r"`([^`\n]+)`", text):
        if re.fullmatch(r"(\w+::)*\w+\(\)|[A-Z]\w*[a-z]\w*(::\w+)*", name):
            yield from (word for word in re.findall(r"\w+", name) if word not in OF_OTHERS)
        elif re.fullmatch(r"simflex/[\w/]+\.h", name):
            yield Path(name).stem


class Pages(unittest.TestCase):
    def test_names_are_in_the_sources(self):
        words, count = read_sources(), 0
        for page in ("theory.md", "how_it_is_built.md"):
            for name in list_names(GUIDE / page):
                count += 1
                self.assertTrue(name in words, f"{page}: {name}")
        self.assertGreater(count, 100)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
