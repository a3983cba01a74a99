"""Friction of shapes for a solver that takes the mean of two."""


def friction_of_shapes(model):
    """Of each shape the coefficient that gives every pair its own as the mean of two, or None where there are none.

    A pair ties its shapes: c of one is 2 mu - c of the other. So each shape's is an offset plus or minus that of the first of
    its group, which is chosen so that none is negative; a loop of an odd number of pairs decides it."""
    ties = {}
    for pair in model.contacts:
        ties.setdefault(pair.shape_a, []).append((pair.shape_b, pair.friction))
        ties.setdefault(pair.shape_b, []).append((pair.shape_a, pair.friction))
    found, tiny = {}, 1e-9
    for first in ties:
        if first in found:
            continue
        group, waiting, fixed = {first: (1, 0.0)}, [first], None
        while waiting:
            shape = waiting.pop()
            sign, offset = group[shape]
            for other, mu in ties[shape]:
                tied = (-sign, 2 * mu - offset)
                if other not in group:
                    group[other] = tied
                    waiting.append(other)
                elif group[other][0] == tied[0]:
                    if abs(group[other][1] - tied[1]) > tiny:
                        return None
                else:
                    value = (tied[1] - group[other][1]) / (group[other][0] - tied[0])
                    if fixed is not None and abs(fixed - value) > tiny:
                        return None
                    fixed = value
        least = max(-offset for sign, offset in group.values() if sign > 0)
        most = min((offset for sign, offset in group.values() if sign < 0), default=least)
        value = fixed if fixed is not None else (least + most) / 2
        if value < least - tiny or value > most + tiny:
            return None
        found.update({shape: max(0.0, sign * value + offset) for shape, (sign, offset) in group.items()})
    return found
