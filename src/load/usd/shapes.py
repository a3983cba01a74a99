# Collision shapes, materials and mass properties of bodies.
import math

from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

import geometry
from geometry import Pose, axis_to_z

CONE_SIDES = 32
WATER = 1000.0  # kg/m^3, UsdPhysics' density where nothing gives one
PHYSX_FRICTION = 0.5  # of PhysX's default material
PHYSX_RADIUS = 0.1  # m, of the ball whose inertia PhysX gives a mass without shapes

HULLS = {
    "none": "its triangles",
    "sdf": "a signed distance field",
    "convexDecomposition": "a convex decomposition",
    "meshSimplification": "simplified triangles",
}


class Material:
    def __init__(self):
        self.prim = None
        self.friction, self.combine = PHYSX_FRICTION, "average"
        self.torsional, self.rolling = None, None
        self.density = 0.0


class Shape:
    def __init__(self, prim, body):
        self.prim, self.body = prim, body  # body: index, or None for the world
        self.pose = Pose()  # in the body's frame
        self.kind, self.size, self.mesh = "", [], None  # mesh: (points, triangles) in the body's frame
        self.part = (0.0, Gf.Vec3d(0), geometry.diagonal(0, 0, 0))  # of density 1, in the body's frame
        self.material = Material()
        self.collides = True


def mesh_of(scene, prim, to_body):
    """Points in the body's frame, m, and triangles."""
    mesh = UsdGeom.Mesh(prim)
    given, counts, indices = mesh.GetPointsAttr().Get(), mesh.GetFaceVertexCountsAttr().Get(), mesh.GetFaceVertexIndicesAttr().Get()
    if given is None or counts is None or indices is None:
        return [], []
    matrix, pose, metre = scene.matrix(prim), to_body * scene.turned, scene.metre
    points = [pose.apply(matrix.Transform(Gf.Vec3d(*point)) * metre) for point in given]
    inward = (mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded) != (matrix.GetDeterminant3() < 0)
    triangles, begin = [], 0
    for count in counts:
        corners = list(indices[begin : begin + count])
        begin += count
        if len(corners) < count or any(not 0 <= i < len(points) for i in corners):
            raise IndexError
        for i in range(1, count - 1):
            triangle = (corners[0], corners[i], corners[i + 1])
            triangles.append(triangle[::-1] if inward else triangle)
    return points, triangles


def cone_points(radius, half):
    """The tip, and a ring as large as the circle in area."""
    ring = radius * math.sqrt(2 * math.pi / (CONE_SIDES * math.sin(2 * math.pi / CONE_SIDES)))
    turns = (2 * math.pi * i / CONE_SIDES for i in range(CONE_SIDES))
    return [Gf.Vec3d(0, 0, half)] + [Gf.Vec3d(ring * math.cos(t), ring * math.sin(t), -half) for t in turns]


class Shapes:
    """All collision shapes of a stage."""

    def __init__(self, scene, body_of, poses):
        self.scene = scene
        self.body_of = body_of  # of a prim: index of the body that it moves with, or None
        self.poses = poses  # of bodies, in the world
        self.materials = {}
        self.list = []
        seen = set()
        for prim in scene.prims():
            if not prim.HasAPI(UsdPhysics.CollisionAPI):
                continue
            if not scene.value(prim, "physics:collisionEnabled", True):
                scene.note_each("shapes whose collisionEnabled is false are left out", prim)
                continue
            if prim.IsA(UsdGeom.Gprim):
                gprims = [prim]
            else:
                # of a group, its shapes: as importers write it for instanced meshes
                below = Usd.PrimRange(prim, Usd.TraverseInstanceProxies())
                gprims = [each for each in below if each.IsA(UsdGeom.Gprim) and not each.HasAPI(UsdPhysics.CollisionAPI)]
                if not gprims and not any(each.HasAPI(UsdPhysics.CollisionAPI) for each in below if each != prim):
                    scene.note_each("a PhysicsCollisionAPI without a shape below it does nothing", prim)
            for each in gprims:
                if each.GetPath() in seen:
                    continue
                seen.add(each.GetPath())
                self.add(each, prim)

    def add(self, prim, owner):
        body = self.body_of(prim)
        shape = Shape(prim, body)
        frame, scale, sheared = self.scene.frame(prim)
        to_body = Pose() if body is None else self.poses[body].inverse()
        shape.pose = to_body * frame
        unit = [abs(each) * self.scene.metre for each in scale]
        if sheared and not prim.IsA(UsdGeom.Mesh):
            self.scene.refuse(prim, "is sheared by its transforms", "apply its scale before its rotation, or make it a mesh")
            return
        try:
            known = self.fill(shape, prim, owner, unit, to_body)
        except IndexError:
            self.scene.refuse(prim, "has faces that name points which are not there", "correct faceVertexIndices")
            return
        if not known:
            return
        shape.material = self.material(prim, owner)
        self.list.append(shape)

    def fill(self, shape, prim, owner, unit, to_body):
        """The kind, size and mass of a shape; false where it is left out."""
        kind = prim.GetTypeName()
        for each in {prim, owner}:
            self.scene.value(each, "physics:approximation")  # of meshes alone
        if prim.IsA(UsdGeom.Mesh):
            return self.fill_mesh(shape, prim, owner, to_body)
        if kind == "Cube":
            shape.kind, shape.size = "box", [UsdGeom.Cube(prim).GetSizeAttr().Get() / 2 * each for each in unit]
            own = geometry.box(*shape.size)
        elif kind == "Sphere":
            radii = [UsdGeom.Sphere(prim).GetRadiusAttr().Get() * each for each in unit]
            round_ = max(radii) - min(radii) <= 1e-5 * max(radii)
            shape.kind, shape.size = ("sphere", radii[:1]) if round_ else ("ellipsoid", radii)
            if not round_:
                self.scene.note_each("spheres that are scaled unequally are ellipsoids (PhysX takes the largest radius)", prim)
            own = geometry.ellipsoid(*radii)
        elif kind in ("Capsule", "Cylinder", "Cone", "Capsule_1", "Cylinder_1"):
            axis = str(prim.GetAttribute("axis").Get())
            along = "XYZ".index(axis)
            across = [unit[i] for i in range(3) if i != along]
            if kind.endswith("_1"):
                radii = [prim.GetAttribute(f"radius{end}").Get() for end in ("Bottom", "Top")]
                if abs(radii[0] - radii[1]) > 1e-6 * max(radii):
                    self.scene.unsupported(prim, f"has ends of the radii {radii[0]:g} and {radii[1]:g}", "make them equal", "leaves it out")
                    return False
                radius = radii[0]
            else:
                radius = prim.GetAttribute("radius").Get()
            if max(across) - min(across) > 1e-4 * max(across):
                self.scene.note_each("round shapes that are scaled unequally across take the larger radius", prim)
            radius *= max(across)
            half = prim.GetAttribute("height").Get() / 2 * unit[along]
            shape.pose = shape.pose * Pose(axis_to_z(axis))
            if kind.startswith("Cone"):
                points = cone_points(radius, half)
                triangles = geometry.hull(points)
                shape.kind, shape.mesh = "mesh", ([shape.pose.apply(p) for p in points], triangles)
                shape.part = geometry.solid(*shape.mesh)
                shape.pose = Pose()
                self.scene.note_each(f"cones are hulls of {CONE_SIDES} sides and the same volume", prim)
                return self.positive(prim, [radius, half])
            shape.kind, shape.size = ("capsule" if kind.startswith("Capsule") else "cylinder"), [radius, half]
            own = (geometry.capsule if shape.kind == "capsule" else geometry.cylinder)(radius, half)
        elif kind == "Plane":
            if shape.body is not None:
                self.scene.unsupported(prim, "is a plane on a body that moves", "make it a Cube", "leaves it out")
                return False
            shape.kind, shape.size = "plane", [0, 0, 1]
            shape.pose = shape.pose * Pose(axis_to_z(str(prim.GetAttribute("axis").Get())))
            return True
        else:
            self.scene.unsupported(
                prim,
                f"is a collision shape of the type '{kind}'",
                "use Cube, Sphere, Capsule, Cylinder, Cone, Plane or Mesh",
                "leaves it out",
            )
            return False
        shape.part = geometry.placed(own, shape.pose)
        return self.positive(prim, shape.size)

    def positive(self, prim, sizes):
        if min(sizes) > 0 and max(sizes) < math.inf:
            return True
        self.scene.refuse(prim, f"has the size {', '.join(f'{each:g}' for each in sizes)} m", "give positive sizes, or remove it")
        return False

    def fill_mesh(self, shape, prim, owner, to_body):
        points, triangles = mesh_of(self.scene, prim, to_body)
        used = sorted({i for triangle in triangles for i in triangle})
        if len(used) < 4:
            self.scene.refuse(prim, f"is a mesh of {len(triangles)} triangles", "give it faces, or remove PhysicsCollisionAPI")
            return False
        places = {i: n for n, i in enumerate(used)}
        points = [points[i] for i in used]
        triangles = [tuple(places[i] for i in triangle) for triangle in triangles]
        approximation = self.scene.value(owner, "physics:approximation", "none")
        if owner != prim:
            approximation = self.scene.value(prim, "physics:approximation", approximation)
        shape.pose = Pose()
        if approximation in ("boundingCube", "boundingSphere"):
            # of the mesh's own axes
            frame = to_body * self.scene.pose(prim)
            local = [frame.inverse().apply(p) for p in points]
            low, high = (Gf.Vec3d(*(pick(p[i] for p in local) for i in range(3))) for pick in (min, max))
            middle = (low + high) / 2
            shape.pose = frame * Pose(None, middle)
            if approximation == "boundingCube":
                shape.kind, shape.size = "box", list((high - low) / 2)
                own = geometry.box(*shape.size)
            else:
                radius = max((p - middle).GetLength() for p in local)
                shape.kind, shape.size = "sphere", [radius]
                own = geometry.ellipsoid(radius, radius, radius)
            shape.part = geometry.placed(own, shape.pose)
            return self.positive(prim, shape.size)
        if approximation in HULLS:
            self.scene.note_each(
                f"meshes that collide as {HULLS[approximation]} in the file are convex hulls (--decompose makes several)", prim
            )
        elif approximation != "convexHull":
            self.scene.note_each(f"the approximation '{approximation}' is unknown: the convex hull is taken", prim)
        shape.kind, shape.mesh = "mesh", (points, triangles)
        shape.approximation = approximation
        return True

    def volume(self, shape):
        """Mass properties of density 1; of a mesh its own where it is to collide as it is and is closed, else its hull's."""
        if shape.mesh is not None and shape.part[0] <= 0:
            points, triangles = shape.mesh
            if getattr(shape, "approximation", "convexHull") != "convexHull" and geometry.is_closed(triangles):
                shape.part = geometry.solid(points, triangles)
            if shape.part[0] <= 0:
                shape.part = geometry.solid(points, geometry.hull(points))
        return shape.part

    # ---- materials

    def material(self, prim, owner):
        bound = None
        for each in (prim, owner):
            bound = UsdShade.MaterialBindingAPI(each).ComputeBoundMaterial(materialPurpose="physics")[0].GetPrim()
            if bound and bound.HasAPI(UsdPhysics.MaterialAPI):
                break
            bound = None
        key = bound.GetPath() if bound else None
        if key not in self.materials:
            self.materials[key] = self.read_material(bound)
        if bound is None:
            self.scene.note_each(f"shapes without a physics material have the friction {PHYSX_FRICTION}, which is PhysX's default", prim)
        return self.materials[key]

    def read_material(self, prim):
        material = Material()
        if prim is None:
            return material
        material.prim, value = prim, lambda name, fallback: self.scene.value(prim, name, fallback)
        static = value("physics:staticFriction", 0.0)
        material.friction = value("physics:dynamicFriction", 0.0)
        if abs(static - material.friction) > 1e-6:
            self.scene.note_each(
                f"the static friction {static:g} is not used, as engines have one coefficient: the dynamic {material.friction:g}", prim
            )
        if material.friction < 0:
            self.scene.refuse(prim, f"has the friction {material.friction:g}", "make it 0 or more")
            material.friction = 0.0
        if (restitution := value("physics:restitution", 0.0)) != 0:
            self.scene.note_each(f"the restitution {restitution:g} is left out: contacts do not bounce", prim)
        material.combine = str(value("physxMaterial:frictionCombineMode", "average"))
        value("physxMaterial:restitutionCombineMode", None)
        material.torsional = value("mjc:torsionalfriction", value("newton:torsionalFriction", None))
        material.rolling = value("mjc:rollingfriction", value("newton:rollingFriction", None))
        material.density = value("physics:density", 0.0) * self.scene.kilogram / self.scene.metre**3
        return material

    # ---- mass

    def authored_mass(self, prim):
        """(mass, density) of a prim with MassAPI, SI; 0 where it gives none."""
        unit = self.scene.kilogram
        mass = self.scene.value(prim, "physics:mass", 0.0) * unit
        density = self.scene.value(prim, "physics:density", 0.0) * unit / self.scene.metre**3
        for name, given in (("mass", mass), ("density", density)):
            if given < 0 or not math.isfinite(given):
                self.scene.refuse(prim, f"has the {name} {given:g}", "make it positive, or 0 to have it computed")
                return 0.0, 0.0
        return mass, density

    def frame_of_mass(self, prim, part, to_body, scale):
        """What a MassAPI gives of centre, inertia and axes replaces that of `part`. `to_body`: from the prim's frame."""
        mass, centre, inertia = part
        metre = self.scene.metre
        given = self.scene.value(prim, "physics:centerOfMass")
        if given is not None and all(math.isfinite(each) for each in given):
            centre = to_body.apply(Gf.Vec3d(*(given[i] * scale[i] * metre for i in range(3))))
        moments = self.scene.value(prim, "physics:diagonalInertia")
        axes = self.scene.value(prim, "physics:principalAxes")
        if moments is not None and any(each != 0 for each in moments):
            unit = self.scene.kilogram * metre**2
            rotation = Gf.Quatd(1)
            if axes is not None and Gf.Quatd(axes).GetLength() > 0:
                rotation = Gf.Quatd(axes).GetNormalized()
            moments = geometry.possible([each * unit for each in moments])
            inertia = geometry.rotated(geometry.diagonal(*moments), to_body.rotation * rotation)
        return mass, centre, inertia

    def has_inertia(self, prim):
        moments = prim.GetAttribute("physics:diagonalInertia").Get() if prim.HasAPI(UsdPhysics.MassAPI) else None
        return moments is not None and any(each != 0 for each in moments)

    def mass_of(self, body, prim):
        """Mass, centre and inertia of a body in its frame, by UsdPhysics' rules: a mass here overrides those below, a
        density below overrides one here, a material's is the weakest."""
        own_mass, own_density = self.authored_mass(prim) if prim.HasAPI(UsdPhysics.MassAPI) else (0.0, 0.0)
        scale = self.scene.frame(prim)[1]
        of_body = [shape for shape in self.list if shape.body == body]
        if own_mass > 0 and self.has_inertia(prim) and prim.GetAttribute("physics:centerOfMass").HasAuthoredValue():
            of_body = []
        parts = []
        for shape in of_body:
            mass, density = self.authored_mass(shape.prim) if shape.prim.HasAPI(UsdPhysics.MassAPI) else (0.0, 0.0)
            density = density or own_density or shape.material.density or WATER
            unit = self.volume(shape)
            if unit[0] <= 0:
                continue
            part = geometry.scaled(unit, mass / unit[0] if mass > 0 else density)
            if shape.prim.HasAPI(UsdPhysics.MassAPI):
                frame, own_scale, _ = self.scene.frame(shape.prim)
                part = self.frame_of_mass(shape.prim, part, self.poses[body].inverse() * frame, own_scale)
            parts.append(part)
        part = geometry.total(parts)
        if own_mass > 0:
            if part[0] > 0:
                part = geometry.scaled(part, own_mass / part[0])
            else:
                ball = 0.4 * own_mass * PHYSX_RADIUS**2
                part = (own_mass, Gf.Vec3d(0), geometry.diagonal(ball, ball, ball))
                if not self.has_inertia(prim):
                    self.scene.note_each(
                        f"bodies with a mass, but neither inertia nor shapes, have the inertia of a ball of {PHYSX_RADIUS} m, as in PhysX",
                        prim,
                    )
        if prim.HasAPI(UsdPhysics.MassAPI):
            part = self.frame_of_mass(prim, part, Pose(), scale)
        return part
