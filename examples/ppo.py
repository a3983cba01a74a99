"""What the trained examples share: proximal policy optimisation of small networks over MuJoCo's threaded rollouts, and ONNX.

J. Schulman, F. Wolski, P. Dhariwal, A. Radford, O. Klimov, "Proximal policy optimization algorithms", 2017; advantages after
J. Schulman, P. Moritz, S. Levine, M. Jordan, P. Abbeel, "High-dimensional continuous control using generalized advantage
estimation", 2016. The step size follows the change of the policy, as in N. Rudin, D. Hoeller, P. Reist, M. Hutter, "Learning to
walk in minutes using massively parallel deep reinforcement learning", 2022. Gradients are JAX's. The usual libraries of such
methods need PyTorch, whose package for Linux brings gigabytes for graphics processors; JAX for the CPU has some 100 MB.
"""

import dataclasses
import time

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import onnx
from mujoco import rollout
from onnx import TensorProto, helper, numpy_helper

THREADS = 2


@dataclasses.dataclass
class Settings:
    iterations: int
    seed: int
    steps: int = 24  # of each robot in an iteration
    passes: int = 4
    batches: int = 4  # in a pass
    discount: float = 0.99
    trace: float = 0.95
    clip: float = 0.2
    change: float = 0.01  # wanted divergence of the policy in an iteration
    first_rate: float = 1e-3
    rates: tuple = (3e-5, 2e-3)
    entropy: float = 0.001
    first_deviation: float = 0.35  # of actions


# ---- networks ---------------------------------------------------------------------------------------------------------


def layers(rng, sizes, last):
    """Weights of a network: scaled by the number of inputs, those of the last layer by `last` as well."""
    made = []
    for i, (inputs, outputs) in enumerate(zip(sizes[:-1], sizes[1:])):
        scale = (last if i == len(sizes) - 2 else 1.0) / np.sqrt(inputs)
        made.append((jnp.asarray(scale * rng.standard_normal((inputs, outputs)), jnp.float32), jnp.zeros(outputs)))
    return made


def forward(network, x):
    for weights, bias in network[:-1]:
        x = jax.nn.elu(x @ weights + bias)
    weights, bias = network[-1]
    return x @ weights + bias


def write_onnx(network, path, name, centre=None):
    """Writes the network: one observation `obs` in, its `actions` out, both float32.

    `centre` = (A, B): the actions are forward(obs) + relu(obs @ A) @ B.
    """
    observations, actions = network[0][0].shape[0], network[-1][1].size
    nodes, constants, last = [], [], "obs"
    for i, (weights, bias) in enumerate(network, 1):
        constants += [numpy_helper.from_array(np.asarray(array, np.float32), f"{kind}{i}")
                      for kind, array in (("w", weights), ("b", bias))]
        ends = i == len(network)
        summed = ("actions" if centre is None else "learned") if ends else f"sum{i}"
        nodes.append(helper.make_node("Gemm", [last, f"w{i}", f"b{i}"], [summed]))
        if not ends:
            nodes.append(helper.make_node("Elu", [summed], [f"layer{i}"]))
        last = f"layer{i}"
    if centre is not None:
        constants += [numpy_helper.from_array(np.asarray(array, np.float32), f"centre{i}") for i, array in enumerate(centre)]
        nodes += [helper.make_node("MatMul", ["obs", "centre0"], ["waves"]), helper.make_node("Relu", ["waves"], ["halves"]),
                  helper.make_node("MatMul", ["halves", "centre1"], ["centre"]),
                  helper.make_node("Add", ["learned", "centre"], ["actions"])]
    graph = helper.make_graph(
        nodes, name, [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [1, observations])],
        [helper.make_tensor_value_info("actions", TensorProto.FLOAT, [1, actions])], constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], producer_name=f"assay {name}")
    model.ir_version = 8
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


# ---- robots -----------------------------------------------------------------------------------------------------------


def position_drives(model, stiffness, damping, limit):
    """Makes every motor the explicit PD of policy.toml: torques of each step's start, clamped. Its control is the target."""
    model.actuator_biastype[:] = mujoco.mjtBias.mjBIAS_AFFINE
    model.actuator_gainprm[:, 0] = stiffness
    model.actuator_biasprm[:, 1] = -stiffness
    model.actuator_biasprm[:, 2] = -damping
    model.actuator_ctrllimited[:] = 0
    model.actuator_forcelimited[:] = 1
    model.actuator_forcerange[:, 0] = -limit
    model.actuator_forcerange[:, 1] = limit


class Robots:
    """Many robots that step at once: models may differ in numbers, not in sizes."""

    def __init__(self, models):
        self.models = models
        self.data = [mujoco.MjData(models[0]) for _ in range(THREADS)]
        self.pool = rollout.Rollout(nthread=THREADS)
        self.qpos = np.zeros((len(models), models[0].nq))
        self.qvel = np.zeros((len(models), models[0].nv))
        self.warm = np.zeros((len(models), models[0].nv))
        self.sensors = np.zeros((len(models), models[0].nsensordata))

    def step(self, targets, count):
        state = np.concatenate([np.zeros((len(self.models), 1)), self.qpos, self.qvel], axis=1)
        control = np.repeat(targets[:, None, :], count, axis=1)
        states, sensors = self.pool.rollout(self.models, self.data, state, control, nstep=count)
        self.qpos = states[:, -1, 1 : 1 + self.qpos.shape[1]].copy()
        self.qvel = states[:, -1, 1 + self.qpos.shape[1] :].copy()
        self.sensors = sensors[:, -1].copy()


# ---- learning ---------------------------------------------------------------------------------------------------------


def log_probability(mean, deviation, action):
    return -(((action - mean) / deviation) ** 2 / 2 + jnp.log(deviation)).sum(-1)


def loss_of(parameters, batch, clip, entropy):
    mean, deviation = forward(parameters["actor"], batch["obs"]), jnp.exp(parameters["deviation"])
    ratio = jnp.exp(log_probability(mean, deviation, batch["action"]) - batch["log_probability"])
    gain = batch["advantage"]
    policy = -jnp.minimum(ratio * gain, jnp.clip(ratio, 1 - clip, 1 + clip) * gain).mean()
    value = ((forward(parameters["critic"], batch["seen"])[:, 0] - batch["return"]) ** 2).mean()
    old_mean, old_deviation = batch["mean"], batch["deviation"]
    change = (jnp.log(deviation / old_deviation) + (old_deviation**2 + (old_mean - mean) ** 2) / (2 * deviation**2) - 0.5)
    return policy + value - entropy * jnp.log(deviation).sum(), change.sum(-1).mean()


def learner(settings):
    """An iteration's updates: a function of parameters, Adam's moments, the data, their order and the rate."""
    gradient = jax.grad(loss_of, has_aux=True)

    def update(carry, indices):
        parameters, first, second, count, data, rate = carry
        batch = {key: value[indices] for key, value in data.items()}
        slope, change = gradient(parameters, batch, settings.clip, settings.entropy)
        norm = jnp.sqrt(sum((leaf**2).sum() for leaf in jax.tree.leaves(slope)))
        slope = jax.tree.map(lambda leaf: leaf * jnp.minimum(1.0, 1.0 / (norm + 1e-6)), slope)
        count = count + 1
        first = jax.tree.map(lambda m, g: 0.9 * m + 0.1 * g, first, slope)
        second = jax.tree.map(lambda v, g: 0.999 * v + 0.001 * g**2, second, slope)
        # D. Kingma, J. Ba, "Adam: a method for stochastic optimization", 2015
        parameters = jax.tree.map(
            lambda p, m, v: p - rate * (m / (1 - 0.9**count)) / (jnp.sqrt(v / (1 - 0.999**count)) + 1e-8),
            parameters, first, second)
        # the rate follows the change: the policy neither stands nor runs away
        rate = jnp.where(change > 2 * settings.change, rate / 1.5, jnp.where(change < settings.change / 2, rate * 1.5, rate))
        return (parameters, first, second, count, data, jnp.clip(rate, *settings.rates)), change

    @jax.jit
    def iterate(parameters, first, second, count, data, orders, rate):
        (parameters, first, second, count, _, rate), changes = jax.lax.scan(
            update, (parameters, first, second, count, data, rate), orders)
        return parameters, first, second, count, rate, changes.mean()

    return iterate


def train(task, settings, hidden):
    """The trained network, without its centre, and the curve: (mean reward of a step, share of robots that fell a second).

    `task` has `robots`, `rng`, `period_s`, `centre`; observe() -> what the policy and what the critic sees; act(actions) ->
    rewards, fallen, and whether each robot's episode ends without a fall; restart(which).
    """
    task.restart(np.ones(len(task.robots.models), bool))
    obs, seen = task.observe()
    rng = np.random.default_rng(settings.seed)
    actions = task.actions
    parameters = {
        "actor": layers(rng, [obs.shape[1], *hidden, actions], 0.01),
        "critic": layers(rng, [seen.shape[1], *hidden, 1], 1.0),
        "deviation": jnp.full(actions, np.log(settings.first_deviation), jnp.float32),
    }
    first = jax.tree.map(jnp.zeros_like, parameters)
    second, count, rate = first, jnp.zeros(()), jnp.asarray(settings.first_rate)
    iterate, act, judge = learner(settings), jax.jit(forward), jax.jit(lambda network, x: forward(network, x)[..., 0])
    robots, steps = len(obs), settings.steps
    began, curve = time.monotonic(), []
    for iteration in range(settings.iterations):
        kept = {key: [] for key in ("obs", "seen", "action", "mean")}
        rewards, values, ends = (np.zeros((steps, robots), np.float32) for _ in range(3))
        falls, deviation = 0, np.exp(np.asarray(parameters["deviation"]))
        for step in range(steps):
            mean = np.asarray(act(parameters["actor"], obs))
            action = mean + deviation * rng.standard_normal(mean.shape).astype(np.float32)
            for key, value in (("obs", obs), ("seen", seen), ("action", action), ("mean", mean)):
                kept[key].append(value)
            values[step] = judge(parameters["critic"], seen)
            rewards[step], fallen, over = task.act(action + task.centre_of(obs))
            falls += int(fallen.sum())
            ended = fallen | over
            if ended.any():
                if over.any():  # the episode would have gone on
                    rewards[step] += settings.discount * np.where(over & ~fallen, judge(parameters["critic"], task.observe()[1]), 0)
                task.restart(ended)
            ends[step] = ended
            obs, seen = task.observe()
        advantage, after, running = np.zeros_like(rewards), np.asarray(judge(parameters["critic"], seen)), 0.0
        for step in reversed(range(steps)):
            goes_on = 1 - ends[step]
            delta = rewards[step] + settings.discount * after * goes_on - values[step]
            running = delta + settings.discount * settings.trace * goes_on * running
            advantage[step], after = running, values[step]
        data = {key: np.concatenate(value) for key, value in kept.items()}
        data["deviation"] = np.broadcast_to(deviation, data["mean"].shape)
        data["return"] = (advantage + values).ravel()
        data["advantage"] = ((advantage - advantage.mean()) / (advantage.std() + 1e-6)).ravel()
        data["log_probability"] = np.asarray(log_probability(data["mean"], deviation, data["action"]))
        orders = np.stack([rng.permutation(steps * robots).reshape(settings.batches, -1) for _ in range(settings.passes)])
        parameters, first, second, count, rate, _ = iterate(
            parameters, first, second, count, data, orders.reshape(-1, orders.shape[-1]), rate)
        curve.append((round(float(np.mean(rewards)), 4), round(falls / (robots * steps * task.period_s), 4)))
        if iteration % 20 == 19:
            print(f"iteration {iteration + 1}: reward {curve[-1][0]:.3f} a step, {curve[-1][1]:.3f} falls a second, deviation "
                  f"{deviation.mean():.2f}, rate {float(rate):.1e}, {time.monotonic() - began:.0f} s; {task.figures()}", flush=True)
    network = [(np.asarray(weights), np.asarray(bias)) for weights, bias in parameters["actor"]]
    return network, curve, time.monotonic() - began
