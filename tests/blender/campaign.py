# SPDX-License-Identifier: Apache-2.0
"""Random operators on random objects, in one Blender process, through the add-on. After each: Blender finds nothing to repair, the
independent certifier (or without it the library's) agrees, what was refused is as it was; at the end the memory is flat.

    run.py ... --campaign 500 --certifier dm_certifier [--seed 1]     environment: DELMESH_SHARED, the folder with data/
"""
import contextlib
import ctypes
import gzip
import json
import os
import pathlib
import random
import subprocess
import sys
import tempfile

import bpy
import numpy as np
import support

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = pathlib.Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared")) / "data"
LARGEST = 400_000  # bytes of a file, packed or not
SLACK = 60_000  # kilobytes that may be alive more at the end than after the first fifth


def load(path):
    """-> points, polygons of an OBJ or OFF file; what is not understood is left out."""
    text = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    lines = [line.split("#")[0].split() for line in text.decode("latin-1").splitlines()]
    lines = [words for words in lines if words]
    if ".obj" in path.name:
        points = [[float(x) for x in words[1:4]] for words in lines if words[0] == "v"]
        faces = []
        for words in lines:
            if words[0] == "f":
                corners = [int(word.split("/")[0]) for word in words[1:]]
                faces.append([i - 1 if i > 0 else len(points) + i for i in corners])
    else:
        numbers = [word for words in lines for word in words]
        at = 1 if numbers[0].endswith("OFF") else 0
        n, m = int(numbers[at]), int(numbers[at + 1])
        body = lines[2:] if at and len(lines[0]) == 1 else lines[1:]
        points = [[float(x) for x in words[:3]] for words in body[:n]]
        faces = [[int(x) for x in words[1:1 + int(words[0])]] for words in body[n:n + m]]
    return points, [f for f in faces if len(f) > 2 and len(set(f)) == len(f) and min(f) >= 0 and max(f) < len(points)]


def models():
    """Files that can be read."""
    for path in sorted(path for folder in ("clean", "nasty", "paper") for path in (DATA / folder).glob("*")):
        if any(kind in path.name.lower() for kind in (".obj", ".off")) and path.stat().st_size < LARGEST:
            try:
                load(path)
                yield path
            except (ValueError, IndexError):
                pass


def dress(ob, dice):
    """Puts some of everything on the object."""
    mesh, numbers = ob.data, np.random.default_rng(dice.randrange(1 << 30))
    points = support.points(mesh)
    if not len(points):
        return
    with np.errstate(all="ignore"):
        scaled = np.nan_to_num((points - points.min(axis=0)) / (np.ptp(points, axis=0).max() or 1), posinf=0, neginf=0)
    verts = support.corner_verts(mesh)
    if dice.random() < 0.7 and len(verts):
        for i in range(dice.randint(1, 3)):
            layer = mesh.uv_layers.new(name=f"map {i}")
            layer.data.foreach_set("uv", np.roll(scaled, i, axis=1)[verts][:, :2].astype(np.float32).reshape(-1))
    if dice.random() < 0.6:
        for i in range(3):
            mesh.materials.append(None)
        mesh.polygons.foreach_set("material_index", numbers.integers(0, 3, len(mesh.polygons), np.int32) // 2)
    for domain, count in (("POINT", len(mesh.vertices)), ("FACE", len(mesh.polygons)), ("CORNER", len(verts)),
                          ("EDGE", len(mesh.edges))):
        if dice.random() < 0.4 and count:
            mesh.attributes.new(f"a {domain}", "FLOAT", domain).data.foreach_set("value", numbers.random(count, np.float32))
        if dice.random() < 0.4 and count:
            mesh.attributes.new(f"b {domain}", "INT", domain).data.foreach_set("value", numbers.integers(0, 9, count, np.int32))
    if dice.random() < 0.4:
        mesh.edges.foreach_set("use_seam", numbers.random(len(mesh.edges)) < 0.02)
    if dice.random() < 0.4:
        mesh.edges.foreach_set("use_edge_sharp", numbers.random(len(mesh.edges)) < 0.02)
    if dice.random() < 0.4:
        group = ob.vertex_groups.new(name="group")
        for value in (0.0, 0.25, 1.0):
            group.add(numbers.integers(0, len(points), max(1, len(points) // 3)).tolist(), value, "REPLACE")
    if dice.random() < 0.3:
        ob.shape_key_add(name="Basis")
        key = ob.shape_key_add(name="key")
        key.data.foreach_set("co", (1.1 * points).astype(np.float32).reshape(-1))
    if dice.random() < 0.3:
        ob.modifiers.new("solid", "SOLIDIFY")
    if dice.random() < 0.5:
        modifier = ob.modifiers.new("sub", "SUBSURF")
        modifier.levels, modifier.render_levels = 1, dice.choice((1, 2))
        modifier.uv_smooth, modifier.boundary_smooth = dice.choice(("SMOOTH_ALL", "PRESERVE_BOUNDARIES")), dice.choice(
            ("ALL", "PRESERVE_CORNERS"))
    ob.scale = (1, 1, 1) if dice.random() < 0.7 else (1, 2, 0.5)


def choose(dice):
    """-> operator, options."""
    keep = {f"keep_{word}": dice.random() < 0.7 for word in ("seams", "sharp", "materials", "uv_borders", "colors", "normals")}
    boundary = dice.choice(("IGNORE", "NONOBTUSE"))
    what = dice.choice(("remesh", "remesh", "remesh", "lod", "lod", "check"))
    if what == "remesh":
        return "delmesh_remesh", {**keep, "boundary": boundary, "mode": dice.choice(support.MODES),
                                  "growth_limit": dice.choice((0, 4)),
                                  "feature_angle": dice.choice((0.1, 0.5, 1)), "max_normal_turn": dice.choice((3.15, 1, 0.5)),
                                  "tolerance": dice.choice((0, 0, 0.01)), "as_copy": dice.random() < 0.1}
    if what == "lod":
        return "delmesh_lod", {**keep, "boundary": boundary, "by": "RATIO",
                               "ratios": dice.choice(("0.5,0.1", "0.3", "0.9,0.2,0.02")),
                               "prepare": dice.choice(("FLIP", "FEATURE")), "quality": dice.choice((0, 2)),
                               "source": dice.choice(("BASE", "EVALUATED", "CAGE")),
                               "lod0": dice.choice(("ORIGINAL", "REMESHED", "NONE")),
                               "structure": dice.choice(("COLLECTION", "UNITY")), "density_group": dice.choice(("", "group"))}
    return "delmesh_check", {"boundary": boundary, "select": False}


def certify_arrays(place, faces, boundary, certifier):
    """place: (n, 3) float32; certifier: the independent one, or "" for the library's alone."""
    if not support.part("native").load().certify((place, faces), boundary=boundary.lower()).delaunay:
        return False
    if not certifier:
        return True
    record = np.empty(len(faces), [("count", "u1"), ("verts", "<i4", 3)])
    record["count"], record["verts"] = 3, faces
    with tempfile.NamedTemporaryFile(suffix=".ply") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(place)}\nproperty float x\nproperty float y\n"
                   f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n".encode())
        file.write(place.tobytes() + record.tobytes())
        file.flush()
        found = json.loads(subprocess.run([certifier, "--boundary", boundary.lower(), "--f32", file.name],
                                          capture_output=True, check=False).stdout)
    # Where sheets meet in one edge or vertex it has no opinion.
    return found["delaunay"] or found["nonmanifold_edges"] + found["nonmanifold_vertices"] > 0


def empty():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)


def memory():
    """Kilobytes that are alive in an empty scene, without those that the allocator keeps for what may come."""
    empty()
    with contextlib.suppress(AttributeError):  # glibc has it
        ctypes.CDLL(None).malloc_trim(0)
    with open("/proc/self/status") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))


def run(number, dice, files, certifier):
    """-> what was done, in words; asserts that it is right."""
    empty()
    if support.ADDON not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=support.ADDON)
    bpy.context.preferences.addons[support.ADDON].preferences.isolate = dice.random() < 0.7
    objects, finite = [], True
    for path in dice.sample(files, dice.choice((1, 1, 2))):
        ob = support.add_object(path.name.split(".")[0][:40], *load(path))
        finite &= bool(np.isfinite(support.points(ob.data)).all()) if len(ob.data.vertices) else True
        ob.data.validate()
        dress(ob, dice)
        objects.append(ob)
    bpy.context.view_layer.update()
    operator, options = choose(dice)
    if "source" in options and not finite:  # modifiers make faces twice of what has no extent
        options["source"] = "BASE"
    before = {ob.name: support.fingerprint(ob.data) for ob in objects}
    support.select(*objects)
    said = f"{number}: {operator} on {', '.join(before)}, {options}"
    try:
        getattr(bpy.ops.object, operator)("EXEC_DEFAULT", True, **options)
    except RuntimeError as reason:
        if "Traceback" in str(reason) or "the library crashed" in str(reason):
            raise AssertionError(f"{said}: {reason}")
        for ob in objects:
            assert support.fingerprint(ob.data) == before[ob.name], f"{said}: was refused, and {ob.name} is another"
        return f"{number}: {operator} on {', '.join(before)}: refused, {reason}"
    for ob in bpy.context.scene.objects:
        if ob.type != "MESH" or (ob.name in before and support.fingerprint(ob.data) == before[ob.name]) or ob.data in {
                o.data for o in objects if support.fingerprint(o.data) == before.get(o.name)}:
            continue
        place = support.points(ob.data)
        assert not ob.data.validate(verbose=True), f"{said}: {ob.name} was not valid"
        if np.isfinite(place).all():
            faces = support.corner_verts(ob.data).reshape(-1, 3)
            good = certify_arrays(place.astype(np.float32), faces, options["boundary"], certifier)
            assert good, f"{said}: {ob.name} is not Delaunay"
    return f"{number}: {operator} on {', '.join(before)}: done"


def main():
    count, seed, certifier = int(os.environ["DELMESH_CAMPAIGN"]), int(os.environ.get("DELMESH_SEED", "1")), os.environ.get(
        "DELMESH_CERTIFIER", "")
    files = list(models())
    if not files:
        print(f"SKIPPED: there are no meshes in {DATA}")
        return 77
    sizes, done = [], 0
    for number in range(count):
        said = run(number, random.Random(f"{seed}.{number}"), files, certifier)
        done += said.endswith(": done")
        print(said.replace("\n", " "), flush=True)
        sizes.append(memory())
    early, late = max(sizes[:max(1, count // 5)]), min(sizes[-max(1, count // 10):])
    print(f"{count} runs, {done} done, {count - done} refused; "
          f"memory {early // 1024} MB after a fifth, {late // 1024} MB at the end")
    assert done > count / 2, "too many were refused"
    assert late < early + SLACK, "the memory grows"
    return 0
