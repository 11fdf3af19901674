# SPDX-License-Identifier: GPL-3.0-or-later
"""Text for labels and reports."""


def wrapped(text, width):
    """Labels do not wrap."""
    line = ""
    for word in text.split():
        if line and len(line) + 1 + len(word) > width:
            yield line
            line = word
        else:
            line = f"{line} {word}".strip()
    yield line


def number(value):
    """With thin spaces between thousands."""
    return f"{value:,}".replace(",", " ")
