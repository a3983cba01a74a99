"""Drake's plant of a model, and one running simulation of it."""

import logging

import assay_adapter as assay
import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import (AddContactMaterial, Box, Capsule, CollisionFilterDeclaration, Convex, Cylinder, Ellipsoid,
                              GeometrySet, HalfSpace, InMemoryMesh, ProximityProperties, Sphere)
from pydrake.math import RigidTransform
from pydrake.common.eigen_geometry import Quaternion
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import (FixedOffsetFrame, PrismaticJoint, PrismaticSpring, QuaternionFloatingJoint,
                                    RevoluteJoint, RevoluteSpring, SpatialInertia, UnitInertia)
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder

logging.getLogger("drake").setLevel(logging.ERROR)


def transform(pose):
    return RigidTransform(Quaternion(pose.q), pose.p)


def at(point):
    return RigidTransform(np.array(point))


def inertia_of(body):
    """About the body frame's origin, as Drake takes it."""
    if body.is_massless:
        return SpatialInertia.Zero()
    p, I = np.array(body.p_BBcm), np.array(body.I_BBcm_B)
    G = (I / body.mass) + (p @ p) * np.eye(3) - np.outer(p, p)
    return SpatialInertia(body.mass, p, UnitInertia(G[0, 0], G[1, 1], G[2, 2], G[0, 1], G[0, 2], G[1, 2]), True)


def hull_shape(hull):
    lines = [f"v {v[0]!r} {v[1]!r} {v[2]!r}" for v in hull.vertices]
    lines += [f"f {f[0] + 1} {f[1] + 1} {f[2] + 1}" for f in hull.faces]
    return Convex(InMemoryMesh(mesh_file=MemoryFile("\n".join(lines), ".obj", hull.name)))


def drake_shape(model, shape):
    if shape.type == "sphere":
        return Sphere(shape.radius)
    if shape.type == "capsule":
        return Capsule(shape.radius, 2 * shape.half_length)
    if shape.type == "cylinder":
        return Cylinder(shape.radius, 2 * shape.half_length)
    if shape.type == "box":
        return Box(*(2 * half for half in shape.half_size))
    if shape.type == "ellipsoid":
        return Ellipsoid(*shape.half_size)
    if shape.type == "hull":
        return hull_shape(model.hulls[shape.data])
    return HalfSpace()


class World:
    """What depends on the model, the settings and the timestep alone: a diagram, from which any number of simulations
    run."""

    def __init__(self, model, settings):
        self.model, self.settings = model, settings
        self.discrete = settings["integrator"] == "discrete"
        builder = DiagramBuilder()
        self.plant, self.scene = AddMultibodyPlant(MultibodyPlantConfig(
            time_step=settings.timestep if self.discrete else 0.0,
            contact_model="point",
            discrete_contact_approximation=settings["contact_approximation"],
            stiction_tolerance=settings["stiction_tolerance"],
            sap_near_rigid_threshold=settings["near_rigid_threshold"],
            adjacent_bodies_collision_filters=False,
            use_sampled_output_ports=False), builder)
        self.plant.mutable_gravity_field().set_gravity_vector(model.gravity)
        self.anchor = None
        self.shape_of = {}  # by Drake's identifier
        self.add_bodies()
        self.add_constraints()
        self.add_shapes()
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.q_of = np.array([joint.position_start() for joint in self.joints], dtype=int)
        self.v_of = np.array([joint.velocity_start() for joint in self.joints], dtype=int)
        self.reference = np.array([joint.reference for joint in model.joints])
        self.free_of = [(i, joint.position_start(), joint.velocity_start()) for i, joint in self.free]

    def frame(self, name, body, pose):
        return self.plant.AddFrame(FixedOffsetFrame(name, body.body_frame(), pose))

    def add_bodies(self):
        plant, model = self.plant, self.model
        self.bodies, self.joints, self.free = [], [None] * len(model.joints), []
        for i, body in enumerate(model.bodies):
            made = plant.AddRigidBody(f"body {i}", inertia_of(body))
            self.bodies.append(made)
            if body.is_free:
                # the joint's frame lies in the centre of mass, which moves with the velocity of the step's end
                child = self.frame(f"child {i}", made, at(body.p_BBcm))
                self.free.append((i, plant.AddJoint(
                    QuaternionFloatingJoint(f"joint {i}", plant.world_frame(), child))))
                continue
            joint = model.joints[body.joint]
            parent = plant.world_body() if body.parent < 0 else self.bodies[body.parent]
            outer = self.frame(f"parent {i}", parent, transform(body.X_PB) @ at(joint.p_BJ))
            inner = self.frame(f"child {i}", made, at(joint.p_BJ))
            lower = joint.lower - joint.reference if joint.limited else -np.inf
            upper = joint.upper - joint.reference if joint.limited else np.inf
            kind, spring = (PrismaticJoint, PrismaticSpring) if joint.is_slide else (RevoluteJoint, RevoluteSpring)
            added = plant.AddJoint(kind(f"joint {i}", outer, inner, joint.axis_B, lower, upper, joint.damping))
            if joint.stiffness > 0:
                plant.AddForceElement(spring(added, joint.spring_reference - joint.reference, joint.stiffness))
            if joint.armature > 0:
                actuator = plant.AddJointActuator(f"rotor {i}", added)
                actuator.set_default_rotor_inertia(joint.armature)
                actuator.set_default_gear_ratio(1.0)
            self.joints[body.joint] = added

    def body(self, index):
        return self.plant.world_body() if index < 0 else self.bodies[index]

    def add_constraints(self):
        model, plant = self.model, self.plant
        for each in model.couplings:
            term = each.terms[0]
            own, other = model.joints[each.joint], model.joints[term.joint]
            plant.AddCouplerConstraint(self.joints[each.joint], self.joints[term.joint], term.coefficient,
                                       each.offset + term.coefficient * other.reference - own.reference)
        for each in model.connects:
            plant.AddBallConstraint(self.held(each.body_a), each.p_A, self.held(each.body_b), each.p_B)
        for each in model.welds:
            # at a centre of mass: what a turn of the constraint gives way moves the body the more the farther away it is
            X_AB = transform(each.X_AB)
            X_AM = X_AB @ at(model.bodies[each.body_b].p_BBcm) if each.body_b >= 0 else at(model.bodies[each.body_a].p_BBcm)
            plant.AddWeldConstraint(self.held(each.body_a), X_AM, self.held(each.body_b), X_AB.inverse() @ X_AM)

    def held(self, index):
        """A body for a constraint. One with the world's own body ends the process (findings/drake/constraint_to_world.py): a
        body that is welded to it stands for it."""
        if index >= 0:
            return self.bodies[index]
        if self.anchor is None:
            self.anchor = self.plant.AddRigidBody("anchor", SpatialInertia.Zero())
            self.plant.WeldFrames(self.plant.world_frame(), self.anchor.body_frame())
        return self.anchor

    def add_shapes(self):
        """A copy of each shape for each of its friction coefficients: only copies with equal ones may touch, so that
        every pair has its own."""
        model, settings = self.model, self.settings
        parts, partners = {}, {}
        for pair in model.contacts:
            for shape in (pair.shape_a, pair.shape_b):
                if (shape, pair.friction) not in parts:
                    parts[shape, pair.friction] = self.register(shape, pair.friction)
            partners.setdefault((pair.shape_a, pair.friction), []).append(parts[pair.shape_b, pair.friction])
        if not parts:
            return
        filters = self.scene.collision_filter_manager()
        declaration = CollisionFilterDeclaration().ExcludeWithin(GeometrySet(list(parts.values())))
        for part, others in partners.items():
            declaration.AllowBetween(GeometrySet(parts[part]), GeometrySet(others))
        filters.Apply(declaration)

    def register(self, index, friction):
        shape, settings = self.model.shapes[index], self.settings
        properties = ProximityProperties()
        AddContactMaterial(dissipation=settings["dissipation"], point_stiffness=settings["point_stiffness"],
                           friction=CoulombFriction(friction, friction), properties=properties)
        properties.AddProperty("material", "relaxation_time", settings["relaxation_time"])
        made = self.plant.RegisterCollisionGeometry(self.body(shape.body), transform(shape.X_BS),
                                                    drake_shape(self.model, shape), f"shape {index}, {friction!r}",
                                                    properties)
        self.shape_of[made] = index
        return made


_worlds = []  # the last ones, with their models


def world_of(model, settings):
    key = (settings.timestep, tuple(sorted(settings.items())))
    for kept_model, kept_key, world in _worlds:
        if kept_model is model and kept_key == key:
            return world
    world = World(model, settings)
    _worlds.append((model, key, world))
    del _worlds[:-8]
    return world


class Simulation:
    def __init__(self, model, state, settings):
        try:
            self.world = world_of(model, settings)
        except RuntimeError as error:
            raise assay.EngineFailure(f"Drake refuses the model: {error}") from error
        world, plant = self.world, self.world.plant
        self.timestep, self.steps = settings.timestep, 0
        self.error_control = settings["accuracy"] > 0
        self.simulator = Simulator(world.diagram)
        if not world.discrete:
            # its time starts at 0 like Drake's own clock here: a sum of steps from another start would drift
            ApplySimulatorConfig(SimulatorConfig(integration_scheme=settings["integrator"], start_time=0.0,
                                                 max_step_size=self.timestep, use_error_control=settings["accuracy"] > 0,
                                                 accuracy=settings["accuracy"] or 1e-3), self.simulator)
        self.context = plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self.forces = plant.get_applied_generalized_force_input_port()
        self.applied = np.zeros(plant.num_velocities())
        self.forces.FixValue(self.context, self.applied)
        q, v = np.zeros(plant.num_positions()), np.zeros(plant.num_velocities())
        q[world.q_of] = state.position - world.reference
        v[world.v_of] = state.velocity
        for i, at_q, at_v in world.free_of:
            row = state.bodies[i]
            q[at_q:at_q + 4], q[at_q + 4:at_q + 7] = row[3:7], row[0:3]
            v[at_v:at_v + 3], v[at_v + 3:at_v + 6] = row[10:13], row[7:10]
        plant.SetPositions(self.context, q)
        plant.SetVelocities(self.context, v)
        try:
            self.simulator.Initialize()
        except RuntimeError as error:
            raise assay.EngineFailure(str(error)) from error
        self.rows = np.zeros((len(model.bodies), 13))
        self.keeps_contacts, self.kept = False, []

    def set_torques(self, torques):
        self.applied[self.world.v_of] = torques
        self.forces.FixValue(self.context, self.applied)

    def keep_contacts(self):
        self.keeps_contacts = True

    def contacts(self):
        return self.kept

    def solve_contacts(self):
        """The contacts of the step that comes next: of the same solution as the step takes."""
        results = self.world.plant.get_contact_results_output_port().Eval(self.context)
        self.kept = []
        for i in range(results.num_point_pair_contacts()):
            found = results.point_pair_contact_info(i)
            pair = found.point_pair()
            self.kept.append([self.world.shape_of[pair.id_A], self.world.shape_of[pair.id_B], *found.contact_point(),
                              *-pair.nhat_BA_W, -pair.depth, *(self.timestep * found.contact_force())])

    def advance(self, count):
        try:
            if self.keeps_contacts and count > 0:
                if count > 1:
                    self.steps += count - 1
                    self.simulator.AdvanceTo(self.steps * self.timestep)
                self.solve_contacts()
                count = 1
            if self.error_control:  # its steps would not end on the timesteps by themselves
                for _ in range(count):
                    self.steps += 1
                    self.simulator.AdvanceTo(self.steps * self.timestep)
                return
            self.steps += count
            self.simulator.AdvanceTo(self.steps * self.timestep)
        except RuntimeError as error:
            raise assay.EngineFailure(f"Drake: {error}") from error

    def read_state(self):
        world = self.world
        q, v = world.plant.GetPositions(self.context), world.plant.GetVelocities(self.context)
        for i, at_q, at_v in world.free_of:
            row = self.rows[i]
            row[3:7], row[0:3] = q[at_q:at_q + 4], q[at_q + 4:at_q + 7]
            row[10:13], row[7:10] = v[at_v:at_v + 3], v[at_v + 3:at_v + 6]
        return {"position": q[world.q_of] + world.reference, "velocity": v[world.v_of], "bodies": self.rows}

    def view(self):
        world, plant = self.world, self.world.plant
        context = plant.CreateDefaultContext()  # poses are computed anew: those of the run may be a step old
        plant.SetPositions(context, plant.GetPositions(self.context))
        mass, com, inertia = [], [], []
        for body in world.bodies:
            M = body.CalcSpatialInertiaInBodyFrame(context)
            X = plant.EvalBodyPoseInWorld(context, body)
            p, R = M.get_com(), X.rotation().matrix()
            mass.append(M.get_mass())
            com.append(X @ p)
            if M.get_mass() == 0:
                inertia.append(np.zeros((3, 3)))
                continue
            I = M.CalcRotationalInertia().CopyToFullMatrix3() - M.get_mass() * ((p @ p) * np.eye(3) - np.outer(p, p))
            inertia.append(R @ I @ R.T)
        anchor, axis, lower, upper = [], [], [], []
        for joint, reference in zip(world.joints, world.reference):
            X = joint.frame_on_child().CalcPoseInWorld(context)
            own = joint.revolute_axis() if isinstance(joint, RevoluteJoint) else joint.translation_axis()
            anchor.append(X.translation())
            axis.append(X.rotation() @ own)
            lower.append(joint.position_lower_limits()[0] + reference)
            upper.append(joint.position_upper_limits()[0] + reference)
        return {"gravity": plant.gravity_field().gravity_vector(), "mass": mass, "com": com, "inertia": inertia,
                "anchor": anchor, "axis": axis, "lower": lower, "upper": upper}
