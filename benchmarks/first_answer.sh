#!/bin/sh
# How long it takes on a machine with nothing but Python from `pip install` to the first answer about a robot:
#
#   benchmarks/first_answer.sh WHEEL ROBOT [MINUTES]
#
# MINUTES is the budget of the search, 1 unless given. Ends with a line of seconds, or with the status of what failed.
set -eu

wheel="$1" robot="$(realpath "$2")" minutes="${3:-1}"
work="$(mktemp -d)"
trap 'rm -rf "${work}"' EXIT

python3 -m venv "${work}/environment"
"${work}/environment/bin/pip" install --quiet --disable-pip-version-check "pip>=20.3" # which knows the wheel's tag
begin="$(date +%s)"
"${work}/environment/bin/pip" install --quiet --disable-pip-version-check "${wheel}"
installed="$(date +%s)"
cd "${work}"
"${work}/environment/bin/assay" check "${robot}"
checked="$(date +%s)"
"${work}/environment/bin/python" -m assay run "${robot}" --minutes "${minutes}" --out results
answered="$(date +%s)"
test -s results/report.html
"${work}/environment/bin/assay" simulate "${robot}" --engine ode-quick --timestep 1 --duration 0.1 --out run.csv
test -s run.csv
"${work}/environment/bin/python" - <<'END'
import sys

import assay

assert assay.Results("results").values("dicts")
if sys.version_info >= (3, 10):
    run = assay.Simulation(assay.load("humanoid"), "mujoco-euler", timestep_ms=1)
    run.step()
    assert run.read().bodies.shape[1] == 13
END
echo "$(. /etc/os-release && echo "${PRETTY_NAME}"), $(python3 -V), load $(cut -d' ' -f1 /proc/loadavg): installed after $((installed - begin)) s," \
  "checked after $((checked - begin)) s, answered after $((answered - begin)) s"
