#!/usr/bin/env python3
"""Runs the examples of a page of the guide, in order, in an empty folder.

The info string of a fenced block determines how it is checked:
  sh                  run by bash; must succeed
  sh fails            must fail
  sh by-hand          not run: needs more than tests have (root, a cluster, a terminal)
  FORMAT file=NAME    written to NAME; under examples/ a quotation, which that file must contain, and
                      the file is copied here
  yaml                part of a model file: must agree with the schema
  python              run
  python continued    run after the Python before it
  python by-hand      not run
  cpp                 a whole program of README.md, which tests/consumer compiles
  text output         output of the preceding command: '…' stands for anything, numbers may differ by 2 %
  text message        a message of simflex, '…' for what varies: must be in the sources
  text, math          not checked
Linked files must exist.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import jsonschema
import yaml

NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


class Yaml12(yaml.SafeLoader):
    """`on` is a key, not true."""


Yaml12.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:bool" or first in "tTfF"]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()}


class Block:
    def __init__(self, line, info, text):
        words = info.split()
        self.line, self.text = line, text
        self.language = words[0] if words else ""
        self.words = set(words[1:])
        self.file = next((word[5:] for word in words[1:] if word.startswith("file=")), None)


def read_blocks(page):
    blocks, fence, start = [], None, 0
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if fence is None and line.startswith("```"):
            fence, start, content = line[3:], number, []
        elif fence is not None and line.startswith("```"):
            blocks.append(Block(start, fence, "".join(content)))
            fence = None
        elif fence is not None:
            content.append(line + "\n")
    if fence is not None:
        raise SystemExit(f"{page.name}:{start}: the block does not end")
    return blocks


def same_line(expected, found):
    """Compares word for word; numbers may differ by 2 %, and … matches anything."""
    pattern, numbers = "", []
    for piece in re.split(r"(…)", " ".join(expected.split())):
        if piece == "…":
            pattern += ".*?"
            continue
        last = 0
        for match in NUMBER.finditer(piece):
            pattern += re.escape(piece[last:match.start()]) + "(" + NUMBER.pattern + ")"
            numbers.append(float(match.group()))
            last = match.end()
        pattern += re.escape(piece[last:])
    match = re.fullmatch(pattern, " ".join(found.split()))
    return match is not None and all(
        abs(float(text) - number) <= 0.02 * abs(number) for text, number in zip(match.groups(), numbers))


def find_missing_line(expected, output):
    """Returns the first expected line that does not follow in this order, with any lines in between; None if all do."""
    lines = iter(re.split(r"[\n\r]", output))
    for line in expected.splitlines():
        if line.strip() and line.strip() != "…" and not any(same_line(line, found) for found in lines):
            return line
    return None


def read_messages(source):
    """Strings of each source file, with adjacent literals joined."""
    messages = []
    for room in ("plugin", "forces", "render"):
        for file in sorted((source / room).rglob("*.cpp")) + sorted((source / room).rglob("*.h")):
            text = re.sub(r'"\s*\n\s*"', "", file.read_text())
            messages.append(" ".join(re.findall(r'"((?:[^"\\\n]|\\.)*)"', text)).replace('\\"', '"'))
    return messages


class Page:
    def __init__(self, arguments):
        self.path, self.work, self.source = arguments.page, arguments.work, arguments.source
        self.failures, self.output = [], ""
        self.environment = dict(os.environ, COLUMNS="100", OMPI_ALLOW_RUN_AS_ROOT="1",
                                OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", XDG_CACHE_HOME=str(self.work / "cache"),
                                PATH=f"{arguments.bin}:{os.environ['PATH']}")
        self.environment.pop("SIMFLEX_CACHE", None)
        shutil.rmtree(self.work, ignore_errors=True)
        self.work.mkdir(parents=True)
        (self.work / "examples").symlink_to(self.source / "examples")  # as in the pages
        self.schema = self.messages = None
        self.program = ""

    def fail(self, block, what):
        self.failures.append(f"{self.path}:{block.line}: {what}")

    def run(self, block, command):
        result = subprocess.run(command, cwd=self.work, env=self.environment, text=True, stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        self.output = result.stdout
        if (result.returncode != 0) != ("fails" in block.words):
            self.fail(block, f"exit status {result.returncode}; output:\n{result.stdout}")
            return False
        return True

    def check(self, block):
        if block.file and block.file.startswith("examples/"):
            if block.text.strip() not in (self.source / block.file).read_text():
                self.fail(block, f"{block.file} does not contain this")
            shutil.copy(self.source / block.file, self.work)
        elif block.file:
            (self.work / block.file).parent.mkdir(parents=True, exist_ok=True)
            (self.work / block.file).write_text(block.text)
        elif block.language == "sh":
            return "by-hand" in block.words or self.run(block, ["bash", "-e", "-o", "pipefail", "-c", block.text])
        elif block.language == "python":
            if "by-hand" in block.words:
                return True
            self.program = (self.program if "continued" in block.words else "") + block.text
            return self.run(block, ["/usr/bin/python3", "-c", self.program])
        elif block.language == "yaml":
            self.check_part(block)
        elif block.language == "text" and "output" in block.words:
            missing = find_missing_line(block.text, self.output)
            if missing is not None:
                self.fail(block, f"no such line: {missing}\nin:\n{self.output}")
        elif block.language == "text" and "message" in block.words:
            self.check_message(block)
        elif block.language not in ("text", "math", "cpp") or block.words:
            self.fail(block, f"what kind of block is '{block.language} {' '.join(block.words)}'?")
        return True

    def check_part(self, block):
        if self.schema is None:
            text = subprocess.run(["simflex", "schema"], env=self.environment, capture_output=True, text=True,
                                  check=True).stdout
            self.schema = json.loads(text)
            self.schema.pop("required", None)
        try:
            jsonschema.validate(yaml.load(block.text, Yaml12), self.schema)
        except jsonschema.ValidationError as error:
            self.fail(block, f"{'.'.join(map(str, error.absolute_path))}: {error.message}")
        except yaml.YAMLError as error:
            self.fail(block, str(error))

    def check_message(self, block):
        self.messages = self.messages or read_messages(self.source)
        for message in block.text.strip().split("\n\n"):
            pieces = [" ".join(piece.split()) for piece in message.split("…")]
            pieces = [piece for piece in pieces if len(piece) > 2]
            if not pieces or not any(all(piece in text for piece in pieces) for text in self.messages):
                self.fail(block, f"no source has this message: {message}")

    def check_links(self):
        text = re.sub(r"^```.*?^```", "", self.path.read_text(), flags=re.S | re.M)
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            file, _, anchor = target.partition("#")
            if "://" in target:
                continue
            path = self.path.parent / file if file else self.path
            if not path.exists():
                self.failures.append(f"{self.path}: leads nowhere: {target}")
            elif anchor and anchor not in read_anchors(path):
                self.failures.append(f"{self.path}: no such heading: {target}")


def read_anchors(path):
    text = re.sub(r"^```.*?^```", "", path.read_text(), flags=re.S | re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")
            for heading in re.findall(r"^#+ +(.*)$", text, flags=re.M)}


def absolute(path):
    return Path(path).absolute()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", type=absolute, required=True)
    parser.add_argument("--bin", type=absolute, required=True, help="folder of the program simflex")
    parser.add_argument("--source", type=absolute, required=True, help="root of the source tree")
    parser.add_argument("--work", type=absolute, required=True, help="folder to run in; emptied first")
    page = Page(parser.parse_args())
    page.check_links()
    for block in read_blocks(page.path):
        if not page.check(block):
            break  # later blocks would fail, too
    print("\n".join(page.failures))
    return 1 if page.failures else 0


if __name__ == "__main__":
    sys.exit(main())
