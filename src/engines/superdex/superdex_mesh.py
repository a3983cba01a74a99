"""Closed triangle meshes of shapes, in their own frames: SuperDex's contact points are the quadrature points of such a mesh.
Each function gives vertices (n, 3) in m and faces (m, 3), counter-clockwise from outside."""

import numpy as np


def of(model, shape, cells):
    """`cells`: how many cells a quarter of a turn, or half of a box's edge, is divided into."""
    if shape.type == "sphere":
        return scaled(ball(cells), [shape.radius] * 3)
    if shape.type == "ellipsoid":
        return scaled(ball(cells), shape.half_size)
    if shape.type == "capsule":
        return capsule(shape.radius, shape.half_length, cells)
    if shape.type == "cylinder":
        return cylinder(shape.radius, shape.half_length, cells)
    if shape.type == "box":
        return box(shape.half_size, cells)
    if shape.type == "hull":
        hull = model.hulls[shape.data]
        return divided(np.array(hull.vertices), np.array(hull.faces), cells)
    return height_field(model.height_fields[shape.data])


def scaled(mesh, factors):
    return mesh[0] * np.array(factors), mesh[1]


def split(vertices, faces):
    """Each triangle as four."""
    vertices, middle, made = list(vertices), {}, []

    def half(a, b):
        key = (a, b) if a < b else (b, a)
        if key not in middle:
            middle[key] = len(vertices)
            vertices.append((vertices[a] + vertices[b]) / 2)
        return middle[key]

    for a, b, c in faces:
        ab, bc, ca = half(a, b), half(b, c), half(c, a)
        made += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return np.array(vertices), np.array(made)


def ball(cells):
    """A divided icosahedron with the volume of the unit ball."""
    g = (1 + 5 ** 0.5) / 2
    vertices = np.array([(s * a, t * b, 0) for a, b in ((1, g),) for s in (-1, 1) for t in (-1, 1)], dtype=float)
    vertices = np.concatenate([np.roll(vertices, k, axis=1) for k in range(3)])
    edge = 2.0
    near = [(i, j, k) for i in range(12) for j in range(i) for k in range(j)
            if all(abs(np.linalg.norm(vertices[a] - vertices[b]) - edge) < 1e-9 for a, b in ((i, j), (j, k), (k, i)))]
    faces = np.array([(a, b, c) if np.dot(np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a]), vertices[a]) > 0
                      else (a, c, b) for a, b, c in near])
    vertices /= np.linalg.norm(vertices[0])
    for _ in range(max(1, int(np.ceil(np.log2(cells / 1.42))))):  # an edge of the icosahedron is 1 / 1.42 of a quarter
        vertices, faces = split(vertices, faces)
        vertices /= np.linalg.norm(vertices, axis=1)[:, None]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = np.sum(a * np.cross(b, c)) / 6
    return vertices * (4 / 3 * np.pi / volume) ** (1 / 3), faces


def turned(profile, around):
    """The surface that a profile of points (r, z), upwards from the axis to the axis, makes about z."""
    angles = 2 * np.pi * (np.arange(around) + 0.5) / around  # sides, not edges, point along the axes
    # the polygon's area is the circle's
    wider = np.sqrt(2 * np.pi / around / np.sin(2 * np.pi / around))
    rings = [np.stack([r * wider * np.cos(angles), r * wider * np.sin(angles), np.full(around, z)], axis=1)
             for r, z in profile[1:-1]]
    vertices = np.concatenate([[(0, 0, profile[0][1])], *rings, [(0, 0, profile[-1][1])]])
    faces, last, top = [], len(vertices) - 1, 1 + (len(rings) - 1) * around
    for j in range(around):
        k = (j + 1) % around
        faces += [(0, 1 + k, 1 + j), (last, top + j, top + k)]
        for ring in range(len(rings) - 1):
            a, b = 1 + ring * around + j, 1 + ring * around + k
            faces += [(a, b, b + around), (a, b + around, a + around)]
    return vertices, np.array(faces)


def capsule(radius, half_length, cells):
    quarter = np.pi / 2 * np.arange(1, cells + 1) / cells
    side = max(1, round(2 * half_length * cells / radius / 5))
    up = [(radius * np.sin(a), -half_length - radius * np.cos(a)) for a in quarter]
    up += [(radius, half_length * (2 * i / side - 1)) for i in range(1, side + 1)]
    up += [(radius * np.cos(a), half_length + radius * np.sin(a)) for a in quarter[:-1]]
    return turned([(0, -half_length - radius), *up, (0, half_length + radius)], 8 * cells)


def graded(count):
    """From -1 to 1, denser at the ends, where a body that tips stands."""
    return -np.cos(np.pi * np.arange(count + 1) / count)


def cylinder(radius, half_length, cells):
    rings = [(radius * np.sin(np.pi / 2 * i / cells), -half_length) for i in range(1, cells + 1)]
    side = [(radius, half_length * z) for z in graded(cells)[1:]]
    return turned([(0, -half_length), *rings, *side, *((r, half_length) for r, _ in rings[-2::-1]), (0, half_length)],
                  20 * cells)  # with fewer it loses speed as it rolls, and rests on its sides


def box(half_size, cells):
    steps, count = graded(2 * cells), 2 * cells + 1
    number, vertices, faces = {}, [], []

    def vertex(*at):
        if at not in number:
            number[at] = len(vertices)
            vertices.append([half * steps[i] for half, i in zip(half_size, at)])
        return number[at]

    for axis in range(3):
        one, two = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, count - 1):
            def corner(i, j):
                at = [0, 0, 0]
                at[axis], at[one], at[two] = end, i, j
                return vertex(*at)

            for i in range(count - 1):
                for j in range(count - 1):
                    a, b, c, d = corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)
                    faces += [(a, b, c), (a, c, d)] if end else [(a, c, b), (a, d, c)]
    return np.array(vertices), np.array(faces)


def divided(vertices, faces, cells):
    """A hull with its faces divided, finely where they end at an edge, on which a body that tips stands. Neighbours are divided
    apart from each other, which leaves no gaps between flat faces."""
    size = np.ptp(vertices, axis=0).max()
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    across = {}
    for face, (a, b, c) in enumerate(faces.tolist()):
        for edge in ((a, b), (b, c), (c, a)):
            across.setdefault(frozenset(edge), []).append(face)
    # by edge from each corner to the next: whether the surface bends there
    bent = np.array([[any(normals[face] @ normals[other] < 0.95 for other in across[frozenset(edge)])
                      for edge in ((a, b), (b, c), (c, a))] for face, (a, b, c) in enumerate(faces.tolist())])
    done = []
    while len(corners) and sum(map(len, done)) + 4 * len(corners) < 40000:
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        longest = np.max([np.linalg.norm(b - a, axis=1), np.linalg.norm(c - b, axis=1), np.linalg.norm(a - c, axis=1)], axis=0)
        fine = longest <= size / np.where(bent.any(axis=1), 6 * cells, cells)
        done.append(corners[fine])
        (a, b, c), (ab, bc, ca) = (each[~fine] for each in (a, b, c)), bent[~fine].T
        m, n, o, no = (a + b) / 2, (b + c) / 2, (c + a) / 2, np.zeros(len(a), dtype=bool)
        corners = np.concatenate([np.stack(each, axis=1) for each in ((a, m, o), (b, n, m), (c, o, n), (m, n, o))])
        bent = np.concatenate([np.stack(each, axis=1) for each in ((ab, no, ca), (bc, no, ab), (ca, no, bc), (no, no, no))])
    corners = np.concatenate([*done, corners])
    return corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)


def height_field(field):
    """The solid below the surface, down to the base."""
    rows, columns = field.rows, field.columns
    x, y = np.linspace(-field.half_x, field.half_x, columns), np.linspace(-field.half_y, field.half_y, rows)
    top = np.array([(x[j], y[i], field.heights[i * columns + j]) for i in range(rows) for j in range(columns)])
    bottom = top * [1, 1, 0] - [0, 0, max(field.base, 1e-3)]
    under, faces = len(top), []
    for i in range(rows - 1):
        for j in range(columns - 1):
            a = i * columns + j
            b, c, d = a + 1, a + columns + 1, a + columns
            # the diagonal is that of MuJoCo's prisms
            faces += [(a, b, d), (b, c, d), (under + a, under + d, under + b), (under + b, under + d, under + c)]
    rim = [j for j in range(columns)] + [i * columns + columns - 1 for i in range(1, rows)]
    rim += [(rows - 1) * columns + j for j in range(columns - 2, -1, -1)] + [i * columns for i in range(rows - 2, 0, -1)]
    for a, b in zip(rim, rim[1:] + rim[:1]):
        faces += [(a, under + a, b), (b, under + a, under + b)]
    return np.concatenate([top, bottom]), np.array(faces)


# ---- signed distances, negative inside: SuperDex takes them from a grid where a shape is neither a ball nor a box ---------

def distance(model, shape, points):
    """Of points (n, 3) in the shape's frame; outside, where contacts do not push, a lower bound is enough."""
    if shape.type == "capsule":
        z = np.clip(points[:, 2], -shape.half_length, shape.half_length)
        return np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2 + (points[:, 2] - z) ** 2) - shape.radius
    if shape.type == "cylinder":
        side = np.hypot(points[:, 0], points[:, 1]) - shape.radius
        return np.maximum(side, np.abs(points[:, 2]) - shape.half_length)
    if shape.type == "ellipsoid":
        return ellipsoid_distance(np.array(shape.half_size), points)
    if shape.type == "hull":
        hull = model.hulls[shape.data]
        vertices, faces = np.array(hull.vertices), np.array(hull.faces)
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        lengths = np.linalg.norm(normals, axis=1)
        normals = normals[lengths > 0] / lengths[lengths > 0, None]
        planes = np.unique(np.round(np.c_[normals, np.sum(normals * a[lengths > 0], axis=1)], 12), axis=0)
        return np.max(points @ planes[:, :3].T - planes[:, 3], axis=1)
    return field_distance(model.height_fields[shape.data], points)


def ellipsoid_distance(half, points):
    """To the nearest point x = p a^2 / (a^2 + t) of the surface, by Newton's method on its condition for t."""
    p, square = np.abs(points), half**2
    smallest = np.argmin(half)
    t = -square[smallest] + half[smallest] * np.maximum(p[:, smallest], 1e-6 * half[smallest])
    for _ in range(12):  # from below: the condition is convex there
        q = half * p / (square + t[:, None])
        t += (np.sum(q * q, axis=1) - 1) / np.sum(2 * q * q / (square + t[:, None]), axis=1)
    nearest = p * square / (square + t[:, None])
    inside = np.sum((p / half) ** 2, axis=1) < 1
    return np.linalg.norm(p - nearest, axis=1) * np.where(inside, -1, 1)


def field_distance(field, points):
    """Along the normal of the triangle above or below."""
    heights = np.reshape(np.array(field.heights), (field.rows, field.columns))
    dx, dy = 2 * field.half_x / (field.columns - 1), 2 * field.half_y / (field.rows - 1)
    u, v = (points[:, 0] + field.half_x) / dx, (points[:, 1] + field.half_y) / dy
    j, i = (np.clip(np.floor(each).astype(int), 0, most - 2) for each, most in ((u, field.columns), (v, field.rows)))
    u, v = u - j, v - i
    a, b, c, d = heights[i, j], heights[i, j + 1], heights[i + 1, j + 1], heights[i + 1, j]
    near = u + v <= 1
    along, across = np.where(near, b - a, c - d), np.where(near, d - a, c - b)
    height = np.where(near, a + u * (b - a) + v * (d - a), c + (1 - u) * (d - c) + (1 - v) * (b - c))
    top = (points[:, 2] - height) / np.sqrt(1 + (along / dx) ** 2 + (across / dy) ** 2)
    side = np.maximum(np.abs(points[:, 0]) - field.half_x, np.abs(points[:, 1]) - field.half_y)
    return np.maximum(np.maximum(top, side), -max(field.base, 1e-3) - points[:, 2])


def grid(model, shape, vertices, cells):
    """Signed distances on a grid around the mesh: its lower and upper corner, the mesh's, numbers along x, y, z, values with z
    changing fastest."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = high - low
    if shape.type == "height-field":
        field = model.height_fields[shape.data]
        count = np.array([4 * (field.columns - 1) + 3, 4 * (field.rows - 1) + 3, 4 * cells])
    else:
        count = np.ceil(size / np.min(size) * 2 * cells).astype(int) + 3
    step = size / (count - 3)
    first, last = low - step, high + step
    axes = [np.linspace(first[k], last[k], count[k]) for k in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return first, last, low, high, count, distance(model, shape, points)
