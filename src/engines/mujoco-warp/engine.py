"""MuJoCo Warp: MuJoCo's equations as kernels of Warp, in single precision, here compiled for the CPU.

README.md says what is exact, what is approximated, what is refused and which defaults are overridden.
"""

import assay_adapter as assay
import mujoco_declared


class Engine(assay.Engine):
    version = assay.pinned("mujoco-warp", __file__)
    source = (f"PyPI mujoco-warp {version}, warp-lang {assay.pinned('warp-lang', __file__)}, models compiled by mujoco-core "
              f"{assay.pinned('mujoco-core', __file__)}")
    compiler = "Warp's LLVM, on this machine, when a model first needs a kernel"
    flags = "for this processor"

    def settings(self):
        return [
            assay.Setting(name="integrator", default="euler", choices=tuple(mujoco_declared.INTEGRATORS),
                          meaning="semi-implicit Euler, Runge-Kutta 4, or implicit in velocity"),
            *mujoco_declared.settings_of_solver(),
            assay.Setting(name="iterations", default=100, minimum=1, role="iterations",
                          meaning="most iterations of the constraint solver in a step"),
            assay.Setting(name="tolerance", default=1e-8, minimum=0.0, role="tolerance",
                          meaning="scaled improvement below which the constraint solver stops; MuJoCo Warp raises it to 1e-6"),
            assay.Setting(name="max_contacts", default=0, minimum=0, maximum=1000000,
                          meaning="contacts that there is room for, an outcome when there are more; 0: what the pairs can "
                                  "have, at most 8 a body and 8 more. A step's cost grows with it"),
        ]

    def contenders(self):
        def contender(name, summary, **values):
            return assay.Contender(name=name, summary=summary, set=values)

        return [
            contender("mujoco-warp", "MuJoCo Warp on the CPU, semi-implicit Euler, Newton solver"),
            contender("mujoco-warp-rk4", "MuJoCo Warp on the CPU, Runge-Kutta 4, Newton solver", integrator="rk4"),
        ]

    def capabilities(self, settings):
        return mujoco_declared.capabilities("mujoco-warp", settings, "single", "the graph of a step is captured before the run")

    def check(self, model, settings):
        return mujoco_declared.soft_limits_and_contacts(model, settings["cone"])

    def create(self, model, state, settings):
        import warp_world

        return warp_world.Simulation(model, state, settings)

    def create_batch(self, model, worlds, settings, device):
        import warp_batch

        return warp_batch.Batch(model, worlds, settings, device)
