# The optimiser of `assay match`, in a process of its own: JSON lines on standard input and output.
#
# SciPy's trust-region least squares where the motion is smooth in its parameters, and pycma's CMA-ES where impacts make
# it rough. Weighed besides: Ceres (no bounds with a robust loss over many residual blocks without C++ types for each
# model, no evolution strategy), NLopt (BSD and LGPL parts, no least squares, its CMA-like methods are older), pagmo
# (needs Boost's serialization and TBB, its CMA-ES has no bounds of its own). SciPy and pycma are the references of
# their methods, are installed as wheels, and cost microseconds beside a simulation of milliseconds.
#
# The first line is the task: parameters in coordinates in which 1 is an expected deviation. Then this process asks for
# residuals of candidates, a batch at a time, and says at last what it has found:
#   {"ask": [[...], ...], "expected": ...}  ->  {"residuals": [[...], ...]}, of each candidate, in blocks of
#                             task["blocks"] numbers; expected: evaluations in all when this search ends
#   {"ask": ..., "costs": true}  ->  {"costs": [...]}, the mean Huber loss
#   {"linearise": [...]}  ->  {"simulated": ...}: from then on residuals are without what an error of the first states
#                             explains, to first order about this candidate (where task["first_states"])
#   {"done": {...}}
import json
import math
import sys
import warnings

import numpy as np

Z95 = 1.959963984540054


def say(message):
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


class Problem:
    def __init__(self, task):
        self.task = task
        self.lower = np.array(task["lower"], dtype=float)
        self.upper = np.array(task["upper"], dtype=float)
        self.width = self.upper - self.lower
        self.start = np.clip(np.array(task["start"], dtype=float), self.lower, self.upper)
        self.nominal = self.start.copy()
        self.free = [i for i in range(len(self.start)) if self.width[i] > 0]
        self.evaluations = 0
        self.expected = 0  # evaluations when the search that goes on ends
        # of each residual its block, and of each block its cluster
        self.cluster_of = np.repeat(np.array(task["clusters"], dtype=int), task["blocks"]) if task["blocks"] else np.zeros(0, int)

    def sizes(self, solution):
        """What an interval has to be smaller than for a parameter to count as determined: the number itself, or an
        expected deviation where that is more; the width of the bounds where zero is nothing special."""
        sizes = []
        for i, value in zip(self.free, solution):
            zero, size = self.task["zero"][i], self.width[i] if self.task["size"][i] is None else self.task["size"][i]
            if zero is not None:
                size = max(1.0, abs(value - zero))
            sizes.append(min(size, self.width[i]))
        return np.array(sizes)

    def full(self, free_values):
        x = self.start.copy()
        x[self.free] = free_values
        return x

    def exchange(self, message):
        say(message)
        line = sys.stdin.readline()
        if not line:
            sys.exit(3)
        return json.loads(line)

    def linearise(self, free_values):
        if self.task["first_states"]:
            self.evaluations += self.exchange({"linearise": [float(v) for v in self.full(free_values)]})["simulated"]

    def ask(self, candidates, costs=False):
        self.evaluations += len(candidates)
        message = {"ask": [[float(v) for v in c] for c in candidates], "expected": max(self.expected, self.evaluations)}
        if costs:
            message["costs"] = True
        answer = self.exchange(message)
        return np.array(answer["costs" if costs else "residuals"], dtype=float)

    def residuals(self, free_values):
        return self.ask([self.full(free_values)])[0]

    def posteriors(self, candidates):
        """Costs times what their distance from the model's values makes them less likely: impacts can be fitted by
        parameters that no body of this kind has, which then predict other impacts worse. A coordinate is normal with
        deviation 1; n observations with a mean absolute deviation of c have the likelihood c^-n."""
        costs = self.ask(candidates, costs=True)
        squares = np.sum((np.array(candidates) - self.nominal) ** 2, axis=1)
        return costs * np.exp(squares / (2 * self.task["observations"]))

    def jacobian(self, free_values, step, central):
        """Differences towards the inside of the bounds, all in one batch."""
        lower, upper = self.lower[self.free], self.upper[self.free]
        candidates, spans = [], []
        for k in range(len(free_values)):
            ahead, behind = np.array(free_values), np.array(free_values)
            ahead[k] = min(free_values[k] + step, upper[k])
            behind[k] = max(free_values[k] - step, lower[k])
            if not central:  # one side, the one with more room
                if ahead[k] - free_values[k] >= free_values[k] - behind[k]:
                    behind[k] = free_values[k]
                else:
                    ahead[k] = free_values[k]
            candidates += [self.full(ahead), self.full(behind)]
            spans.append(ahead[k] - behind[k])
        if central:
            found = self.ask(candidates)
        else:
            middle = self.full(free_values)
            moved = [c for c in candidates if not np.array_equal(c, middle)]
            answers = iter(self.ask([middle] + moved))
            at_middle = next(answers)
            found = [at_middle if np.array_equal(c, middle) else next(answers) for c in candidates]
        columns = [(found[2 * k] - found[2 * k + 1]) / spans[k] for k in range(len(spans))]
        return np.array(columns).T

    def judged(self, candidates):
        """As search() judges them."""
        if self.task["method"] == "cma":
            return self.posteriors(candidates)
        return [huber_cost(each, self.task["delta"]) for each in self.ask(candidates)]


def huber_cost(residuals, delta):
    size = np.abs(residuals)
    return float(np.mean(np.where(size <= delta, 0.5 * size * size, delta * (size - 0.5 * delta))))


def least_squares_from(problem, start, delta, budget):
    from scipy.optimize import least_squares

    lower, upper = problem.lower[problem.free], problem.upper[problem.free]
    inside = np.clip(start, lower + 1e-6 * (upper - lower), upper - 1e-6 * (upper - lower))
    most = max(3, budget // (len(problem.free) + 2))
    # the second time with the first states' influence as it is where the first one ended
    for _ in range(2 if problem.task["first_states"] else 1):
        problem.linearise(inside)
        found = least_squares(
            problem.residuals,
            inside,
            jac=lambda x: problem.jacobian(x, problem.task["step"], False),
            bounds=(lower, upper),
            loss="huber",
            f_scale=delta,
            xtol=1e-5,
            ftol=1e-6,
            gtol=1e-9,
            max_nfev=most,
        )
        inside, most = found.x, max(3, most - found.nfev)
    return found.x, huber_cost(found.fun, delta)


def cma_from(problem, start, seed, budget):
    with warnings.catch_warnings():  # it draws nothing here
        warnings.simplefilter("ignore")
        import cma

    lower, upper = problem.lower[problem.free], problem.upper[problem.free]
    options = cma.CMAOptions()
    options.update({
        "bounds": [list(lower), list(upper)],
        "seed": seed,
        "verbose": -9,
        "maxfevals": budget,
        "tolfun": 1e-5,
        "tolx": 1e-4,
        "CMA_stds": list(np.minimum(1.0, 0.3 * (upper - lower))),
        "popsize": max(8, 4 + int(3 * math.log(max(2, len(start))))),
    })
    run = cma.CMAEvolutionStrategy(list(np.clip(start, lower, upper)), 0.7, options)
    best, best_cost = None, math.inf
    spent = 0
    while not run.stop() and spent < budget:
        candidates = run.ask()
        costs = problem.posteriors([problem.full(np.clip(c, lower, upper)) for c in candidates])
        spent += len(candidates)
        run.tell(candidates, list(costs))
        if costs.min() < best_cost:
            best_cost = float(costs.min())
            best = np.clip(np.array(candidates[int(costs.argmin())]), lower, upper)
    # the mean of the distribution is the better estimate where the cost is rough
    middle = np.clip(np.array(run.result.xfavorite), lower, upper)
    cost = float(problem.posteriors([problem.full(middle)])[0])
    return (middle, cost) if cost <= best_cost else (best, best_cost)


def search(problem, budget):
    """From several starts, the best first: [(values of the free parameters, cost)]."""
    task = problem.task
    starts = task["starts"]
    found = []
    for k in range(starts):
        rng = np.random.default_rng([task["seed"], k])
        spread = 0.0 if k == 0 else 1.0
        start = problem.start[problem.free] + spread * rng.standard_normal(len(problem.free))
        start = np.clip(start, problem.lower[problem.free], problem.upper[problem.free])
        if task["method"] == "cma":
            found.append(cma_from(problem, start, task["seed"] * 1000 + k + 1, budget // starts))
        else:
            found.append(least_squares_from(problem, start, task["delta"], budget // starts))
    return sorted(found, key=lambda each: each[1])


class Information:
    """What the data say of the free parameters about a solution, by clusters of residuals that belong together."""

    def __init__(self, problem, solution, delta):
        self.problem = problem
        jacobian = problem.jacobian(solution, problem.task["information_step"], True)
        residuals = problem.residuals(solution)
        weights = np.minimum(1.0, delta / np.maximum(np.abs(residuals), 1e-300))
        width = problem.width[problem.free]
        self.size = problem.sizes(solution)
        self.relative_width = width / self.size
        scaled = jacobian * self.size
        names = np.unique(problem.cluster_of)
        self.curvatures, self.slopes = [], []
        for name in names:
            own = problem.cluster_of == name
            weighted = scaled[own] * weights[own, None]
            self.curvatures.append(weighted.T @ scaled[own])
            self.slopes.append(weighted.T @ residuals[own])
        self.curvatures, self.slopes = np.array(self.curvatures), np.array(self.slopes)
        self.curvature = self.curvatures.sum(axis=0)
        self.variance = float(np.sum(weights * residuals**2) / max(1, len(residuals) - len(solution)))
        # at a bound only the way inside is open, and it does not vary
        lower, upper = problem.lower[problem.free], problem.upper[problem.free]
        margin = 1e-3 * width
        self.at_bound = (solution < lower + margin) | (solution > upper - margin)
        self.steps = self.bootstrap(problem.task["resamples"], problem.task["seed"])

    def prior(self):
        """Curvature that stands for the bounds: an even distribution between them."""
        return max(self.variance, 1e-30) * np.diag(12.0 / self.relative_width**2)

    def weakest(self, widest):
        """The direction that the data determine least, where its interval is wider than `widest` of its size."""
        # what is at a bound has no interval to both sides: the others vary with it where it is
        inside = np.flatnonzero(~self.at_bound)
        if not len(inside):
            return None
        values, vectors = np.linalg.eigh(self.curvature[np.ix_(inside, inside)])
        values = np.maximum(values, 1e-13 * max(values.max(), 1e-30))
        # as if all residuals were independent, because few clusters may agree by chance; and over clusters
        independent = 2 * Z95 * np.sqrt(self.variance / values)
        steps = (self.steps / self.size)[:, inside]
        axes = np.linalg.eigh(np.cov(steps.T, ddof=1).reshape(len(inside), len(inside)))[1]
        low, high = np.quantile(steps @ axes, [0.025, 0.975], axis=0)
        vectors = np.hstack([vectors, axes])
        intervals = np.minimum(np.concatenate([independent, high - low]), 1e6)
        worst = int(np.argmax(intervals))
        if intervals[worst] <= widest:
            return None
        direction = np.zeros(len(self.size))
        direction[inside] = vectors[:, worst]
        return direction, float(intervals[worst])

    def bootstrap(self, resamples, seed):
        """Solutions of resampled clusters by one Newton step each, from the solution."""
        from scipy import stats
        rng = np.random.default_rng([seed, 77])
        count = len(self.slopes)
        prior = self.prior()
        steps = []
        for _ in range(resamples):
            times = np.bincount(rng.integers(0, count, count), minlength=count)
            curvature = np.tensordot(times, self.curvatures, axes=1) + prior
            slope = np.tensordot(times, self.slopes, axes=1)
            steps.append(-np.linalg.solve(curvature, slope))
        if self.problem.task["method"] == "cma":  # where the cost is rough its slope at the solution is not zero
            steps = np.array(steps) - np.mean(steps, axis=0)
        # a bootstrap of few clusters is too narrow: by the missing degree of freedom, and by Student's quantile, which of
        # fewer than five says more of their number than of the data
        few = math.sqrt(count / max(1, count - 1)) * stats.t.ppf(0.975, max(4, count - 1)) / stats.norm.ppf(0.975)
        return np.array(steps) * self.size * few


def elsewhere(problem, found, task):
    """The direction to a start that has ended as well as the best one, too far away from it."""
    best, cost = found[0]
    sizes = problem.sizes(best)
    for x, other in found[1:]:
        way = (x - best) / sizes
        length = float(np.linalg.norm(way))
        if other <= cost * (1 + task["equal"]) and 2 * length > task["widest"]:
            return way / length, 2 * length
    return None


def fit(task):
    problem = Problem(task)
    names = task["names"]
    budget = task["budget"]
    delta = task["delta"]
    combinations = []
    spread = []
    if not problem.free:
        say({"done": {"values": list(map(float, problem.start)), "low": [None] * len(names), "high": [None] * len(names),
                      "cost": None, "evaluations": 0, "combinations": [], "starts": [], "at_bound": []}})
        return
    before = None  # what was found while the last parameter that is not determined was free
    while True:
        problem.expected = problem.evaluations + budget
        found = search(problem, budget)
        if before and found[0][1] > before["found"][0][1] * (1 + task["equal"]):
            # the data do not say what it is, but that it is not the model's: as of a time constant that has to be
            # short, and acts no more below two timesteps
            combinations[-1]["as_found"] = True
            member, frozen = before["member"], before["frozen"]
            problem.start[frozen] = before["found"][0][0][member]
            found = [(np.delete(x, member), cost) for x, cost in before["found"]]
        solution = found[0][0]
        if not spread:
            spread = [[float(v) for v in problem.full(x)] + [float(c)] for x, c in found]
        problem.linearise(solution)
        information = Information(problem, solution, delta)
        weak = information.weakest(task["widest"]) or elsewhere(problem, found, task)
        if weak is None or len(problem.free) == 1 and combinations:
            break
        direction, interval = weak
        size = np.abs(direction)
        members = [i for i in np.argsort(-size) if size[i] >= 0.3 * size.max()]
        combinations.append({
            "members": [names[problem.free[i]] for i in members],
            "weights": [float(direction[i]) for i in members],
            "interval": float(interval),
            "frozen": names[problem.free[members[0]]],
            "as_found": False,
        })
        frozen = problem.free.pop(members[0])
        before = {"found": found, "member": members[0], "frozen": frozen}
        problem.start[frozen] = problem.nominal[frozen]
        if not problem.free:
            as_model = problem.start.copy()
            problem.start[frozen] = solution[0]
            costs = problem.judged([as_model, problem.start])
            combinations[-1]["as_found"] = bool(costs[0] > costs[1] * (1 + task["equal"]))
            if not combinations[-1]["as_found"]:
                problem.start = as_model
            solution, information = np.zeros(0), None
            break
        # the others start where they are
        keep = [i for i in range(len(solution)) if i != members[0]]
        problem.start[problem.free] = solution[keep]
        budget = max(budget // 2, 20 * len(problem.free))
    low, high = [None] * len(names), [None] * len(names)
    at_bound = []
    values = problem.full(solution)
    if information is not None:
        steps = information.steps
        best_cost = found[0][1]
        for k, i in enumerate(problem.free):
            bottom, top = np.quantile(steps[:, k], [0.025, 0.975]) + solution[k]
            # starts that end equally well elsewhere say what one optimum does not
            for x, cost in found:
                if cost <= best_cost * (1 + task["equal"]):
                    bottom, top = min(bottom, x[k]), max(top, x[k])
            low[i] = float(np.clip(bottom, problem.lower[i], problem.upper[i]))
            high[i] = float(np.clip(top, problem.lower[i], problem.upper[i]))
            if information.at_bound[k]:
                at_bound.append(names[i])
    say({"done": {
        "values": [float(v) for v in values],
        "low": low,
        "high": high,
        "cost": float(found[0][1]),
        "evaluations": problem.evaluations,
        "combinations": combinations,
        "starts": spread,
        "at_bound": at_bound,
    }})


def main():
    fit(json.loads(sys.stdin.readline()))


main()
