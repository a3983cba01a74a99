# A stage that may read nothing outside the model's folder, its units, and an account of what was read of it.
import math
import os
import re

from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdPhysics

from geometry import AXES, Pose, turn

MOST_LAYERS = 2000


class Refusal(Exception):
    """What keeps the file from being read at all."""

    def __init__(self, message, mend="", option=""):
        super().__init__(message)
        self.problem = {"message": message, "mend": mend, "option": option}


def is_url(path):
    return re.match(r"[A-Za-z][A-Za-z0-9+.-]+:", path) is not None


def file_of(path):
    """Of a layer: "a.usdz[b.usd]" is in a.usdz."""
    return path.split("[")[0]


def is_below(path, root):
    return os.path.commonpath([os.path.realpath(path), os.path.realpath(root)]) == os.path.realpath(root)


def one_line(error):
    text = str(error)
    text = re.sub(r"Error in '.*?' at line \d+ in file \S+ : ", "", text, flags=re.S)
    return " ".join(text.replace("'", " ").split())[:300]


def open_layer(path, named):
    try:
        layer = Sdf.Layer.FindOrOpen(path)
    except Tf.ErrorException as error:
        raise Refusal(f"{named} is no USD: {one_line(error)}", "correct or replace it") from None
    if layer is None:
        raise Refusal(f"{named} cannot be opened as USD", "check that it is complete, and no other kind of file")
    return layer


def examine_layers(path, root, allow_external):
    """Opens the file, and all that it refers to in any variant, unless that lies elsewhere. What is not there is left to
    the composition, which may do without."""
    first = open_layer(path, "it")
    seen, waiting = {first.identifier}, [first]
    while waiting:
        layer = waiting.pop()
        own = file_of(layer.identifier)
        for asset in layer.GetCompositionAssetDependencies():
            if not asset or is_url(asset):
                continue
            target = Sdf.ComputeAssetPathRelativeToLayer(layer, asset)
            file = file_of(target)
            if not os.path.isabs(file):
                file = os.path.join(os.path.dirname(own), file)
            if not allow_external and not is_below(file, root):
                raise Refusal(
                    f"refers to the file '{os.path.normpath(file)}' (in '{os.path.relpath(own, root)}'), which lies "
                    f"outside the model's folder '{root}'",
                    "copy it there",
                    "--allow-external-files if you trust the model",
                )
            if not os.path.exists(file):
                continue
            if not os.path.isfile(file):
                raise Refusal(f"refers to '{asset}', which is not a regular file", "name a file")
            inner = open_layer(target if os.path.isabs(file_of(target)) else file, f"the file '{asset}'")
            if inner.identifier in seen:
                continue
            seen.add(inner.identifier)
            if len(seen) > MOST_LAYERS:
                raise Refusal(f"refers to more than {MOST_LAYERS} files", "flatten it")
            waiting.append(inner)
    return first


def check_composition(stage):
    """What cannot be composed is not read, so its robot would be another one."""
    for error in stage.GetCompositionErrors():
        text = str(error)
        if "ycle detected" in text:
            files = list(dict.fromkeys(os.path.basename(file) for file in re.findall(r"@([^@,]+)@(?:<|,)", text)))
            raise Refusal(f"its references are a cycle: {' -> '.join(files + files[:1])}", "remove one of them")
        missing = re.search(r"(?:Could not open asset|Could not load sublayer|Unable to open|Failed to open).*?@([^@]+)@", text)
        if missing is None:
            raise Refusal(f"cannot be composed: {one_line(text)}", "correct it")
        at = re.search(r"introduced by @[^@]*@<([^>]*)>", text)
        place = f" at <{at.group(1)}>" if at else ""
        if is_url(missing.group(1)):
            # OpenUSD takes it for a path
            url = re.sub(r"^([A-Za-z0-9+.-]+):/(?!/)", r"\1://", missing.group(1))
            raise Refusal(
                f"refers{place} to '{url}', and nothing is fetched from the network",
                "download it next to the model, and refer to that file",
            )
        raise Refusal(f"refers{place} to the file '{missing.group(1)}', which is not there", "add it, or remove the reference")


# ---- what was read, and what was not ------------------------------------------------------------------------------------

# Attributes and relationships that concern physics begin so. What is written below `physics` is UsdPhysics' own.
PHYSICAL = re.compile(
    r"^(physics|drive|limit|state|mjc|newton|physx[A-Za-z]*|omniphysics|physxvehicle|PhysxSchema)(:|$)|^isaac:physics"
)
# Of the contender or of the program that draws: no robot depends on them.
OF_CONTENDER = re.compile(
    r"^physxScene:|^newton:(maxSolver|timeSteps|xpbd|kamino|vbd|mpm|featherstone|semiImplicit|mujoco)|^mjc:(option|flag|compiler):"
    r"|^physxArticulation:(solver|sleep|stabilization)|^physxRigidBody:(solver|sleep|stabilization|maxDepenetration|"
    r"enableCCD|enableSpeculativeCCD|retain|contactSlop|solveContact|maxContactImpulse|enableGyroscopic)"
    r"|^physxCollision:(contactOffset|minTorsional)|^mjc:(sol|group|gap$|solmix|priority)|^physxLimit|"
    r"^newton:(limit|contact(Stiffness|Damping|Gap))|^physxMaterial:(compliant|improve)|^physx(ConvexHull|ConvexDecomposition|"
    r"TriangleMesh|TriangleMeshSimplification|SDFMesh|Cooked)|^newton:(sdf|maxHull|hydroelastic)|^physics:(simulationOwner|startsAsleep)$|"
    r"^mjc:maxhullvert$|^physxMimicJoint:[A-Za-z]+:(naturalFrequency|dampingRatio)$"
)


def is_idle(value):
    """A value that does nothing: 0, no limit, empty."""
    if value is None or value is False or value == "auto":
        return True
    if isinstance(value, str):
        return value == ""
    if isinstance(value, (int, float)):
        return value == 0 or abs(value) >= 1e30
    try:
        return all(is_idle(each) for each in value)
    except TypeError:
        return False


class Scene:
    """A composed stage in SI units, z up."""

    def __init__(self, stage, drop_unsupported):
        self.stage = stage
        self.drop = drop_unsupported
        self.notes, self.problems = [], []
        self.read = set()
        self.lists = {}
        self.metre = UsdGeom.GetStageMetersPerUnit(stage)
        self.kilogram = UsdPhysics.GetStageKilogramsPerUnit(stage)
        for name, value in (("metersPerUnit", self.metre), ("kilogramsPerUnit", self.kilogram)):
            if not (0 < value < math.inf):
                raise Refusal(f"{name} is {value:g}", "make it positive: 1 for metres and kilograms")
        given = stage.HasAuthoredMetadata("metersPerUnit")
        if self.metre != 1 or not given:
            self.note(
                f"lengths are converted to metres: metersPerUnit is {self.metre:g}"
                + ("" if given else ", which is USD's default where a file gives none")
            )
        if self.kilogram != 1:
            self.note(f"masses are converted to kilograms: kilogramsPerUnit is {self.kilogram:g}")
        self.up = UsdGeom.GetStageUpAxis(stage)
        self.turned = Pose()
        if self.up == "Y":
            self.turned = Pose(turn(AXES["X"], math.pi / 2))
            self.note("y is up in the file: the world is turned by 90 degrees about x, so that z is up")
        elif self.up == "X":
            self.turned = Pose(turn(AXES["Y"], -math.pi / 2))
            self.note("x is up in the file: the world is turned by -90 degrees about y, so that z is up")
        self.cache = UsdGeom.XformCache(Usd.TimeCode.Default())

    # ---- messages

    def note(self, text):
        if text not in self.notes:
            self.notes.append(text)

    def note_each(self, what, prim):
        """One note for all prims of which the same is to be said."""
        self.lists.setdefault(what, []).append(str(prim.GetPath()))

    def refuse(self, prim, message, mend="", option=""):
        self.problems.append(
            {"element": self.label(prim), "message": message, "mend": mend, "option": option, "left_out": False}
        )

    def unsupported(self, prim, message, mend, drop):
        """Refused, unless --drop-unsupported is given. `drop` says what the switch does."""
        if self.drop:
            message = f"{message}: --drop-unsupported {drop}"
        self.problems.append(
            {
                "element": self.label(prim),
                "message": message,
                "mend": mend,
                "option": "" if self.drop else f"--drop-unsupported, which {drop}",
                "left_out": self.drop,
            }
        )

    @staticmethod
    def label(prim):
        return f"<{prim.GetPath()}>"

    # ---- values

    def has(self, prim, schema):
        return schema in self.schemas(prim)

    @staticmethod
    def schemas(prim):
        return prim.GetPrimTypeInfo().GetAppliedAPISchemas()

    def value(self, prim, name, fallback=None):
        """Of an attribute, by whichever schema; `fallback` where the file gives none."""
        attribute = prim.GetAttribute(name)
        if not attribute or not attribute.HasAuthoredValue():
            return fallback
        self.read.add((prim.GetPath(), name))
        value = attribute.Get()
        if value is None:
            samples = attribute.GetTimeSamples()
            value = attribute.Get(samples[0]) if samples else None
        if value is None:
            return fallback
        if isinstance(value, float) and math.isnan(value):
            self.refuse(prim, f"has {name} = nan", "give a number")
            return fallback
        return value

    def targets(self, prim, name):
        relationship = prim.GetRelationship(name)
        if not relationship:
            return []
        self.read.add((prim.GetPath(), name))
        return relationship.GetForwardedTargets()

    # ---- places

    def matrix(self, prim):
        """The prim's own coordinates to the world's, in the file's units and axes (row vectors)."""
        return self.cache.GetLocalToWorldTransform(prim)

    def frame(self, prim):
        """The prim's rigid frame in the world, and the scale of its axes (with the sign of a mirror in x)."""
        matrix = self.matrix(prim)
        rows = [Gf.Vec3d(*(matrix[i][j] for j in range(3))) for i in range(3)]
        scale = [row.GetLength() for row in rows]
        if min(scale) <= 0:
            self.refuse(prim, f"has the scale ({', '.join(f'{each:g}' for each in scale)})", "give a scale other than 0")
            rows, scale = [AXES[axis] for axis in "XYZ"], [1.0, 1.0, 1.0]
        x = rows[0] / scale[0]
        z = Gf.Cross(rows[0], rows[1]).GetNormalized()
        mirror = Gf.Dot(z, rows[2]) < 0
        if mirror:
            x, z, scale[0] = -x, -z, -scale[0]
        y = Gf.Cross(z, x)
        shear = max(abs(Gf.Dot(rows[i] / abs(scale[i]), rows[j] / abs(scale[j]))) for i, j in ((0, 1), (0, 2), (1, 2)))
        rotation = Gf.Matrix3d(*x, *y, *z).ExtractRotation().GetQuat()
        own = Pose(rotation, matrix.ExtractTranslation() * self.metre)
        return self.turned * own, scale, shear > 1e-4

    def pose(self, prim):
        return self.frame(prim)[0]

    # ---- the account

    def finish_notes(self):
        """Names what concerns physics and was not read."""
        unread, of_contender = {}, set()
        for prim in self.prims():
            for each in prim.GetAuthoredProperties():
                name = each.GetName()
                if (prim.GetPath(), name) in self.read or not PHYSICAL.match(name):
                    continue
                if OF_CONTENDER.match(name):
                    of_contender.add(re.sub(r":.*", "", name))
                    continue
                if isinstance(each, Usd.Attribute) and is_idle(each.Get()):
                    continue
                unread.setdefault(name, []).append(str(prim.GetPath()))
        for what, places in self.lists.items():
            self.note(f"{what}: {named(places)}")
        for name, places in sorted(unread.items()):
            self.note(f"the attribute {name} is not carried over: {named(places)}")
        if of_contender:
            self.note(
                "settings of solvers, contacts and softness are ignored, because the contender decides them "
                f"({', '.join(sorted(of_contender))})"
            )

    def prims(self):
        return Usd.PrimRange(self.stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())


def named(places, most=6):
    more = len(places) - most
    return ", ".join(f"<{each}>" for each in places[:most]) + (f" and {more} more" if more > 0 else "")


def open_scene(path, root, allow_external, drop_unsupported):
    layer = examine_layers(path, root, allow_external)
    stage = Usd.Stage.Open(layer)
    check_composition(stage)
    return Scene(stage, drop_unsupported)
