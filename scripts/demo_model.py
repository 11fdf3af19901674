# SPDX-License-Identifier: Apache-2.0
"""Writes the demo's model: a twisted gear with a bore, made of the triangles a careless tessellator would make.

    demo_model.py OUT.obj

Closed, genus 1, sharp edges along the teeth and the rims, curved between them. Rows are uneven and sheared by the twist, so quads
are long and thin; each is cut along its longer diagonal; the two flat faces are zipped from dense outline to sparse bore, with
slivers.
"""
import math
import sys

TEETH, STEPS, ROWS, BORE = 18, 6, 10, 20  # STEPS points per tooth around, ROWS along the axis
RADIUS, DEPTH, BORE_RADIUS, HEIGHT, TWIST = 1.0, 0.16, 0.42, 0.9, 0.8


def outline(k, row):
    """Point k of the gear's outline at a row: flat tips and roots, steep flanks; the rows crowd at both ends."""
    t = 0.5 - 0.5 * math.cos(math.pi * row / ROWS)
    tooth, step = divmod(k, STEPS)
    along = (0.0, 0.16, 0.34, 0.5, 0.66, 0.84)[step]
    radius = RADIUS + (DEPTH if step in (1, 2) else 0.5 * DEPTH if step in (0, 3) else 0.0)
    radius *= 1.0 + 0.10 * math.sin(math.pi * t)  # barrel
    angle = math.tau * (tooth + along) / TEETH + TWIST * t
    return radius * math.cos(angle), radius * math.sin(angle), HEIGHT * (t - 0.5)


def bore(k, row):
    angle = math.tau * k / BORE
    return BORE_RADIUS * math.cos(angle), BORE_RADIUS * math.sin(angle), HEIGHT * (row - 0.5)


def make():
    around = TEETH * STEPS
    points = [outline(k, row) for row in range(ROWS + 1) for k in range(around)]
    first_bore = len(points)
    points += [bore(k, row) for row in (0, 1) for k in range(BORE)]
    faces = []

    for row in range(ROWS):
        for k in range(around):
            a, b = row * around + k, row * around + (k + 1) % around
            c, d = b + around, a + around
            longer = math.dist(points[a], points[c]) > math.dist(points[b], points[d])
            faces += [(a, b, c), (a, c, d)] if longer else [(a, b, d), (b, c, d)]
    for k in range(BORE):  # the wall of the bore, seen from inside it
        a, b = first_bore + k, first_bore + (k + 1) % BORE
        faces += [(b, a, a + BORE), (b, a + BORE, b + BORE)]
    for row, ring in ((0, first_bore), (ROWS, first_bore + BORE)):  # zip outline and bore together by angle
        i = j = 0
        twist = TWIST if row else 0.0
        shift = round(twist / math.tau * BORE)
        while i < around or j < BORE:
            a, b = row * around + i % around, ring + (j + shift) % BORE
            outline_next = (i + 1) / around <= (j + 1) / BORE + 1e-9 if j < BORE else True
            if i < around and outline_next:
                face = (a, row * around + (i + 1) % around, b)
                i += 1
            else:
                face = (a, ring + (j + 1 + shift) % BORE, b)
                j += 1
            faces.append(face if row else face[::-1])
    return points, faces


if __name__ == "__main__":
    model_points, model_faces = make()
    with open(sys.argv[1], "w", encoding="ascii") as out:
        out.write("# a twisted gear\n")
        out.writelines(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in model_points)
        out.writelines(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in model_faces)
