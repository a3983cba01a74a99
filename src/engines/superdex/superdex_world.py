"""SuperDex's scene of a model, with one running simulation of it."""

import os

os.environ["SUPERDEX_PRECISION"] = "fp64"  # read when the package is imported

import assay_adapter as assay
import numpy as np
import superdex.physics as dex
import superdex_mesh

NO_MASS = 1e-100  # of links that only carry a shape, kg and kg m^2: rounds away beside any other

dex.initialize(num_worker_threads=0)


def rotation_of(q):
    w, x, y, z = np.asarray(q, dtype=float) / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def product(p, q):
    (a, b, c, d), (w, x, y, z) = p, q
    return np.array([a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
                     a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w])


def conjugate(q):
    return np.array([q[0], -q[1], -q[2], -q[3]])


def rotation_vector(q):
    q = np.asarray(q, dtype=float)
    if q[0] < 0:
        q = -q
    sine = np.linalg.norm(q[1:])
    return q[1:] * (2 * np.arctan2(sine, q[0]) / sine if sine > 0 else 2.0)


def quaternion_of(vector):
    angle = np.linalg.norm(vector)
    return np.array([np.cos(angle / 2), *(vector * (np.sin(angle / 2) / angle if angle > 0 else 0.5))])


def quaternion(q):
    w, x, y, z = (float(each) for each in q)
    return dex.Quaternion(x, y, z, w)


def pose(p, q=(1, 0, 0, 0)):
    return dex.TransformRT(translation=[float(each) for each in p], rotation=quaternion(q))


def six(I):
    return [float(I[0][0]), float(I[0][1]), float(I[0][2]), float(I[1][1]), float(I[1][2]), float(I[2][2])]


def full(I):
    return np.array([[I[0], I[1], I[2]], [I[1], I[3], I[4]], [I[2], I[4], I[5]]])


class Frame:
    """A body in SuperDex: the actor that holds it, with the body's frame in the actor's."""

    def __init__(self, p=(0, 0, 0), q=(1, 0, 0, 0)):
        self.p, self.q, self.R = np.array(p, dtype=float), np.array(q, dtype=float), rotation_of(q)
        self.actor = None

    def local(self, point):
        return self.p + self.R @ np.array(point)


_meshes = []  # of the last models: the model, the number of cells, SuperDex's shapes by their geometry


def meshes_of(model, cells):
    for known, of, shapes in _meshes:
        if known is model and of == cells:
            return shapes
    _meshes.append((model, cells, {}))
    del _meshes[:-8]
    return _meshes[-1][2]


class Simulation:
    def __init__(self, model, state, settings):
        self.model, self.settings, self.timestep = model, settings, settings.timestep
        self.scene = dex.create_scene("assay")
        self.scene.set_gravity(list(model.gravity))
        self.set_solver()
        self.shapes = meshes_of(model, settings["mesh_cells"])
        self.used = {}  # by body or world: the shapes that are in a pair
        for index in sorted({each for pair in model.contacts for each in (pair.shape_a, pair.shape_b)}):
            self.used.setdefault(model.shapes[index].body, []).append(index)
        # those that points of another body look for: planes have none, and static shapes none either
        self.probed = {a for pair in model.contacts
                       for a, b in ((pair.shape_a, pair.shape_b), (pair.shape_b, pair.shape_a)) if model.shapes[b].body >= 0}
        self.frames, self.actor_of = [None] * len(model.bodies), {}
        self.trees, self.rigid = [], []
        self.reference = np.array([joint.reference for joint in model.joints])
        try:
            for bodies in self.trees_of():
                self.make_tree(bodies, state)
            self.make_ground()
            self.make_pairs()
            self.make_constraints()
        except dex.Error as error:
            raise assay.EngineFailure(f"SuperDex refuses the model: {error}") from error
        self.step = self.scene.step
        self.rows, self.ball_rows = np.zeros((len(model.bodies), 13)), np.zeros((len(model.balls), 7))
        self.position, self.velocity = np.zeros(len(model.joints)), np.zeros(len(model.joints))
        self.queries = []

    def __del__(self):
        if hasattr(self, "scene") and dex.is_initialized():
            dex.destroy_scene(self.scene)

    def set_solver(self):
        settings, solver = self.settings, self.scene.get_solver_params()
        solver.integration_method = getattr(dex.IntegrationMethod, settings["integrator"].upper())
        solver.non_linear_solver.max_iter = settings["iterations"]
        solver.non_linear_solver.abs_tol = settings["tolerance"]
        solver.non_linear_solver.rel_tol = 1e-3 * settings["tolerance"]
        solver.non_linear_solver.verbosity = dex.VerbosityLevel.SILENT
        solver.linear_solver.verbosity = dex.VerbosityLevel.SILENT
        solver.experimental_eval.implicit_normal_force_for_dissipation = settings["implicit_friction"]
        if settings["exact_hessian"]:
            solver.experimental_eval.fitted_saturation_hessian = dex.SaturationHessianParams.all(False)
        self.scene.set_solver_params(solver)

    def contact(self):
        settings = self.settings
        return dex.ContactParams(
            penalty_coefficient=settings["contact_stiffness"], normal_viscous_damping_coefficient=settings["contact_damping"],
            penalty_smoothing_half_distance=settings["contact_smoothing"],
            penalty_threshold_default=settings["contact_threshold"], friction_falloff_vel=settings["friction_velocity"])

    def trees_of(self):
        roots, trees = [], {}
        for i, body in enumerate(self.model.bodies):
            roots.append(i if body.parent < 0 else roots[body.parent])
            trees.setdefault(roots[i], []).append(i)
        return trees.values()

    def shape(self, index, frame):
        """SuperDex's shape in an actor's frame, in which the body's is `frame`; its own, without one. A box is found as the
        box around its mesh, along the actor's axes."""
        shape = self.model.shapes[index]
        kind = {"plane": "PLANE", "sphere": "SPHERE", "box": "BOX"}.get(shape.type, "SDF")
        if index not in self.probed:
            kind = "NONE"
        p, q = np.zeros(3), np.array([1.0, 0, 0, 0])
        if frame is not None:
            p, q = frame.local(shape.X_BS.p), product(frame.q, shape.X_BS.q)
        made_of = [getattr(shape, each, None) for each in ("type", "radius", "half_length", "half_size", "data")]
        key = repr((made_of, kind == "SDF", p.tolist(), q.tolist()))
        if key not in self.shapes:
            self.shapes[key] = self.new_shape(shape, kind, p, q)
        return {"shape": self.shapes[key], "collider_type": getattr(dex.ColliderType, kind), "contact": self.contact()}

    def new_shape(self, shape, kind, p, q):
        if shape.type == "plane":
            return dex.create_plane_shape([0.0, 0.0, 1.0], 0.0)
        cells = self.settings["mesh_cells"]
        vertices, faces = superdex_mesh.of(self.model, shape, cells)
        values = {}
        if kind == "SDF":
            first, last, low, high, count, distances = superdex_mesh.grid(self.model, shape, vertices, cells)
            values["sdf"] = dex.GridSdfData(
                dims=[int(each) for each in count], values=distances, bounds=dex.Aabb(first.tolist(), last.tolist()),
                negative_value_bounds=dex.Aabb(low.tolist(), high.tolist()), rotation=quaternion(q), translation=p.tolist())
        coordinates = vertices @ rotation_of(q).T + p
        return dex.create_model_shape(mesh=dex.MeshData(nodes_per_element=3, coordinates=coordinates.ravel(),
                                                        connectivity=faces.ravel().astype(np.int32)), **values)

    def make_tree(self, bodies, state):
        root = self.model.bodies[bodies[0]]
        if len(bodies) == 1 and root.is_free and len(self.used.get(bodies[0], [])) == 1:
            self.make_rigid(bodies[0], state.bodies[bodies[0]])
        else:
            self.make_articulated(bodies, state)

    def make_rigid(self, i, row):
        """In the frame of its shape."""
        body, index = self.model.bodies[i], self.used[i][0]
        X_BS = self.model.shapes[index].X_BS
        R_BS, q_SB = rotation_of(X_BS.q), conjugate(np.array(X_BS.q))
        frame = self.frames[i] = Frame(-R_BS.T @ X_BS.p, q_SB)
        com = frame.local(body.p_BBcm)
        q_WS = product(row[3:7], X_BS.q)
        frame.actor = self.scene.create_rigid_actor(
            mass=body.mass, center_of_mass=com.tolist(), moment_of_inertia=six(R_BS.T @ np.array(body.I_BBcm_B) @ R_BS),
            world_from_local=pose(row[0:3] - rotation_of(q_WS) @ com, q_WS), linear_velocity=row[7:10].tolist(),
            angular_velocity=row[10:13].tolist(), **self.shape(index, None))
        self.use_inertia(frame.actor)
        self.actor_of[index] = frame.actor
        self.rigid.append((i, frame))

    def use_inertia(self, actor):
        dex.experimental.enable_newton_euler_inertia(actor, self.settings["inertia"] == "newton_euler")

    def make_articulated(self, bodies, state):
        model = self.model
        joints, links, link_of, carried = [], [], {}, []
        for i in bodies:
            body = model.bodies[i]
            self.frames[i] = frame = Frame(-np.array(body.p_BBcm) if body.is_free else (0, 0, 0))
            link_of[i] = len(links)
            joints.append(self.joint(i))
            values = {}
            if not body.is_massless:
                values = {"mass": body.mass, "center_of_mass": frame.local(body.p_BBcm).tolist(),
                          "moment_of_inertia": six(body.I_BBcm_B)}
            own = list(self.used.get(i, ()))
            # the link holds the first shape, unless it is massless or the shape is a box along other axes
            if own and not body.is_massless:
                first = model.shapes[own[0]]
                if first.type != "box" or np.array_equal(rotation_of(first.X_BS.q), np.eye(3)):
                    carried.append((own[0], link_of[i]))
                    values.update(self.shape(own.pop(0), frame))
            at = [0.0, 0.0, 0.0]
            if not body.is_free:
                anchor = model.joints[body.joint] if body.joint >= 0 else model.balls[body.ball]
                at = [-float(each) for each in anchor.p_BJ]
            links.append(dex.ArticulatedLinkParams(parent_link=link_of.get(body.parent, -1),
                                                   parent_joint_from_link=dex.TransformRT(translation=at), **values))
            for index in own:
                X = model.shapes[index].X_BS
                joints.append(dex.ArticulatedJointParams(type=dex.ArticulatedJointType.HARD,
                                                         parent_link_from_joint=pose(frame.local(X.p), X.q)))
                carried.append((index, len(links)))
                links.append(dex.ArticulatedLinkParams(
                    parent_link=link_of[i], mass=NO_MASS, center_of_mass=[0.0] * 3,
                    moment_of_inertia=[NO_MASS, 0, 0, NO_MASS, 0, NO_MASS], **self.shape(index, None)))
        made = self.scene.create_articulated_actor(joints=joints, links=links)
        self.use_inertia(made)
        actors = [self.scene.get_actor(each) for each in made.get_nested_link_actors()]
        for i, link in link_of.items():
            self.frames[i].actor = actors[link]
        for index, link in carried:
            self.actor_of[index] = actors[link]
        self.trees.append(Tree(self, made, bodies, link_of, state))

    def joint(self, i):
        model, body, settings = self.model, self.model.bodies[i], self.settings
        if body.is_free:
            return dex.ArticulatedJointParams(type=dex.ArticulatedJointType.FREE)
        own = model.joints[body.joint] if body.joint >= 0 else model.balls[body.ball]
        R_PB, shift = rotation_of(body.X_PB.q), np.zeros(3)
        if body.parent >= 0:
            shift = self.frames[body.parent].p
        values = {"parent_link_from_joint": pose(body.X_PB.p + R_PB @ own.p_BJ + shift, body.X_PB.q),
                  "inertia": own.armature,
                  "friction": dex.ArticulatedJointFrictionParams(
                      viscous=own.damping, coulomb=own.dry_friction, falloff_vel=settings["joint_friction_velocity"])}
        if body.ball >= 0:
            return dex.ArticulatedJointParams(type=dex.ArticulatedJointType.SPHERICAL, **values)
        axis = np.array(own.axis_B)
        if own.limited:
            values.update(min_limit=((own.lower - own.reference) * axis).tolist(),
                          max_limit=((own.upper - own.reference) * axis).tolist(),
                          limit_stiffness=settings["limit_stiffness"], limit_damping=settings["limit_damping"])
        kind = dex.ArticulatedJointType.PRISMATIC if own.is_slide else dex.ArticulatedJointType.REVOLUTE
        return dex.ArticulatedJointParams(type=kind, axis=axis.tolist(), **values)

    def make_ground(self):
        for index in self.used.get(-1, ()):
            X = self.model.shapes[index].X_BS
            self.actor_of[index] = self.scene.create_rigid_actor(is_static=True, world_from_local=pose(X.p, X.q),
                                                                 **self.shape(index, None))

    def make_pairs(self):
        """Actors touch unless it is forbidden: all but the model's pairs."""
        allowed = {frozenset((pair.shape_a, pair.shape_b)) for pair in self.model.contacts}
        shapes, alone = self.model.shapes, dex.IncludeNestedActors.NO
        actors = [(index, actor.get_handle()) for index, actor in self.actor_of.items()]
        for k, (a, actor) in enumerate(actors):
            for b, other in actors[:k]:
                if shapes[a].body >= 0 or shapes[b].body >= 0:
                    self.scene.enable_actor_contact_symmetric(actor, other, frozenset((a, b)) in allowed, alone)
        for pair in self.model.contacts:
            self.scene.set_contact_pair_params_override(
                self.actor_of[pair.shape_a].get_handle(), self.actor_of[pair.shape_b].get_handle(),
                dex.ContactPairParamsOverride(coulomb_friction_coefficient=pair.friction))

    def make_constraints(self):
        """Springs and dampers, as all of SuperDex's constraints: a weld is one at a point and one of a rotation."""
        for each in self.model.connects:
            self.tie(each.body_a, each.body_b, each.p_A, each.p_B)
        for each in self.model.welds:
            self.tie(each.body_a, each.body_b, each.X_AB.p, (0, 0, 0))
            self.align(each.body_a, each.body_b, np.array(each.X_AB.q))

    def spring(self):
        return {"stiffness": self.settings["constraint_stiffness"], "damping": self.settings["constraint_damping"]}

    def tie(self, a, b, p, q):
        if a < 0:
            a, b, p, q = b, a, q, p
        frame, scene = self.frames[a], self.scene
        if b < 0:
            scene.create_rigid_pivot_position_constraint(
                actor=frame.actor.get_handle(), local_position=frame.local(p).tolist(), target_position=list(q),
                **self.spring())
        else:
            other = self.frames[b]
            scene.create_rigid_spherical_joint_constraint(
                actor_a=frame.actor.get_handle(), actor_b=other.actor.get_handle(), local_pos_a=frame.local(p).tolist(),
                local_pos_b=other.local(q).tolist(), **self.spring())

    def align(self, a, b, q_AB):
        """Actors' axes are those of their bodies, turned by Frame.q: q_WB = q_WL q_LB."""
        if a < 0:
            a, b, q_AB = b, a, conjugate(q_AB)
        frame = self.frames[a]
        if b < 0:
            turn = product(conjugate(q_AB), conjugate(frame.q))
            self.scene.create_rigid_pivot_rotation_constraint(
                actor=frame.actor.get_handle(), target_rotation=rotation_vector(turn).tolist(), **self.spring())
            return
        other = self.frames[b]
        made = self.scene.create_joint_rotation_tracking_constraint(
            actor_a=frame.actor.get_handle(), actor_b=other.actor.get_handle(), **self.spring())
        made.set_target_rotation(quaternion(product(product(frame.q, q_AB), conjugate(other.q))))
        made.update_old_target()

    def set_torques(self, torques):
        for tree in self.trees:
            if len(tree.dofs):
                tree.actor.set_external_forces_on_dofs(tree.dofs, torques[tree.joints])

    def keep_contacts(self):
        self.number = {actor.get_handle().value: index for index, actor in self.actor_of.items()}
        self.queries = [(actor, actor.register_query(dex.QueryType.CONTACT_POINTS)) for actor in self.actor_of.values()
                        if actor.is_query_supported(dex.QueryType.CONTACT_POINTS)]

    def contacts(self):
        found = []
        for actor, _ in self.queries:
            own = actor.get_handle().value
            for point in actor.get_contact_points_world():
                if point.actor_a.value != own:  # the other actor gives it, too
                    continue
                a, b = self.number[point.actor_a.value], self.number[point.actor_b.value]
                found.append([a, b, *point.pos_a, *(-np.array(point.normal)), point.distance,
                              *(-self.timestep * np.array(point.force))])
        return found

    def advance(self, count):
        step, timestep = self.step, self.timestep
        for _ in range(count):
            step(timestep)
        if self.scene.get_solver_stats().convergence_status == dex.ConvergenceStatus.DIVERGED:
            raise assay.EngineFailure("SuperDex: its solver diverged in the last step")

    def read_state(self):
        for i, frame in self.rigid:
            row, actor = self.rows[i], frame.actor
            X = actor.get_center_of_mass_transform()
            x, y, z, w = X.rotation.tolist()
            row[0:3], row[3:7] = X.translation, product((w, x, y, z), frame.q)
            row[7:10], row[10:13] = actor.get_linear_velocity(), actor.get_angular_velocity()
        for tree in self.trees:
            tree.read(self)
        return {"position": self.position, "velocity": self.velocity, "balls": self.ball_rows, "bodies": self.rows}

    def view(self):
        mass, com, inertia = [], [], []
        for frame in self.frames:
            actor = frame.actor
            X = actor.get_root_transform()
            x, y, z, w = X.rotation.tolist()
            R = rotation_of((w, x, y, z))
            mass.append(actor.get_mass())
            if mass[-1] > 0:
                com.append(X.translation + R @ np.array(actor.get_rigid_center_of_mass_local()))
                inertia.append(R @ full(actor.get_rigid_moment_of_inertia_local()) @ R.T)
            else:
                com.append(np.array(X.translation))
                inertia.append(np.zeros((3, 3)))
        count = len(self.model.joints)
        view = {"gravity": self.scene.get_gravity(), "mass": mass, "com": com, "inertia": inertia,
                "anchor": np.zeros((count, 3)), "axis": np.zeros((count, 3)), "lower": np.zeros(count),
                "upper": np.zeros(count)}
        for tree in self.trees:
            tree.view(self, view)
        return view


class Tree:
    """An articulated actor: where its numbers are among the model's."""

    def __init__(self, simulation, actor, bodies, link_of, state):
        model, self.actor, info = simulation.model, actor, actor.get_articulated_shape_info()
        count = actor.get_num_dofs()
        self.pose, self.rates = np.zeros(count), np.zeros(count)
        joints, dofs, self.balls, self.free, self.links = [], [], [], [], []
        first = [each.offset for each in info.dof_info]
        for i in bodies:
            body, link = model.bodies[i], link_of[i]
            at = first[link]
            if body.is_free:
                row = state.bodies[i]
                self.free.append((i, at))
                self.pose[at:at + 3], self.pose[at + 3:at + 6] = row[0:3], rotation_vector(row[3:7])
                self.rates[at:at + 3], self.rates[at + 3:at + 6] = row[7:10], row[10:13]
            elif body.ball >= 0:
                row = state.balls[body.ball]
                self.balls.append((body.ball, at))
                self.pose[at:at + 3] = rotation_vector(row[0:4])
                self.rates[at:at + 3] = rotation_of(row[0:4]) @ row[4:7]
                self.add_ball_spring(simulation, model.balls[body.ball], link)
            else:
                joints.append(body.joint)
                dofs.append(at)
                self.links.append(link)
                self.add_spring(simulation, model.joints[body.joint], link)
        self.joints, self.dofs = np.array(joints, dtype=int), np.array(dofs, dtype=np.int32)
        self.pose[self.dofs] = state.position[self.joints] - simulation.reference[self.joints]
        self.rates[self.dofs] = state.velocity[self.joints]
        actor.set_articulated_pose_from_joints(self.pose)
        actor.set_articulated_joint_velocities(self.rates)

    def add_spring(self, simulation, joint, link):
        if joint.stiffness > 0:
            simulation.scene.create_articulated_single_dof_target_constraint(
                stiffness=joint.stiffness, actor=self.actor.get_handle(), joint_index=link, dof_index=0,
                target_value=joint.spring_reference - joint.reference)

    def add_ball_spring(self, simulation, ball, link):
        if ball.stiffness > 0:
            simulation.scene.create_articulated3d_rotation_target_constraint(
                stiffness=ball.stiffness, actor=self.actor.get_handle(), joint_index=link,
                target=quaternion(ball.spring_reference))

    def read(self, simulation):
        q, v = self.pose, self.rates
        self.actor.get_articulated_pose(q)
        self.actor.get_articulated_joint_velocities(v)
        simulation.position[self.joints] = q[self.dofs] + simulation.reference[self.joints]
        simulation.velocity[self.joints] = v[self.dofs]
        for i, at in self.free:
            row = simulation.rows[i]
            row[0:3], row[3:7] = q[at:at + 3], quaternion_of(q[at + 3:at + 6])
            row[7:10], row[10:13] = v[at:at + 3], v[at + 3:at + 6]
        for i, at in self.balls:
            row = simulation.ball_rows[i]
            row[0:4] = quaternion_of(q[at:at + 3])
            row[4:7] = rotation_of(row[0:4]).T @ v[at:at + 3]

    def view(self, simulation, view):
        info, limits = self.actor.get_articulated_shape_info(), dex.DynamicArrayReal2(len(self.pose))
        self.actor.get_articulated_dof_limits(limits)
        links = [simulation.scene.get_actor(each) for each in self.actor.get_nested_link_actors()]
        for joint, dof, link in zip(self.joints, self.dofs, self.links):
            X, arm = links[link].get_root_transform(), simulation.model.joints[joint].p_BJ
            x, y, z, w = X.rotation.tolist()
            R = rotation_of((w, x, y, z))
            view["anchor"][joint] = X.translation + R @ np.array(arm)
            view["axis"][joint] = R @ np.array(info.joint_axes[link])
            view["lower"][joint] = limits[int(dof)][0] + simulation.reference[joint]
            view["upper"][joint] = limits[int(dof)][1] + simulation.reference[joint]
