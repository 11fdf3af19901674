# SPDX-License-Identifier: Apache-2.0
"""Words for the constants of delmesh.h."""
from . import _capi
from .errors import InvalidArgument


def names(prefix):
    """{"preserve": 0, ...} of the constants that start with prefix."""
    return {key.removeprefix(prefix).lower(): value for key, value in vars(_capi).items() if key.startswith(prefix)}


def number(what, word, choices):
    """The constant that `word` stands for. what: how the sentence of a refusal begins, e.g. "The option 'mode'"."""
    if not isinstance(word, str) or word not in choices:
        raise InvalidArgument(f"{what} was {word!r}, which is not one of {', '.join(choices)}.")
    return choices[word]


# What an edge can be kept for, and so released from
RELEASES = {word: getattr(_capi, "DELMESH_EDGE_" + word.upper())
            for word in ("marked", "sharp", "seam", "crease", "uv", "normal", "color", "layer", "material", "face_set")}


def release(words):
    """The bits of "uv", of ("uv", "material"), or of a number of them."""
    if isinstance(words, int):
        return words
    bits = 0
    for word in [words] if isinstance(words, str) else words:
        bits |= number("The option 'release'", word, RELEASES)
    return bits
