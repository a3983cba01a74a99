# Rigid poses, and mass, centre and inertia of shapes. SI units; columns: pose(x) = rotation * x + translation.
import math

from pxr import Gf


class Pose:
    def __init__(self, rotation=None, translation=None):
        self.rotation = Gf.Quatd(1) if rotation is None else Gf.Quatd(rotation).GetNormalized()
        self.translation = Gf.Vec3d(0) if translation is None else Gf.Vec3d(translation)

    def __mul__(self, other):
        return Pose(self.rotation * other.rotation, self.rotation.Transform(other.translation) + self.translation)

    def inverse(self):
        back = self.rotation.GetInverse()
        return Pose(back, -back.Transform(self.translation))

    def apply(self, point):
        return self.rotation.Transform(Gf.Vec3d(point)) + self.translation

    def columns(self):
        return [self.rotation.Transform(Gf.Vec3d(*row)) for row in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]


AXES = {"X": Gf.Vec3d(1, 0, 0), "Y": Gf.Vec3d(0, 1, 0), "Z": Gf.Vec3d(0, 0, 1)}


def turn(axis, angle):
    """Rotation about a unit axis by an angle in rad."""
    return Gf.Quatd(math.cos(angle / 2), axis * math.sin(angle / 2))


def turned_by(rotation, axis):
    """The angle, in (-pi, pi], of the part of a rotation about a unit axis."""
    angle = 2 * math.atan2(Gf.Dot(rotation.GetImaginary(), axis), rotation.GetReal())
    return math.remainder(angle, 2 * math.pi)


def angle_of(rotation):
    """0 to pi."""
    return 2 * math.atan2(rotation.GetImaginary().GetLength(), abs(rotation.GetReal()))


# What a shape's own axis is to MuJoCo's, which is z.
def axis_to_z(axis):
    if axis == "X":
        return turn(AXES["Y"], math.pi / 2)
    if axis == "Y":
        return turn(AXES["X"], -math.pi / 2)
    return Gf.Quatd(1)


# ---- mass properties: (volume or mass, centre, inertia about the centre as 3 x 3 rows) ---------------------------------


def diagonal(x, y, z):
    return [[x, 0, 0], [0, y, 0], [0, 0, z]]


def possible(moments):
    """Principal moments without what single precision takes from flat bodies: no moment above the sum of the others."""
    small, middle, large = sorted(moments)
    lack = large - small - middle
    spare = 1e-7 * large
    return [each + lack + spare for each in moments] if -spare < lack <= 1e-5 * large else list(moments)


def rotated(inertia, rotation):
    """R I R^T."""
    r = Pose(rotation).columns()  # r[j][i]: row i of column j
    return [[sum(r[k][i] * inertia[k][m] * r[m][j] for k in range(3) for m in range(3)) for j in range(3)] for i in range(3)]


def shifted(inertia, mass, offset):
    """From about the centre of mass to about a point at `offset` from it."""
    square = Gf.Dot(offset, offset)
    return [
        [inertia[i][j] + mass * ((square if i == j else 0) - offset[i] * offset[j]) for j in range(3)] for i in range(3)
    ]


def placed(part, pose):
    mass, centre, inertia = part
    return mass, pose.apply(centre), rotated(inertia, pose.rotation)


def scaled(part, factor):
    mass, centre, inertia = part
    return mass * factor, centre, [[each * factor for each in row] for row in inertia]


def total(parts):
    mass = sum(part[0] for part in parts)
    if mass <= 0:
        return 0.0, Gf.Vec3d(0), diagonal(0, 0, 0)
    centre = sum((part[1] * part[0] for part in parts), Gf.Vec3d(0)) / mass
    inertia = diagonal(0, 0, 0)
    for each, at, own in parts:
        moved = shifted(own, each, at - centre)
        inertia = [[inertia[i][j] + moved[i][j] for j in range(3)] for i in range(3)]
    return mass, centre, inertia


def box(x, y, z):
    """Of half extents."""
    volume = 8 * x * y * z
    return volume, Gf.Vec3d(0), diagonal(*(volume / 3 * (a * a + b * b) for a, b in ((y, z), (x, z), (x, y))))


def ellipsoid(x, y, z):
    volume = 4 / 3 * math.pi * x * y * z
    return volume, Gf.Vec3d(0), diagonal(*(volume / 5 * (a * a + b * b) for a, b in ((y, z), (x, z), (x, y))))


def cylinder(radius, half):
    volume = 2 * math.pi * radius**2 * half
    side = volume * (radius**2 / 4 + half**2 / 3)
    return volume, Gf.Vec3d(0), diagonal(side, side, volume * radius**2 / 2)


def capsule(radius, half):
    middle, ball = cylinder(radius, half), 4 / 3 * math.pi * radius**3
    # of both halves of the ball, whose centres are 3/8 of the radius beyond the cylinder's ends
    side = ball * (0.4 * radius**2 + half**2 + 0.75 * half * radius)
    along = 0.4 * ball * radius**2
    inertia = [[middle[2][i][j] + (0 if i != j else along if i == 2 else side) for j in range(3)] for i in range(3)]
    return middle[0] + ball, Gf.Vec3d(0), inertia


def solid(points, triangles):
    """What closed triangles enclose; a volume of 0 or less says that they do not."""
    volume, moment = 0.0, Gf.Vec3d(0)
    second = diagonal(0, 0, 0)
    for i, j, k in triangles:
        a, b, c = points[i], points[j], points[k]
        six = Gf.Dot(a, Gf.Cross(b, c))
        s = a + b + c
        volume += six / 6
        moment += s * (six / 24)
        for u in range(3):
            for v in range(u, 3):
                second[u][v] += six / 120 * (a[u] * a[v] + b[u] * b[v] + c[u] * c[v] + s[u] * s[v])
    if volume <= 0:
        return 0.0, Gf.Vec3d(0), diagonal(0, 0, 0)
    centre = moment / volume
    for u in range(3):
        for v in range(u + 1):
            second[u][v] = second[v][u]
    trace = second[0][0] + second[1][1] + second[2][2]
    about_origin = [[(trace if u == v else 0) - second[u][v] for v in range(3)] for u in range(3)]
    square = Gf.Dot(centre, centre)
    inertia = [
        [about_origin[u][v] - volume * ((square if u == v else 0) - centre[u] * centre[v]) for v in range(3)]
        for u in range(3)
    ]
    return volume, centre, inertia


def is_closed(triangles):
    edges = {}
    for i, j, k in triangles:
        for edge in ((i, j), (j, k), (k, i)):
            edges[edge] = edges.get(edge, 0) + 1
    return bool(edges) and all(count == 1 and edges.get((b, a)) == 1 for (a, b), count in edges.items())


def hull(points):
    """Triangles of the convex hull, outwards (quickhull, Barber et al. 1996); none of points in one plane."""
    if len(points) < 4:
        return []
    size = max(max(p[i] for p in points) - min(p[i] for p in points) for i in range(3))
    thin = 1e-10 * size
    a = min(range(len(points)), key=lambda i: tuple(points[i]))
    b = max(range(len(points)), key=lambda i: (points[i] - points[a]).GetLength())
    line = (points[b] - points[a]).GetNormalized()
    c = max(range(len(points)), key=lambda i: Gf.Cross(points[i] - points[a], line).GetLength())
    normal = Gf.Cross(points[b] - points[a], points[c] - points[a])
    if normal.GetLength() <= thin * size:
        return []
    normal = normal.GetNormalized()
    d = max(range(len(points)), key=lambda i: abs(Gf.Dot(points[i] - points[a], normal)))
    height = Gf.Dot(points[d] - points[a], normal)
    if abs(height) <= 1e-9 * size:
        return []
    if height > 0:
        b, c = c, b

    faces, next_face = {}, 0  # number: [corners, normal, offset, points outside]
    owner = {}  # directed edge: face

    def add(i, j, k, candidates):
        nonlocal next_face
        normal = Gf.Cross(points[j] - points[i], points[k] - points[i])
        length = normal.GetLength()
        normal = normal / length if length > 0 else normal
        offset = Gf.Dot(normal, points[i])
        outside, left = [], []
        for p in candidates:
            (outside if Gf.Dot(normal, points[p]) - offset > thin else left).append(p)
        faces[next_face] = [(i, j, k), normal, offset, outside]
        for edge in ((i, j), (j, k), (k, i)):
            owner[edge] = next_face
        next_face += 1
        return left

    left = [i for i in range(len(points)) if i not in (a, b, c, d)]
    for corners in ((a, b, c), (a, d, b), (b, d, c), (c, d, a)):
        left = add(*corners, left)
    waiting = list(faces)
    while waiting:
        number = waiting.pop()
        if number not in faces or not faces[number][3]:
            continue
        _, normal, _, outside = faces[number]
        top = max(outside, key=lambda p: Gf.Dot(normal, points[p]))
        seen, border, stack = {number}, [], [number]
        while stack:
            i, j, k = faces[stack.pop()][0]
            for edge in ((i, j), (j, k), (k, i)):
                other = owner[edge[::-1]]
                if other in seen:
                    continue
                if Gf.Dot(faces[other][1], points[top]) - faces[other][2] > thin:
                    seen.add(other)
                    stack.append(other)
                else:
                    border.append(edge)
        candidates = [p for each in seen for p in faces[each][3] if p != top]
        for each in seen:
            del faces[each]
        for i, j in border:
            fresh = next_face
            candidates = add(i, j, top, candidates)
            waiting.append(fresh)
    return [face[0] for face in faces.values()]
