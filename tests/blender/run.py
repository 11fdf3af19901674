#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Installs the add-on in a Blender of its own profile and runs the tests there, headless. Exit status 77: skipped.

    run.py --library libdelmesh.so --blender /usr/bin/blender [--source-tree]
    run.py ... --beside     runs beside.py instead: the library alone, beside the host's OpenSubdiv
    run.py ... --campaign 500 --certifier dm_certifier     (random operators on random objects)
    run.py --library libdelmesh.so --bpy 4.5.15 --environment FOLDER     (a virtual environment, made there and used again)
    run.py ... --certifier dm_certifier                                  (for what is read back from files)
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]


def skip(reason):
    print(f"SKIPPED: {reason}")
    sys.exit(77)


def python_with_bpy(folder, version):
    """The interpreter of a virtual environment that has bpy."""
    python = folder / "bin" / "python"
    has_bpy = [python, "-c", "import bpy, os; os._exit(0)"]
    if python.exists() and subprocess.run(has_bpy, capture_output=True).returncode == 0:
        return python
    if sys.version_info[:2] != (3, 11):
        skip(f"bpy {version} needs Python 3.11, and this is {sys.version.split()[0]}")
    shutil.rmtree(folder, ignore_errors=True)
    for command in ([sys.executable, "-m", "venv", folder],
                    [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", f"bpy=={version}"], has_bpy):
        made = subprocess.run(command, capture_output=True, text=True)
        if made.returncode:
            shutil.rmtree(folder, ignore_errors=True)
            last = ((made.stderr or made.stdout).strip().splitlines() or ["no message"])[-1]
            skip(f"{' '.join(map(str, command[:4]))} ... failed: {last}")
    return python


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--library", dest="shared_object", required=True)
    parser.add_argument("--blender")
    parser.add_argument("--source-tree", action="store_true")
    parser.add_argument("--beside", action="store_true")
    parser.add_argument("--bpy")
    parser.add_argument("--environment", type=pathlib.Path)
    parser.add_argument("--campaign", metavar="RUNS", help="campaign.py instead of the tests")
    parser.add_argument("--certifier", default="")
    parser.add_argument("--seed", default="1")
    arguments = parser.parse_args()
    if not arguments.bpy and not shutil.which(arguments.blender or ""):
        skip("there is no blender")
    python = python_with_bpy(arguments.environment, arguments.bpy) if arguments.bpy else None

    with tempfile.TemporaryDirectory() as folder:
        profile = pathlib.Path(folder)
        addons = profile / "scripts" / "addons"
        addons.mkdir(parents=True)
        environment = {**os.environ, "BLENDER_USER_RESOURCES": folder, "BLENDER_USER_CONFIG": str(profile / "config"),
                       "BLENDER_USER_SCRIPTS": str(profile / "scripts"), "PYTHONDONTWRITEBYTECODE": "1"}
        environment.pop("PYTHONPATH", None)
        environment.pop("DELMESH_LIBRARY", None)
        script = HERE / ("beside.py" if arguments.beside else "inside.py")
        environment["DELMESH_CERTIFIER"] = arguments.certifier
        if arguments.campaign:
            environment |= {"DELMESH_CAMPAIGN": arguments.campaign, "DELMESH_SEED": arguments.seed,
                            "MALLOC_MMAP_THRESHOLD_": "131072"}  # else glibc raises it, and free pieces between others stay
        if arguments.beside:
            environment["DELMESH_LIBRARY"] = arguments.shared_object
        elif arguments.source_tree:
            (addons / "delmesh").symlink_to(ROOT / "blender_addon" / "delmesh")
            environment["DELMESH_LIBRARY"] = arguments.shared_object
        else:
            zips = subprocess.run(
                [sys.executable, ROOT / "scripts" / "package-blender", folder, "--library", arguments.shared_object],
                check=True, capture_output=True, text=True).stdout.split()
            environment["DELMESH_ADDON_ZIPS"] = "\n".join(zips)
        command = [python, script] if python else [
            arguments.blender, "-b", "--factory-startup", "-noaudio", "--python-exit-code", "7", "--python", script]
        sys.exit(subprocess.run(command, env=environment, timeout=None if arguments.campaign else 550).returncode)


if __name__ == "__main__":
    main()
