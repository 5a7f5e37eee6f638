#!/usr/bin/env python3
"""Prints a Markdown page as Doxygen 1.9 wants it: its own signs for formulas, languages of code without
further words, links to pages only."""

import re
import sys


def convert_text(text):
    text = re.sub(r"(?<![\\$`])\$([^$`]+)\$(?![\w$])", lambda m: r"\f$" + m.group(1) + r"\f$", text)
    text = re.sub(r"\]\(([^)#\s:]+\.md)#[^)]*\)", r"](\1)", text)  # headings have no names there
    text = re.sub(r"(?<=['\"])#(?=\w)", r"\\#", text)  # a colour is no name of a class
    # What is no page and no picture stays as text.
    return re.sub(r"(?<!!)\[([^\]]+)\]\((?![a-z]+:)(?![^)]*\.md\))[^)]*\)", r"\1", text)


def convert(page):
    pieces = re.split(r"^(```[^\n]*\n.*?^```[ ]*\n)", page, flags=re.S | re.M)
    for index, piece in enumerate(pieces):
        if index % 2 == 0:
            pieces[index] = convert_text(piece)
        elif piece.startswith("```math"):
            pieces[index] = "\\f[" + piece[len("```math"):].rstrip()[:-3] + "\\f]\n"
        else:
            pieces[index] = re.sub(r"\A```(\w*)[^\n]*", r"```\1", piece)
    return "".join(pieces)


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        sys.stdout.reconfigure(encoding="utf-8")
        sys.stdout.write(convert(file.read()))
