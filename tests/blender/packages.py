#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What scripts/package-blender makes of the wheels of all systems: of this build's library, under their tags.

    packages.py --library libdelmesh.so [--environment FOLDER]     where run.py has put a bpy, for Blender's own check of extensions
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bindings" / "python"))
sys.dont_write_bytecode = True
import delmesh_build  # noqa: E402

# Tag of a wheel -> Blender's platform
WHEELS = {"manylinux_2_28_x86_64": "linux-x64", "manylinux_2_28_aarch64": None, "win_amd64": "windows-x64",
          "macosx_11_0_arm64": "macos-arm64", "macosx_11_0_x86_64": "macos-x64"}


def packed(out, wheels):
    """-> {name: zip}, in a folder of their own."""
    names = subprocess.run([sys.executable, ROOT / "scripts" / "package-blender", out, "--wheels", wheels], check=True,
                           capture_output=True, text=True).stdout.split()
    return {pathlib.Path(name).name: pathlib.Path(name) for name in names}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--library", dest="shared_object", required=True)
    parser.add_argument("--environment", type=pathlib.Path, default=pathlib.Path("none"))
    arguments = parser.parse_args()
    validator = next(arguments.environment.rglob("blender_ext.py"), None)
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        (work / "wheels").mkdir()
        # A wheel that is only for machines like this one must not take the place of the one for all.
        made = {tag: delmesh_build.write_wheel(work / "wheels", arguments.shared_object, tag) for tag in ("linux_x86_64", *WHEELS)}
        zips = packed(work / "out", work / "wheels")
        version = delmesh_build.project()["version"]
        places = {name: f"delmesh-{version}-{name.replace('-', '_')}.zip" for name in WHEELS.values() if name}
        assert sorted(zips) == sorted([*places.values(), f"delmesh-{version}-legacy.zip"]), sorted(zips)
        for tag, platform in WHEELS.items():
            if not platform:
                continue
            with zipfile.ZipFile(zips[places[platform]]) as archive:
                manifest = delmesh_build.tomllib.loads(archive.read("blender_manifest.toml").decode())
                assert manifest["platforms"] == [platform], manifest
                assert manifest["wheels"] == [f"./wheels/{made[tag]}"], manifest
                assert archive.read(f"wheels/{made[tag]}") == (work / "wheels" / made[tag]).read_bytes()
                assert not any(name.endswith((".so", ".dll", ".dylib")) for name in archive.namelist()), "only in the wheel"
            if validator:
                subprocess.run([sys.executable, validator, "validate", zips[places[platform]]], check=True)
        with zipfile.ZipFile(zips[f"delmesh-{version}-legacy.zip"]) as archive:
            libraries = {name for name in archive.namelist() if "/lib/" in name}
            assert libraries == {f"delmesh/_vendor/{delmesh_build.place_of(tag)}" for tag, platform in WHEELS.items() if platform}
            assert {"delmesh/__init__.py", "delmesh/_vendor/delmesh/__init__.py"} <= set(archive.namelist())
        again = packed(work / "again", work / "wheels")
        assert all(again[name].read_bytes() == path.read_bytes() for name, path in zips.items()), "other bytes the second time"
    print(f"{len(zips)} packages of {len(made)} wheels, {'accepted by Blender' if validator else 'Blender not asked'}")


if __name__ == "__main__":
    main()
