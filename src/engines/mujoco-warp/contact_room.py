"""How many contacts and constraint rows MuJoCo Warp and Newton get room for."""

# contact points that two shapes have at most
POINTS = {frozenset(("plane", "capsule")): 2, frozenset(("plane", "box")): 4, frozenset(("plane", "cylinder")): 4,
          frozenset(("plane", "hull")): 4, frozenset(("capsule",)): 2, frozenset(("capsule", "box")): 2}
ON_FIELD = 50  # of a shape on a height field
ROWS = {"pyramidal": {1: 1, 3: 4, 4: 6, 6: 10}, "elliptic": {1: 1, 3: 3, 4: 4, 6: 6}}


def dimension(pair):
    """Rows of a contact. One without friction has one: MuJoCo would raise a zero coefficient to a small one."""
    if pair.rolling > 0:
        return 6
    if pair.torsional > 0:
        return 4
    return 3 if pair.friction > 0 else 1


def contact_room(model, settings, known):
    """Contacts that there is room for: no more than all pairs can fill, and no more than eight points a body (beside those on
    height fields) unless asked for. `known` has the points of pairs of shapes that have less than eight."""
    points = 0
    for pair in model.contacts:
        kinds = {model.shapes[pair.shape_a].type, model.shapes[pair.shape_b].type}
        points += known.get(frozenset(kinds), ON_FIELD if "height-field" in kinds else 1 if "sphere" in kinds else 8)
    most = 8 * len(model.bodies) + 8 + ON_FIELD * len(model.height_fields)
    return settings["max_contacts"] or min(points, most)


def capacity(model, settings):
    """Contacts and constraint rows that MuJoCo Warp has room for. A step's cost grows with both."""
    contacts = contact_room(model, settings, POINTS)
    rows = max((ROWS[settings["cone"]][dimension(pair)] for pair in model.contacts), default=0)
    joints = [*model.joints, *model.balls, *model.tendons]
    others = sum(3 if hasattr(joint, "spring_reference") and isinstance(joint.spring_reference, list) else 1
                 for joint in joints if joint.dry_friction > 0)
    others += sum(2 if hasattr(joint, "lower") else 1 for joint in joints if joint.limited)
    others += len(model.couplings) + 3 * len(model.connects) + 6 * len(model.welds)
    return contacts, max(1, contacts * rows + others)
