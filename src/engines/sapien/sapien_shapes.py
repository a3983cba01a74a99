"""The model's shapes as SAPIEN's, and which of them touch."""

import math

import collision_groups
import shape_friction

SIDES = 64  # of the prism that stands for a cylinder


class Parts:
    """The shapes as SAPIEN gets them. PhysX takes the mean of two materials' friction. Where a coefficient for each shape gives
    every pair its own, a shape is one part; otherwise it has a part for each of its coefficients, and only equal ones touch.

    `of`: (shape, friction) of each part; `groups`: its collision groups, or None where SAPIEN's bits do not suffice."""

    def __init__(self, model):
        friction = shape_friction.friction_of_shapes(model)
        if friction is not None:
            self.of = sorted(friction.items())
            pairs = [((pair.shape_a, friction[pair.shape_a]), (pair.shape_b, friction[pair.shape_b]))
                     for pair in model.contacts]
        else:
            pairs = [((pair.shape_a, pair.friction), (pair.shape_b, pair.friction)) for pair in model.contacts]
            self.of = sorted({part for pair in pairs for part in pair})
        number = {part: i for i, part in enumerate(self.of)}
        touch = [0] * len(self.of)
        for a, b in pairs:
            touch[number[a]] |= 1 << number[b]
            touch[number[b]] |= 1 << number[a]
        self.groups = collision_groups.groups(len(self.of), touch, self.ignored(model))

    def ignored(self, model):
        """Pairs that PhysX leaves out: of one body, and of a link and its parent."""
        on = {}
        for i, (shape, _) in enumerate(self.of):
            body = model.shapes[shape].body
            on[body] = on.get(body, 0) | 1 << i
        masks = []
        for shape, _ in self.of:
            body = model.shapes[shape].body
            mask = on[body]
            if body >= 0 and model.bodies[body].parent >= 0:
                mask |= on.get(model.bodies[body].parent, 0)
            for child, its_parts in on.items():
                if child >= 0 and body >= 0 and model.bodies[child].parent == body:
                    mask |= its_parts
            masks.append(mask)
        return masks


def are_neighbours(model, a, b):
    """Whether two bodies are a link and its parent."""
    return a >= 0 and b >= 0 and (model.bodies[a].parent == b or model.bodies[b].parent == a)


def held_together(model):
    """Pairs of bodies whose contacts a D6 joint between them switches off; one to the world leaves the world's shapes."""
    return {frozenset((each.body_a, each.body_b)) for each in (*model.connects, *model.welds) if min(each.body_a, each.body_b) >= 0}


def extent(model, shape):
    """The largest, m; 0 for planes and height fields, as shape_extent() of engines/adapter.h."""
    if shape.type == "sphere":
        return 2 * shape.radius
    if shape.type == "capsule":
        return 2 * (shape.radius + shape.half_length)
    if shape.type == "cylinder":
        return 2 * max(shape.radius, shape.half_length)
    if shape.type == "box":
        return 2 * max(shape.half_size)
    if shape.type == "hull":
        vertices = model.hulls[shape.data].vertices
        return max(max(v[k] for v in vertices) - min(v[k] for v in vertices) for k in range(3))
    return 0.0


def mean_extent(model):
    """Of the shapes that touch something, without those of the world; m."""
    touching = {shape for pair in model.contacts for shape in (pair.shape_a, pair.shape_b)}
    sizes = [extent(model, model.shapes[i]) for i in sorted(touching) if model.shapes[i].body >= 0]
    return sum(sizes) / len(sizes) if sizes else 1.0


def prism(shape):
    """A cylinder's vertices as a prism, as far outside of it as inside."""
    radius = shape.radius * 2 / (1 + math.cos(math.pi / SIDES))
    return [(radius * math.cos(2 * math.pi * i / SIDES), radius * math.sin(2 * math.pi * i / SIDES), z)
            for i in range(SIDES) for z in (-shape.half_length, shape.half_length)]


def field_mesh(field):
    """Vertices and triangles of a height field; the diagonals run from (row, column + 1) to (row + 1, column)."""
    rows, columns = field.rows, field.columns
    vertices = [(-field.half_x + column * 2 * field.half_x / (columns - 1), -field.half_y + row * 2 * field.half_y / (rows - 1),
                 field.heights[row * columns + column]) for row in range(rows) for column in range(columns)]
    triangles = []
    for row in range(rows - 1):
        for column in range(columns - 1):
            a = row * columns + column
            triangles += [(a, a + 1, a + columns), (a + 1, a + columns + 1, a + columns)]
    return vertices, triangles
