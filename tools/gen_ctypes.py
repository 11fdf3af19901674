#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes what mirrors include_c/delmesh/delmesh.h: bindings/python/delmesh/_capi.py for ctypes, _reports.py beside it with the
reports as named tuples, and libdelmesh/api/fields.inc, by which the library tells the sizes and offsets that the mirror is checked
against when it is loaded.

    tools/gen_ctypes.py            rewrite the committed files
    tools/gen_ctypes.py --check    exit 1 if a committed file is not what the header gives (tests/python runs this)

It reads the C of our own header: enums, integer macros, structs, callback types and DELMESH_API prototypes, one declaration per
member. Anything else is an error here, so that the header cannot grow past the mirror unnoticed.
"""
import argparse
import ast
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
HEADER = ROOT / "include_c" / "delmesh" / "delmesh.h"
OUTPUT = ROOT / "bindings" / "python" / "delmesh" / "_capi.py"
REPORTS = OUTPUT.with_name("_reports.py")
FIELDS = ROOT / "libdelmesh" / "api" / "fields.inc"
WIDTH = 130

SCALARS = {name + "_t": "C.c_" + name for name in ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")}
SCALARS |= {"double": "C.c_double", "float": "C.c_float"}


class Header:
    def __init__(self, text):
        text = re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.S)
        self.macros = re.findall(r"^#define (DELMESH_\w+)[ \t]+(-?(?:0x[0-9A-Fa-f]+|\d+))[ \t]*$", text, flags=re.M)
        text = re.sub(r"^#[^\n]*(?:\\\n[^\n]*)*", "", text, flags=re.M)
        self.opaque, self.constants, self.structs, self.callbacks, self.functions = set(), [], {}, {}, {}
        text = text.replace('extern "C" {', "", 1)
        while text.strip(" \n\t}"):
            match = re.match(r"\s*(?:(enum|typedef struct \w+)\s*\{(.*?)\}\s*(\w*)\s*;|([^;{]*);)", text, flags=re.S)
            if not match:
                raise SystemExit(f"{HEADER.name}: not understood: {text.strip()[:80]!r}")
            text = text[match.end():]
            kind, body, name, declaration = match.groups()
            if kind == "enum":
                self._enum(body)
            elif kind:
                self.structs[name] = [self._member(m) for m in body.split(";") if m.strip()]
            else:
                self._declaration(" ".join(declaration.split()))

    def _enum(self, body):
        value = -1
        for item in filter(None, (part.strip() for part in body.split(","))):
            name, _, given = (part.strip() for part in item.partition("="))
            value = ast.literal_eval(given) if given else value + 1
            self.constants.append((name, value))

    def _declaration(self, text):
        if match := re.fullmatch(r"typedef struct (\w+) \1", text):
            self.opaque.add(match[1])
        elif match := re.fullmatch(r"typedef (.+?) ?\(\*(\w+)\)\((.*)\)", text):
            self.callbacks[match[2]] = [self.ctype(match[1])] + self._parameters(match[3])
        elif match := re.fullmatch(r"DELMESH_API (.+?)(\w+)\((.*)\)", text):
            self.functions[match[2]] = [self.ctype(match[1])] + self._parameters(match[3])
        else:
            raise SystemExit(f"{HEADER.name}: not understood: {text!r}")

    def _member(self, text):
        """-> [(name, ctype), ...] of one line of a struct."""
        text = " ".join(text.split())
        if match := re.fullmatch(r".+? ?\(\*(\w+)\)\(.*\)", text):
            return [(match[1], "C.c_void_p")]  # only delmesh_api has these; its functions are also symbols
        match = re.fullmatch(r"((?:const )?\w+\s?\*?)\s?(.+)", text)
        members = []
        for declarator in (part.strip() for part in match[2].split(",")):
            name, length = re.fullmatch(r"(\w+)(?:\[(\d+)\])?", declarator).groups()
            members.append((name, self.ctype(match[1]) + (f" * {length}" if length else "")))
        return members

    def _parameters(self, text):
        return [] if text.strip() == "void" else [self.ctype(parameter) for parameter in text.split(",")]

    def ctype(self, text):
        """of "const type* name", with or without the name."""
        words = text.replace("*", " * ").split()
        stars = words.count("*")
        name = next(word for word in words if word not in ("const", "*"))
        if name == "char" and stars == 1:
            return "C.c_char_p"
        if name == "void":
            return "C.c_void_p" if stars else "None"
        if name in self.opaque:
            return "C.c_void_p" if stars == 1 else "C.POINTER(C.c_void_p)"
        if name in SCALARS:
            return f"C.POINTER({SCALARS[name]})" if stars else SCALARS[name]
        if name in self.structs or name in self.callbacks:
            return f"C.POINTER({name})" if stars else name
        raise SystemExit(f"{HEADER.name}: the type {text!r} is not known")


def wrap(head, items, tail):
    """head item, item, ... tail, broken at WIDTH."""
    indent = " " * (4 + len(head) - len(head.lstrip()))
    lines, line = [], head
    for i, item in enumerate(items):
        piece = item + (tail if i + 1 == len(items) else ",")
        space = "" if line.endswith(("(", "[", "{")) or line == indent else " "
        if len(line + space + piece) > WIDTH:
            lines.append(line)
            line, space = indent, ""
        line += space + piece
    return "\n".join([*lines, line])


def generate(header):
    out = ["# SPDX-License-Identifier: Apache-2.0",
           "# Generated by tools/gen_ctypes.py from include_c/delmesh/delmesh.h. Do not edit: change the header and run it again.",
           '"""The C interface as ctypes sees it: constants, structs, callback types, prototypes. '
           'Documentation is in delmesh.h."""',
           "import ctypes as C", ""]
    out += [f"{name} = {value}" for name, value in header.macros]
    out += [""] + [f"{name} = {value}" for name, value in header.constants]
    out += [""] + [f"{name} = C.CFUNCTYPE({', '.join(types)})" for name, types in header.callbacks.items()]
    for name, members in header.structs.items():
        out += ["", "", f"class {name}(C.Structure):",
                wrap("    _fields_ = [", [f'("{m}", {t})' for line in members for m, t in line], "]")]
    out += ["", "", wrap("STRUCTS = (", list(header.structs), ")"), "PROTOTYPES = {"]
    out += [wrap(f'    "{name}": (', types, ",)," if len(types) == 1 else "),")
            for name, types in header.functions.items()]
    return "\n".join(out + ["}", ""])


# Structs that come out as named tuples, and what Python adds to some. The choices among numbers that come out as words:
REPORT = re.compile(r"delmesh_(\w+_report|mesh_info|preserve_estimate)")
MORE = {"delmesh_decimate_report": ["levels: tuple[LevelReport, ...] = ()"],
        "delmesh_certify_report": ["nld_edges: np.ndarray | None = None", "zero_area_face_list: np.ndarray | None = None"]}
WORDS = {"stopped_by": "str"}


def reports(header):
    """The reports as typed classes."""
    out = ["# SPDX-License-Identifier: Apache-2.0",
           "# Generated by tools/gen_ctypes.py from include_c/delmesh/delmesh.h. Do not edit: change the header and run it again.",
           '"""What operations report. The fields are documented in delmesh.h, in the struct that each class names."""',
           "from __future__ import annotations", "", "from typing import NamedTuple", "", "import numpy as np", "", "from . import _capi"]
    classes = []
    for name, members in header.structs.items():
        if not REPORT.fullmatch(name):
            continue
        classes.append("".join(word.title() for word in name.split("_")[1:]))
        out += ["", "", f"class {classes[-1]}(NamedTuple):", f'    """The fields of {name}."""', ""]
        for member, ctype in (pair for line in members for pair in line):
            if member != "struct_size" and not member.startswith("reserved"):
                kind = "float" if ctype.startswith(("C.c_double", "C.c_float")) else "int"
                out.append(f"    {member}: {WORDS.get(member) or (f'tuple[{kind}, ...]' if '*' in ctype else kind)}")
        out += [f"    {line}" for line in MORE.get(name, [])]
    structs = [name for name in header.structs if REPORT.fullmatch(name)]
    out += ["", "", wrap("STRUCTS = {", [f"{made}: _capi.{name}" for made, name in zip(classes, structs)], "}"), ""]
    return "\n".join(out)


def fields(header):
    """Every struct and member as calls of macros that the includer defines."""
    out = ["// SPDX-License-Identifier: Apache-2.0", "// Generated by tools/gen_ctypes.py from include_c/delmesh/delmesh.h. Do not edit.",
           "// clang-format off"]
    for name, members in header.structs.items():
        out += [f"DM_STRUCT({name})", *(f"DM_FIELD({name}, {member})" for line in members for member, _ in line)]
    return "\n".join([*out, ""])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare instead of writing")
    arguments = parser.parse_args()
    header = Header(HEADER.read_text(encoding="utf-8"))
    for path, text in ((OUTPUT, generate(header)), (REPORTS, reports(header)), (FIELDS, fields(header))):
        if not arguments.check:
            path.write_text(text, encoding="utf-8")
        elif not path.is_file() or path.read_text(encoding="utf-8") != text:
            sys.exit(f"{path.relative_to(ROOT)} is not what {HEADER.relative_to(ROOT)} gives: run tools/gen_ctypes.py")


if __name__ == "__main__":
    main()
