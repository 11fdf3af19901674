# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of the add-on inside Blender. run.py starts this, in a fresh profile; DELMESH_ADDON_ZIPS names the packages,
one of which is installed, DELMESH_TESTS the modules, all by default."""
import os
import pathlib
import sys
import traceback
import unittest

import bpy  # noqa: F401 first: as a module it brings the others

HERE = pathlib.Path(__file__).resolve().parent


def main():
    sys.path.insert(0, str(HERE))
    import support
    support.install()
    if os.environ.get("DELMESH_CAMPAIGN"):
        import campaign
        return campaign.main()
    names = os.environ.get("DELMESH_TESTS", "").split() or sorted(path.stem for path in HERE.glob("test_*.py"))
    result = unittest.TextTestRunner(verbosity=2).run(unittest.defaultTestLoader.loadTestsFromNames(names))
    return not (result.wasSuccessful() and result.testsRun)


if __name__ == "__main__":
    code = 1
    try:
        code = int(main())
    except BaseException:
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # not through Blender's own end: as a module it can wait there for ever for a thread of its own
