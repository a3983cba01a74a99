"""What Genesis has instead of contact pairs: bit masks of shapes, and friction of shapes, of which it takes the larger."""

import functools

BITS = 31  # of Genesis' 32-bit integers, without the sign


@functools.lru_cache(maxsize=16)
def masks_of(model):
    """Of each shape in a contact pair (its own bits, the bits of those that it collides with), or None where they do not suffice.

    A bit makes every shape of a set collide with every shape of another one. Each bit is grown from one shape and its partners
    by the shapes that have most of them in common. Shapes of one body do not collide in Genesis whatever their bits are."""
    partners = {}
    for pair in model.contacts:
        partners.setdefault(pair.shape_a, set()).add(pair.shape_b)
        partners.setdefault(pair.shape_b, set()).add(pair.shape_a)
    of_body = {}
    for shape in partners:
        of_body.setdefault(model.shapes[shape].body, set()).add(shape)
    if all(len(others | of_body[model.shapes[shape].body]) == len(partners) for shape, others in partners.items()):
        return {shape: (1, 1) for shape in partners}
    allowed = {shape: others | of_body[model.shapes[shape].body] for shape, others in partners.items()}
    waiting = {shape: set(others) for shape, others in partners.items()}
    masks = {shape: [0, 0] for shape in partners}
    for bit in range(BITS):
        first = max(waiting, key=lambda shape: len(waiting[shape]), default=None)
        if first is None or not waiting[first]:
            break
        own, others = {first}, set(allowed[first])
        gained = len(waiting[first])
        for shape in sorted(waiting, key=lambda shape: -len(allowed[shape] & others)):
            if shape in own:
                continue
            common = others & allowed[shape]
            gain = sum(len(waiting[each] & common) for each in own | {shape})
            if gain > gained:
                own, others, gained = own | {shape}, common, gain
        for shape in own:
            masks[shape][0] |= 1 << bit
            for other in waiting[shape] & others:
                waiting[other].discard(shape)
            waiting[shape] -= others
        for shape in others:
            masks[shape][1] |= 1 << bit
    return None if any(waiting.values()) else masks


@functools.lru_cache(maxsize=16)
def friction_of_shapes(model):
    """Sliding, torsional and rolling friction of each shape: the smallest of its pairs. None where the larger of two is not the
    pair's own: then no others give it either."""
    found = {}
    for pair in model.contacts:
        own = (pair.friction, pair.torsional, pair.rolling)
        for shape in (pair.shape_a, pair.shape_b):
            found[shape] = tuple(map(min, found.get(shape, own), own))
    for pair in model.contacts:
        if tuple(map(max, found[pair.shape_a], found[pair.shape_b])) != (pair.friction, pair.torsional, pair.rolling):
            return None
    return found
