"""Small scenes by SuperDex's API alone, for the programs of this folder."""

import os
import sys

os.environ["SUPERDEX_PRECISION"] = "fp64"

import numpy as np
import superdex.physics as dex

G = 9.81
INTEGRATORS = ("BACKWARD_EULER", "BDF2", "BDF3", "DIRK22", "DIRK23", "DIRK33", "SYMPLECTIC_DIRK12", "SYMPLECTIC_DIRK22")

dex.initialize(num_worker_threads=0)


class Scene:
    """Steps are solved to rounding, so that what is seen is the method's."""

    def __init__(self, integrator, timestep, gravity=(0, 0, -G), iterations=50, tolerance=1e-12):
        self.scene, self.timestep = dex.create_scene("scene"), timestep
        self.scene.set_gravity(list(gravity))
        solver = self.scene.get_solver_params()
        solver.integration_method = getattr(dex.IntegrationMethod, integrator)
        solver.non_linear_solver.max_iter = iterations
        solver.non_linear_solver.abs_tol = tolerance
        solver.non_linear_solver.rel_tol = tolerance
        solver.non_linear_solver.verbosity = dex.VerbosityLevel.SILENT
        self.scene.set_solver_params(solver)

    def link(self, joint, mass=1.0, com=(0, 0, 0), moments=(1, 1, 1), rates=(), **values):
        """One link on a joint of the world."""
        actor = self.scene.create_articulated_actor(
            joints=[dex.ArticulatedJointParams(type=getattr(dex.ArticulatedJointType, joint), **values)],
            links=[dex.ArticulatedLinkParams(
                parent_link=-1, mass=mass, center_of_mass=list(com),
                moment_of_inertia=[moments[0], 0, 0, moments[1], 0, moments[2]])])
        if rates:
            actor.set_articulated_joint_velocities(np.array(rates, dtype=float))
        return actor

    def run(self, time):
        for _ in range(round(time / self.timestep)):
            self.scene.step(self.timestep)
        return self


    def ball(self, mass, radius, place, velocity, contact, cells=32):
        """A ball of triangles, and the plane z = 0."""
        around, up = 4 * cells, 2 * cells
        points = [[0, 0, -radius]]
        for i in range(1, up):
            a = np.pi * i / up
            points += [[radius * np.sin(a) * np.cos(2 * np.pi * j / around), radius * np.sin(a) * np.sin(2 * np.pi * j / around),
                        -radius * np.cos(a)] for j in range(around)]
        points.append([0, 0, radius])
        faces, last = [], 1 + (up - 2) * around
        for j in range(around):
            k = (j + 1) % around
            faces += [[0, 1 + k, 1 + j], [last + j, last + k, len(points) - 1]]
            for i in range(up - 2):
                a, b = 1 + i * around + j, 1 + i * around + k
                faces += [[a, b, b + around], [a, b + around, a + around]]
        shape = dex.create_tri_mesh_shape(np.ravel(points), np.ravel(faces).astype(np.int32))
        I = 0.4 * mass * radius**2
        params = dex.ContactParams(**contact)
        self.scene.create_rigid_actor(shape=dex.create_plane_shape([0.0, 0.0, 1.0], 0.0), is_static=True, contact=params)
        return self.scene.create_rigid_actor(
            shape=shape, mass=mass, center_of_mass=[0, 0, 0], moment_of_inertia=[I, 0, 0, I, 0, I], contact=params,
            collider_type=dex.ColliderType.NONE, world_from_local=dex.TransformRT(translation=list(place)),
            linear_velocity=list(velocity))


def pose(actor):
    q = np.zeros(actor.get_num_dofs())
    actor.get_articulated_pose(q)
    return q


def rates(actor):
    v = np.zeros(actor.get_num_dofs())
    actor.get_articulated_joint_velocities(v)
    return v


def finish(still_so):
    """Status 0 while SuperDex behaves so."""
    print("as described" if still_so else "SuperDex does not behave so any more: mend the adapter's declaration")
    sys.stdout.flush()
    os._exit(0 if still_so else 1)
