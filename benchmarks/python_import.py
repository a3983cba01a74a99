"""What an import of the Python package costs: python_import.py, with the package installed. Each try is an interpreter of its own;
the statements take turns, so that whatever else runs meets all of them."""

import statistics
import subprocess
import sys
import time

TRIES = 15
STATEMENTS = {
    "nothing": "pass",
    "import assay": "import assay",
    "import numpy": "import numpy",
    "import assay, with the extension and NumPy": "import assay; assay.Simulation",
}


def main():
    times = {name: [] for name in STATEMENTS}
    for _ in range(TRIES + 1):
        for name, code in STATEMENTS.items():
            start = time.perf_counter()
            subprocess.run([sys.executable, "-c", code], check=True)
            times[name].append(time.perf_counter() - start)
    bare = statistics.median(times["nothing"][1:])  # the first round reads files from the disk
    print(f"median of {TRIES}, ms above an interpreter that does nothing ({1e3 * bare:.0f} ms); least to most")
    for name, all_of in list(times.items())[1:]:
        above = sorted(1e3 * (each - bare) for each in all_of[1:])
        print(f"{name:<44} {statistics.median(above):6.0f}   {above[0]:.0f} to {above[-1]:.0f}")


if __name__ == "__main__":
    main()
