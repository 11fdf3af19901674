# SPDX-License-Identifier: GPL-3.0-or-later
"""The other side of isolation.py: a process that runs the library for Blender, so that a crash ends this and not Blender.

    python helper.py ADDON_FOLDER PACKAGE_FOLDER LIBRARY FOLDER_OF_NUMPY

Requests come on standard input, answers go to standard output; arrays lie in files of shared memory, as isolation.py tells."""
import importlib
import os
import pathlib
import sys
import types


def main():
    addon, package, library, numpy_folder = sys.argv[1:]
    sys.path.append(numpy_folder)
    if package:
        sys.path.insert(0, package)
    import delmesh
    # The add-on's own modules under another name: its __init__ needs bpy.
    parent = types.ModuleType("delmesh_helper")
    parent.__path__ = [addon]
    sys.modules[parent.__name__] = parent
    shared = importlib.import_module("delmesh_helper.shared")
    survive = importlib.import_module("delmesh_helper.survive")
    delmesh.load_library(library)
    if hasattr(os, "nice"):
        os.nice(5)  # the window comes first

    incoming, outgoing = sys.stdin.buffer, os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what anything prints is no answer
    shared.send(outgoing, ("ready", None))
    token = delmesh.CancelToken()
    while True:
        request = shared.receive(incoming, parent.__name__)
        if request is None:
            return
        folder, run, data, keep, options = request
        pathlib.Path(folder).mkdir(exist_ok=True)

        def progress(fraction, stage):
            shared.send(outgoing, ("progress", (fraction, stage)))
            return True

        try:
            outcome = survive.RUNS[run](delmesh, data, keep, options, progress, token)
        except (delmesh.DelmeshError, survive.Refused, MemoryError) as error:
            shared.send(outgoing, ("error", str(error) or "there is not enough memory"))
        except Exception as error:
            shared.send(outgoing, ("error", f"a defect of the add-on: {type(error).__name__}: {error}"))
        else:
            shared.send(outgoing, ("done", outcome), folder)
        del request, data


main()
