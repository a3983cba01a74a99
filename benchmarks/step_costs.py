#!/usr/bin/env python3
"""Writes src/campaign/step_costs.inc, from which shards are balanced: the time of a step of each contender, per body, from
the timings of a results directory.

    benchmarks/step_costs.py results/amd-epyc-2-cores/assay.sqlite.xz > src/campaign/step_costs.inc
"""

import collections
import json
import lzma
import math
import pathlib
import sqlite3
import sys
import tempfile


def main():
    source = pathlib.Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        path = source
        if source.suffix == ".xz":
            path = pathlib.Path(folder) / "assay.sqlite"
            path.write_bytes(lzma.decompress(source.read_bytes()))
        db = sqlite3.connect(f"file:{path}?immutable=1", uri=True)
        facts = {name: json.loads(text) for name, text in db.execute("SELECT name, json FROM systems")}
        times = collections.defaultdict(list)
        for system, contender, value in db.execute(
                """SELECT c.system, c.contender, v.value FROM cells c JOIN "values" v ON v.cell_id = c.id
                   WHERE v.name = 'step_time' AND c.outcome = 'ok' AND v.value > 0"""):
            contacts = facts[system].get("contact_pairs", 0) > 0
            times[contender, contacts].append(math.log(value / facts[system]["bodies"]))
    print("// Written by benchmarks/step_costs.py from measured step times; microseconds of a step per body: contender, model\n"
          "// without contact pairs, model with them; 0 where it was not measured.")
    for contender in sorted({name for name, _ in times} - {"null"}):
        free, contact = (math.exp(sum(found) / len(found)) if found else 0
                         for found in (times[contender, False], times[contender, True]))
        print(f'{{"{contender}", {free:.2f}, {contact:.2f}}},')


main()
