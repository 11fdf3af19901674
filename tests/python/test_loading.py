# SPDX-License-Identifier: Apache-2.0
"""Finding, checking and letting go of the library; the generated mirror of the header."""
import ast
import ctypes
import gc
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import support
from support import ROOT, np

import delmesh
from delmesh import _capi, _library

LIBRARY = os.environ["DELMESH_LIBRARY"]


def load_generator():
    spec = importlib.util.spec_from_file_location("gen_ctypes", ROOT / "tools" / "gen_ctypes.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(code, **environment):
    """Runs Python code in a fresh interpreter -> what it printed."""
    merged = {**os.environ, **environment}
    merged = {key: value for key, value in merged.items() if value is not None}
    return subprocess.run([sys.executable, "-c", code], env=merged, capture_output=True, text=True, check=True).stdout.strip()


WHICH = "import delmesh\ntry:\n print(delmesh.version())\nexcept delmesh.DelmeshError as e:\n print(type(e).__name__, e)"


class Generated(unittest.TestCase):
    def setUp(self):
        self.generator = load_generator()
        self.text = self.generator.HEADER.read_text(encoding="utf-8")

    def test_committed_file_is_what_the_header_gives(self):
        header = self.generator.Header(self.text)
        self.assertEqual(self.generator.generate(header), pathlib.Path(_capi.__file__).read_text(encoding="utf-8"))
        self.assertEqual(self.generator.reports(header), self.generator.REPORTS.read_text(encoding="utf-8"))
        self.assertEqual(self.generator.fields(header), self.generator.FIELDS.read_text(encoding="utf-8"))

    def test_a_changed_header_gives_another_file(self):
        changed = self.text.replace("int64_t max_vertices;", "int64_t max_vertices, more;")
        made = self.generator.generate(self.generator.Header(changed))
        self.assertIn('("max_vertices", C.c_int64), ("more", C.c_int64)', made)
        ast.parse(made)

    def test_what_is_not_understood_is_refused(self):
        for line in ("DELMESH_API long double delmesh_x(void);", "union { int a; } delmesh_x;", "static int x = 3;"):
            with self.assertRaises(SystemExit, msg=line):
                self.generator.Header(self.text.replace("typedef struct delmesh_api {", line + "\ntypedef struct delmesh_api {"))

    def test_every_exported_function_is_mirrored(self):
        declared = set(re.findall(r"DELMESH_API[^;]*?\b(delmesh_\w+)\(", self.text))
        self.assertEqual(declared, set(_capi.PROTOTYPES))

    def test_structs_have_the_library_s_sizes(self):
        library = delmesh.load_library()
        for struct in _capi.STRUCTS:
            self.assertEqual(library.struct_size(struct.__name__.encode()), ctypes.sizeof(struct), struct.__name__)
        self.assertEqual(library.struct_size(b"delmesh_nothing"), 0)

    def test_the_function_table_is_mirrored_in_order(self):
        table = delmesh.load_library().get_api(_capi.DELMESH_ABI_VERSION).contents
        dll = ctypes.CDLL(LIBRARY)
        for name, _ in _capi.delmesh_api._fields_[2:]:
            address = ctypes.cast(getattr(dll, "delmesh_" + name), ctypes.c_void_p).value
            self.assertEqual(getattr(table, name), address, name)


class Loading(unittest.TestCase):
    def test_versions_agree_everywhere(self):
        header = ".".join(re.findall(r"#define DELMESH_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", load_generator().HEADER.read_text()))
        self.assertEqual(delmesh.version(), header)
        project = (ROOT / "bindings/python/pyproject.toml").read_text()
        self.assertEqual(re.search(r'^version = "(.*)"', project, re.M)[1], header)
        addon = ROOT / "blender_addon" / "delmesh"
        manifest = (addon / "blender_manifest.toml").read_text()
        self.assertEqual(re.search(r'^version = "(.*)"', manifest, re.M)[1], header)
        info = next(node.value for node in ast.parse((addon / "__init__.py").read_text()).body
                    if isinstance(node, ast.Assign) and node.targets[0].id == "bl_info")
        self.assertEqual(".".join(map(str, ast.literal_eval(info)["version"])), header)

    def test_import_does_not_load(self):
        self.assertEqual(run("import delmesh; print('libdelmesh' in open('/proc/self/maps').read())"), "False")

    def test_threads_that_come_first_together_load_one(self):
        self.assertEqual(run("import sys, threading, delmesh; from delmesh._library import loaded_library; found = []\n"
                             "sys.setswitchinterval(1e-6); start = threading.Barrier(8)\n"
                             "def look(): start.wait(); found.append(loaded_library())\n"
                             "threads = [threading.Thread(target=look) for _ in range(8)]\n"
                             "for t in threads: t.start()\n"
                             "for t in threads: t.join()\n"
                             "print(len(found), len(set(map(id, found))))"), "8 1")

    def test_a_signal_handler_meets_no_lock_of_its_own_thread(self):
        self.assertEqual(run("import signal, delmesh; from delmesh import _library; token = delmesh.CancelToken()\n"
                             "def handler(*_): token.cancel(); print(delmesh.version() != '', token.cancelled)\n"
                             "signal.signal(signal.SIGUSR1, handler); signal.alarm(20)\n"
                             "with token._lock, _library._lock: signal.raise_signal(signal.SIGUSR1)"), "True True")

    def test_the_path_tells_which_file_is_in_use(self):
        self.assertEqual(run("import delmesh; print(delmesh.native_path())"), LIBRARY)

    def test_a_missing_file_is_a_sentence(self):
        said = run(WHICH, DELMESH_LIBRARY="/nonexistent/libdelmesh.so")
        self.assertRegex(said, r"^LibraryNotFound /nonexistent/libdelmesh.so could not be loaded: .+")

    def test_another_library_is_a_sentence(self):
        said = run(WHICH, DELMESH_LIBRARY="libm.so.6")
        self.assertRegex(said, r"^AbiMismatch libm.so.6 has no function delmesh_\w+; ")

    def test_nothing_anywhere_is_a_sentence(self):
        said = run(WHICH, DELMESH_LIBRARY=None)
        if re.fullmatch(r"\d+\.\d+\.\d+", said):
            self.skipTest("a libdelmesh is installed in the system's library path")
        self.assertRegex(said, r"^LibraryNotFound The library libdelmesh.so for \w+-\w+ was not found: .*DELMESH_LIBRARY is not")

    def test_the_library_beside_the_package_is_found(self):
        for place in (pathlib.Path("lib") / _library.PLATFORM, pathlib.Path()):
            with tempfile.TemporaryDirectory() as folder:
                package = pathlib.Path(folder) / "delmesh"
                shutil.copytree(ROOT / "bindings/python/delmesh", package, ignore=shutil.ignore_patterns("__pycache__"))
                (package / place).mkdir(parents=True, exist_ok=True)
                shutil.copy(LIBRARY, package / place / _library._FILE)
                said = run(WHICH + "\nfrom delmesh._library import loaded_library; print(loaded_library().path)", DELMESH_LIBRARY=None,
                           PYTHONPATH=folder)
                self.assertEqual(said.split("\n"), [delmesh.version(), str((package / place / _library._FILE).resolve())])

    def test_another_struct_size_is_refused(self):
        class delmesh_view(ctypes.Structure):
            _fields_ = _capi.delmesh_view._fields_ + [("more", ctypes.c_int64)]

        class delmesh_mesh_info(ctypes.Structure):  # the library's is larger: it has grown, and that is fine
            _fields_ = _capi.delmesh_mesh_info._fields_[:-1]

        class delmesh_target(ctypes.Structure):  # of the right size, two members the other way round
            _fields_ = [_capi.delmesh_target._fields_[i] for i in (1, 0, 2)]

        structs = _capi.STRUCTS
        try:
            _capi.STRUCTS = structs + (delmesh_view,)
            with self.assertRaisesRegex(delmesh.AbiMismatch, "delmesh_view of 32 bytes, and this package expects 40"):
                delmesh.load_library(LIBRARY)
            _capi.STRUCTS = structs + (delmesh_mesh_info,)
            delmesh.load_library(LIBRARY)
            _capi.STRUCTS = structs + (delmesh_target,)
            with self.assertRaisesRegex(delmesh.AbiMismatch, "delmesh_target.reserved0 at the byte 4, and this package expects 0"):
                delmesh.load_library(LIBRARY)
        finally:
            _capi.STRUCTS = structs

    def test_unload_closes_when_the_last_user_is_gone(self):
        code = """
import gc, delmesh, numpy
mapped = lambda: 'libdelmesh' in open('/proc/self/maps').read()
mesh = delmesh.Mesh(numpy.eye(3), [[0, 1, 2]])
positions = mesh.positions
first = mapped()
delmesh.unload_library(); del mesh; gc.collect()
second, values = mapped(), positions.tolist()
del positions; gc.collect()
print(first, second, values == numpy.eye(3).tolist(), mapped(), delmesh.version(), mapped())"""
        self.assertEqual(run(code), f"True True True False {delmesh.version()} True")


if __name__ == "__main__":
    support.main()
