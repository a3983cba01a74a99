"""Mass for massless bodies, because PhysX needs some in every link: as src/model/massless.h lends it."""

import numpy as np

MOST_LENT = 0.5  # of a body's mass, to all its borrowers
LARGEST_SHARE = 0.1


def rotation_of(q):
    w, x, y, z = np.asarray(q, dtype=float) / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


class Bodies:
    """mass, centre of mass and inertia of each body in its frame, as PhysX gets them; `lender`, the body that a massless one
    borrows from, -1 for the others; `kept`, the part of its inertia that a lender keeps."""

    def __init__(self, model, share):
        self.mass = [body.mass for body in model.bodies]
        self.centre = [np.array(body.p_BBcm) for body in model.bodies]
        self.inertia = [np.array(body.I_BBcm_B) for body in model.bodies]
        self.lender = lenders(model)
        self.kept = [1.0] * len(model.bodies)
        borrowers = [self.lender.count(i) for i in range(len(model.bodies))]
        if not any(borrowers):
            return
        frames = reference_frames(model)
        lent = [0.0] * len(model.bodies)
        for i, lender in enumerate(self.lender):
            if lender < 0:
                continue
            most, of = MOST_LENT / borrowers[lender], model.bodies[lender]
            (R, p), (R_lender, p_lender) = frames[i], frames[lender]
            self.mass[i] = min(share, most) * of.mass
            self.centre[i] = R.T @ (p_lender + R_lender @ np.array(of.p_BBcm) - p)
            turned = R.T @ R_lender
            inertia = turned @ np.array(of.I_BBcm_B) @ turned.T
            part = min(inertia_share(model, model.bodies[i], inertia, share), most)
            self.inertia[i] = part * inertia
            lent[lender] += part
        for i, count in enumerate(borrowers):
            if count > 0:
                self.mass[i] *= 1 - count * min(share, MOST_LENT / count)
                self.kept[i] = 1 - lent[i]
                self.inertia[i] = self.inertia[i] * self.kept[i]


def lenders(model):
    """Where a massless body's chain leads to: in a branch to the heaviest body."""
    lender = [-1] * len(model.bodies)
    for i in reversed(range(len(model.bodies))):  # children come before their parents
        body = model.bodies[i]
        candidate = lender[i] if body.is_massless else i
        if candidate < 0 or body.parent < 0 or not model.bodies[body.parent].is_massless:
            continue
        best = lender[body.parent]
        if best < 0 or model.bodies[candidate].mass >= model.bodies[best].mass:
            lender[body.parent] = candidate
    return lender


def reference_frames(model):
    frames = []
    for body in model.bodies:
        R, p = rotation_of(body.X_PB.q), np.array(body.X_PB.p)
        if body.parent >= 0:
            R_parent, p_parent = frames[body.parent]
            R, p = R_parent @ R, p_parent + R_parent @ p
        frames.append((R, p))
    return frames


def inertia_share(model, borrower, inertia, share):
    """More than `share` where armature of the borrower's hinge hides it."""
    if borrower.joint < 0:
        return share
    joint = model.joints[borrower.joint]
    if joint.is_slide or joint.armature <= 0:
        return share
    axis = np.array(joint.axis_B)
    return min(LARGEST_SHARE, share * (1 + joint.armature / (axis @ inertia @ axis)))
