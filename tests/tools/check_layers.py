# SPDX-License-Identifier: Apache-2.0
"""Holds the library's sources to the layers and bans of docs/architecture.md.

    check_layers.py PROJECT_ROOT     lists every offence as file:line and fails when there is one
    check_layers.py --self-test      shows that each rule finds an offence and spares what is allowed

Layers: base <- mesh <- geom <- algo <- api; subdiv sees base and mesh; nothing includes api. A file includes its own layer and the
ones below it, the public header, the C and C++ standard headers, and of other libraries only what RULES allow it.
"""
import re
import sys
import tempfile
from pathlib import Path

SEES = {
    "base": {"base"},
    "mesh": {"base", "mesh"},
    "geom": {"base", "mesh", "geom"},
    "algo": {"base", "mesh", "geom", "algo"},
    "subdiv": {"base", "mesh", "subdiv"},
    "api": {"base", "mesh", "geom", "algo", "subdiv", "api"},
}
# pattern, what is wrong with it. Searched in the code without comments and string contents.
BANS = [
    (r"#\s*include\s*<(?:iostream|fstream|sstream|iomanip|ostream|istream)>", "no streams in the library"),
    (r"#\s*include\s*<(?:vector|map|set|unordered_map|unordered_set|deque|list|string)>",
     "memory must come from the context's allocator: use Array"),
    (r"\bstd::(?:vector|string|map|set|unordered_map|unordered_set|deque|list)\s*[<;({ ]",
     "memory must come from the context's allocator: use Array"),
    (r"(?<![\w.>])(?:std::)?(?:f|v|vf)?printf\s*\(|(?<![\w.>])(?:std::)?f?put[sc](?:har)?\s*\(", "the library does not print"),
    (r"\bstd::c(?:out|err|log)\b", "the library does not print"),
    (r"\bthread_local\b|\b__thread\b", "no thread-local state"),
    (r"\b(?:secure_)?getenv\s*\(", "the library does not read the environment"),
    (r"\bsetlocale\s*\(|\bstd::locale\b", "the library does not use the locale"),
    (r"(?<![\w.>])(?:std::)?(?:abort|exit|_Exit|quick_exit)\s*\(", "the library does not end the host's process"),
    (r"\bstd::(?:random_device|mt19937|rand)\b|(?<![\w.>])s?rand\s*\(", "same input, same bytes: no random numbers"),
]
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*([<"])([^>"]+)[>"]', re.M)


def blank(match):
    """Keeps the line breaks, so that line numbers stay right."""
    return re.sub(r"[^\n]", " ", match.group())


def code_only(text):
    text = re.sub(r"//[^\n]*|/\*.*?\*/", blank, text, flags=re.S)
    # string contents, but not the names in include lines
    return re.sub(r'^(?![ \t]*#[ \t]*include)(.*)$', lambda m: re.sub(r'"(?:\\.|[^"\\\n])*"', '""', m.group()), text, flags=re.M)


def offences(path, layer, text):
    code = code_only(text)
    line_of = lambda at: code.count("\n", 0, at) + 1
    for match in INCLUDE.finditer(code):
        name, line = match.group(2), line_of(match.start())
        top = name.split("/")[0]
        if top in SEES and "/" in name:
            if top not in SEES[layer]:
                yield line, f"{layer}/ must not include {name}"
        elif top == "Eigen":
            if layer not in ("geom", "algo") or path.suffix != ".cpp":
                yield line, "Eigen only in .cpp files of geom/ and algo/"
        elif top == "opensubdiv":
            if layer != "subdiv":
                yield line, "OpenSubdiv only in subdiv/"
        elif name.endswith("delmesh.hpp"):
            yield line, "delmesh.hpp is for hosts"
        elif match.group(1) == '"' and not name.startswith("delmesh/"):
            yield line, f'{name}: include by layer, as "mesh/mesh.h"'
    for pattern, why in BANS:
        for match in re.finditer(pattern, code):
            yield line_of(match.start()), why


def check(root):
    found, files = [], 0
    for path in sorted((root / "libdelmesh").rglob("*")):
        if path.suffix not in (".h", ".cpp"):
            continue
        files += 1
        layer = path.relative_to(root / "libdelmesh").parts[0]
        if layer not in SEES:
            found.append(f"{path.relative_to(root)}: in no known layer")
            continue
        text = path.read_text(encoding="utf-8")
        found += [f"{path.relative_to(root)}:{line}: {why}" for line, why in sorted(offences(path, layer, text))]
        if "SPDX-License-Identifier: Apache-2.0" not in text.partition("\n")[0]:
            found.append(f"{path.relative_to(root)}:1: the licence line is missing")
    return found, files


def self_test():
    cases = [  # file, a line of code, whether it offends
        ("base/a.h", '#include "base/array.h"', False), ("base/a.h", '#include "mesh/mesh.h"', True),
        ("mesh/a.cpp", '#include "geom/predicates.h"', True), ("geom/a.cpp", '#include "mesh/mesh.h"', False),
        ("algo/a.cpp", '#include "api/guard.h"', True), ("api/a.cpp", '#include "algo/remesh.h"', False),
        ("subdiv/a.cpp", '#include "geom/predicates.h"', True), ("api/a.cpp", '#include "delmesh/delmesh.h"', False),
        ("api/a.cpp", '#include "delmesh/delmesh.hpp"', True), ("mesh/a.cpp", '#include "mesh.h"', True),
        ("geom/a.cpp", "#include <Eigen/Core>", False), ("geom/a.h", "#include <Eigen/Core>", True),
        ("mesh/a.cpp", "#include <Eigen/Core>", True), ("algo/a.cpp", "#include <opensubdiv/far/types.h>", True),
        ("subdiv/a.cpp", "#include <opensubdiv/far/types.h>", False), ("base/a.cpp", "#include <iostream>", True),
        ("base/a.cpp", "#include <vector>", True), ("base/a.cpp", "std::vector<int> a;", True),
        ("base/a.cpp", "// std::vector is not used", False), ("base/a.cpp", "/* printf(\n */ int a;", False),
        ("base/a.cpp", 'printf("x");', True), ("base/a.cpp", "std::fprintf(stderr, x);", True),
        ("base/a.cpp", "std::vsnprintf(a, n, f, v);", False), ("base/a.cpp", 'fail("getenv(");', False),
        ("base/a.cpp", "std::getenv(name);", True), ("base/a.cpp", "thread_local int a;", True),
        ("base/a.cpp", "std::abort();", True), ("base/a.cpp", "queue.exit();", False), ("base/a.cpp", "rand();", True),
        ("base/a.cpp", "grand();", False), ("new/a.cpp", "int a;", True),
    ]
    for name, line, offends in cases:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "libdelmesh" / name
            path.parent.mkdir(parents=True)
            path.write_text(f"// SPDX-License-Identifier: Apache-2.0\n{line}\n")
            found, _ = check(Path(folder))
            assert bool(found) == offends, (name, line, found)
    print(f"{len(cases)} cases told right")


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        sys.exit(0)
    offending, count = check(Path(sys.argv[1]))
    print("\n".join(offending + [f"{count} files, {len(offending)} offences"]))
    sys.exit(1 if offending or count == 0 else 0)
