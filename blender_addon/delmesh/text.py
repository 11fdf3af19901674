# SPDX-License-Identifier: GPL-3.0-or-later
"""Text for labels."""


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
