# SPDX-License-Identifier: Apache-2.0
"""The malformed and nasty files of the shared test data: never a signal, never a hang, bounded memory, and either success or one
sentence that names the line or byte.
    test_broken_files.py DELMESH [--no-limits]
"""
import json
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared")) / "data"

# Files that the readers must take, out of those that are odd but say what they mean.
VALID = {"cube_binary_starts_with_nl.ply", "inspired_mesh_quads_Conjugate.off", "nancolor.obj", "whitespace.off",
         "syn_off_crlf_ok.off", "syn_obj_bad_vt_index.obj", "syn_obj_duplicate_index_face.obj",
         "syn_obj_face_before_vertices.obj", "syn_obj_line_1MB.obj", "syn_ply_be_ok.ply", "syn_ply_faces_before_vertices_ok.ply",
         "syn_ply_float_list_count.ply",
         "syn_stl_ascii_4_vertices.stl", "syn_stl_bin_ok.stl"}


class Run:
    def __init__(self, delmesh, limits):
        self.delmesh, self.limits, self.problems, self.count = delmesh, limits, [], 0

    def call(self, what, words, seconds, gigabytes, statuses, place):
        """place: a failure must name a line or byte."""
        self.count += 1
        limit = int(gigabytes * (1 << 30))

        def set_limit():
            resource.setrlimit(resource.RLIMIT_AS, (limit, limit))

        try:
            done = subprocess.run([self.delmesh, *map(str, words)], capture_output=True, timeout=seconds,
                                  preexec_fn=set_limit if self.limits else None)
        except subprocess.TimeoutExpired:
            self.problems.append(f"{what}: did not end in {seconds} s")
            return None
        error = done.stderr.decode(errors="replace")
        if done.returncode not in statuses:
            self.problems.append(f"{what}: exit status {done.returncode}, {error[-200:]}")
        elif done.returncode == 2 and (error.count("\n") != 1 or not error[:-1].isprintable()):
            self.problems.append(f"{what}: not one sentence: {error!r}")
        elif done.returncode == 2 and place and not re.search(r"(line|byte) \d+", error):
            self.problems.append(f"{what}: no line and no byte: {error}")
        return done

    def malformed(self, path, valid=None):
        done = self.call(path.name, ["info", path, "--json"], 5, 1, (0, 2), True)
        if done is None:
            return
        try:
            report = json.loads(done.stdout)
            if ("error" in report) != (done.returncode == 2):
                self.problems.append(f"{path.name}: exit status and JSON differ")
        except ValueError:
            self.problems.append(f"{path.name}: no JSON: {done.stdout[:200]!r}")
        if valid is not None and (done.returncode == 0) != valid:
            self.problems.append(f"{path.name}: exit status {done.returncode}, {done.stderr[-200:]}")


def mutate(data, rand):
    """One of the usual accidents: cut off, bytes changed, a piece lost or doubled."""
    data = bytearray(data)
    kind = rand.randrange(4)
    at = rand.randrange(len(data))
    if kind == 0:
        del data[at:]
    elif kind == 1:
        for _ in range(rand.randrange(1, 8)):
            data[rand.randrange(len(data))] = rand.randrange(256)
    elif kind == 2:
        del data[at:at + rand.randrange(1, 64)]
    else:
        data[at:at] = data[at:at + rand.randrange(1, 64)]
    return bytes(data)


def main():
    run = Run(os.path.abspath(sys.argv[1]), "--no-limits" not in sys.argv)
    if not DATA.is_dir():
        print(f"SKIPPED: the shared test data are not at {DATA}")
        return 77
    malformed, nasty = sorted((DATA / "malformed").iterdir()), sorted((DATA / "nasty").iterdir())
    with tempfile.TemporaryDirectory() as folder:
        for path in malformed:
            run.malformed(path, True if path.name in VALID else None)
        for path in nasty:
            run.call(path.name, ["info", path], 60, 2, (0, 2), False)
            run.call(path.name, ["certify", path, "--list"], 20, 2, (0, 1, 2), False)
        rand = random.Random(2024)
        for path in malformed + nasty:
            if path.stat().st_size > 4000 or path.stat().st_size == 0:
                continue
            for k in range(3):
                broken = Path(folder) / f"{k}-{path.name}"
                broken.write_bytes(mutate(path.read_bytes(), rand))
                if broken.stat().st_size > 0:
                    run.call(f"{path.name}, broken", ["info", broken], 5, 1, (0, 2), False)
    for problem in run.problems:
        print(problem)
    print(f"{run.count} runs, {len(run.problems)} problems")
    return 1 if run.problems or run.count < 300 else 0


if __name__ == "__main__":
    sys.exit(main())
