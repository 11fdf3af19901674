# SPDX-License-Identifier: Apache-2.0
"""Draws triangle meshes side by side into one PNG file: shaded faces, their wires, and chosen edges in red; and what the other
pictures need for that. Needs numpy only."""
import struct
import zlib

import numpy as np

SIZE, SUPERSAMPLING, CAPTION = 600, 2, 44  # pixels of a panel, samples per pixel and axis, height of the caption
PAPER, INK, RED = (250, 250, 248), (60, 66, 74), (214, 32, 28)
# 5 x 7 letters, one row of five bits each
GLYPHS = {
    "A": "0E11111F111111", "C": "0E11101010110E", "D": "1E11111111111E", "E": "1F10101E10101F",
    "F": "1F10101E101010", "G": "0E11101713110F", "I": "0E04040404040E", "L": "1010101010101F",
    "B": "1E11111E11111E", "H": "1111111F111111", "J": "0702020202120C", "K": "11121418141211",
    "M": "111B1515111111", "N": "11191915131311",
    "O": "0E11111111110E", "P": "1E11111E101010", "R": "1E11111E141211", "S": "0F10100E01011E", "T": "1F040404040404",
    "U": "1111111111110E", "V": "11111111110A04", "W": "11111115151B11", "X": "11110A040A1111",
    "Y": "11110A04040404", "Q": "0E11111115120D",
    "Z": "1F01020408101F",
    "0": "0E11131519110E", "1": "040C040404040E", "2": "0E11010204081F", "3": "1F02040201110E", "4": "02060A121F0202",
    "5": "1F101E0101110E", "6": "0608101E11110E", "7": "1F010204080808", "8": "0E11110E11110E", "9": "0E11110F01020C",
    ".": "00000000000C0C", "%": "18190204081303", ",": "000000000C0408",
}


def caption_rows(text, scale):
    rows = np.zeros((7, 6 * len(text)), bool)
    for i, letter in enumerate(text.upper()):
        bits = bytes.fromhex(GLYPHS[letter] if letter != " " else "00" * 7)
        for y, row in enumerate(bits):
            rows[y, 6 * i:6 * i + 5] = [row >> (4 - x) & 1 for x in range(5)]
    return rows.repeat(scale, 0).repeat(scale, 1)


def headline(text, width):
    """The head of a panel, CAPTION x width x 3 bytes."""
    head = np.empty((CAPTION, width, 3), np.uint8)
    head[:] = PAPER
    rows = caption_rows(text, 2)
    head[16:16 + rows.shape[0], 12:12 + rows.shape[1]][rows] = INK
    return head


def view_from(eye, points, margin):
    """-> the view of draw() that has all points, seen from the direction `eye` with y upwards."""
    eye = np.asarray(eye, float) / np.linalg.norm(eye)
    right = np.cross([0, 1.0, 0], eye)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(eye, right), eye])
    centre = (points.min(0) + points.max(0)) / 2
    return axes, centre, margin * np.abs((points - centre) @ axes[:2].T).max()


def read_obj(path):
    """-> points, faces of any size, UVs of their corners one after the other."""
    points, coordinates, faces, uvs = [], [], [], []
    for line in path.read_text().splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            points.append([float(x) for x in rest[:3]])
        elif word == "vt":
            coordinates.append([float(x) for x in rest[:2]])
        elif word == "f":
            corners = [[int(number) - 1 for number in corner.split("/")[:2]] for corner in rest]
            faces.append([vertex for vertex, _ in corners])
            uvs += [coordinates[uv] for _, uv in corners]
    return np.array(points), faces, np.array(uvs)


def draw(points, faces, red_edges, view, paint=None, wires=True, size=SIZE):
    """One panel as size x size x 3 bytes. view: rows are the axes right, up, towards the eye; then centre and half width. paint:
    colours (h, w, 3) of face number f where its corners count weights[0..2], each (h, w). wires: all, none, or which edges."""
    axes, centre, half = view
    n = size * SUPERSAMPLING
    p = (np.asarray(points, float) - centre) @ axes.T
    distance = 6 * half  # of the eye
    depth = distance / (distance - p[:, 2])
    x = n / 2 + p[:, 0] * depth / half * n / 2
    y = n / 2 - p[:, 1] * depth / half * n / 2
    z = depth
    image = np.empty((n, n, 3))
    image[:] = PAPER
    nearest = np.zeros((n, n))
    red = {frozenset(e) for e in red_edges}
    wired = set() if isinstance(wires, bool) else {frozenset(e) for e in wires}
    light = np.array([0.35, 0.55, 0.76])
    for f, face in enumerate(faces):
        i, j, k = face
        normal = np.cross(p[j] - p[i], p[k] - p[i])
        length = np.linalg.norm(normal)
        area2 = (x[j] - x[i]) * (y[k] - y[i]) - (x[k] - x[i]) * (y[j] - y[i])
        if length == 0 or area2 >= 0:  # turned away (y points down)
            continue
        fx, fy = x[list(face)], y[list(face)]
        x0, x1 = max(int(fx.min()), 0), min(int(fx.max()) + 2, n)
        y0, y1 = max(int(fy.min()), 0), min(int(fy.max()) + 2, n)
        if x0 >= x1 or y0 >= y1:
            continue
        gx, gy = np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5)
        weights, inside = [], True
        for a, b in ((j, k), (k, i), (i, j)):  # weights[m] belongs to corner m, and to the edge opposite to it
            w = ((x[b] - x[a]) * (gy - y[a]) - (y[b] - y[a]) * (gx - x[a])) / area2
            weights.append(w)
            inside = inside & (w >= -1e-9)
        zz = weights[0] * z[i] + weights[1] * z[j] + weights[2] * z[k]
        inside &= zz > nearest[y0:y1, x0:x1] * (1 + 1e-9)
        if not inside.any():
            continue
        shade = 0.45 + 0.55 * max(0.0, float(normal @ light) / length)
        if paint is None:
            base = np.broadcast_to((205, 218, 232), (*gx.shape, 3))
        else:  # weights on the face rather than on the screen
            base = paint(f, [weight * z[corner] / zz for weight, corner in zip(weights, face)])
        colour = base * shade
        for m, (a, b) in enumerate(((j, k), (k, i), (i, j))):
            edge = frozenset((a, b))
            is_red = edge in red
            if wires is True or is_red or edge in wired:
                pixels = weights[m] * -area2 / np.hypot(x[b] - x[a], y[b] - y[a])
                colour[pixels < (1.5 if is_red else 0.45) * SUPERSAMPLING] = RED if is_red else INK
        nearest[y0:y1, x0:x1][inside] = zz[inside]
        image[y0:y1, x0:x1][inside] = colour[inside]
    return image.reshape(size, SUPERSAMPLING, size, SUPERSAMPLING, 3).mean((1, 3)).astype(np.uint8)


def write_png(path, image):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    height, width, _ = image.shape
    rows = b"".join(b"\0" + image[y].tobytes() for y in range(height))
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)) +
                  chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def draw_panels(path, panels):
    """panels: (caption, points, faces, red edges); all drawn with the view of the first, two in a row."""
    first = np.asarray(panels[0][1], float)
    eye = np.array([0.42, -0.62, 0.66])
    eye /= np.linalg.norm(eye)
    right = np.cross([0, 0, 1.0], eye)
    right /= np.linalg.norm(right)
    centre = (first.min(0) + first.max(0)) / 2
    view = np.array([right, np.cross(eye, right), eye]), centre, 1.1 * np.abs(first - centre).max()
    cells = []
    for caption, points, faces, red_edges in panels:
        cell = np.empty((SIZE + CAPTION, SIZE, 3), np.uint8)
        cell[:] = PAPER
        cell[CAPTION:] = draw(points, faces, red_edges, view)
        text = caption_rows(caption, 2)
        cell[20:20 + text.shape[0], 20:20 + text.shape[1]][text] = INK
        cells.append(cell)
    if len(cells) % 2:
        cells.append(np.full_like(cells[0], 250))
    write_png(path, np.vstack([np.hstack(cells[i:i + 2]) for i in range(0, len(cells), 2)]))
