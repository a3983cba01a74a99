"""`assay match --check`: what measured logs can tell, and each of their mistakes in a sentence."""

import gzip
import lzma
import math
import pickle
import struct
import zipfile

from harness import SOURCE, AssayTest, main

PENDULUM = """<mujoco model="pendulum"><worldbody><body name="link"><joint name="hinge" axis="0 1 0"/>
<inertial pos="0 0 -0.3" mass="0.5" diaginertia="0.001 0.001 0.001"/><geom size="0.01" contype="0" conaffinity="0"/>
</body></worldbody></mujoco>"""


def swing(torque=1.0, angle=1.0, hand=0.0):
    """Rows of a pendulum's motion under sines of torque; the columns of angle and torque times a factor."""
    inertia, weight, position, velocity, step, rows = 0.046, 0.5 * 9.81 * 0.3, 1.0, 0.0, 5e-4, []
    for i in range(12000):
        time = i * step
        drive = 0.5 * math.sin(4.5 * time) + 0.3 * math.sin(7.3 * time + 1)
        if i % 10 == 0:
            rows.append([time, position * angle, velocity, drive * torque])
        push = hand if 2 < time < 2.8 else 0
        velocity += step * (drive + push - weight * math.sin(position) - 0.03 * velocity) / inertia
        position += step * velocity
    return rows


def csv_text(rows, header="time,hinge,hinge.velocity,hinge.torque"):
    return header + "\n" + "".join(",".join(str(x) if isinstance(x, str) else f"{x:.6f}" for x in row) + "\n" for row in rows)


class Check(AssayTest):
    def setUp(self):
        super().setUp()
        self.write("pendulum.xml", PENDULUM)

    def check(self, rows, *more, name="run.csv"):
        self.write(name, csv_text(rows))
        self.write("again.csv", csv_text(swing()))
        return self.assay_json("match", "pendulum.xml", "--log", name, "--log", "again.csv", "--check", "--json", *more)

    def kinds(self, rows, *more):
        found = self.check(rows, *more)["findings"]
        return {finding["kind"] for finding in found if finding["severity"] != "remark" and finding["log"] == "run"}

    def test_a_clean_log_has_rates_noise_and_no_finding(self):
        found = self.check(swing())
        self.assertEqual([log["log"] for log in found["logs"]], ["run", "again"])
        self.assertAlmostEqual(found["logs"][0]["rate_hz"], 200, places=3)
        self.assertEqual(found["logs"][0]["samples"], 1200)
        self.assertEqual([f for f in found["findings"] if f["severity"] != "remark"], [])
        text = self.assay("match", "pendulum.xml", "--log", "run.csv", "--log", "again.csv", "--check")
        self.assertIn("hinge.torque", text)

    def test_signs_units_and_hands(self):
        self.assertIn("torque sign", self.kinds(swing(torque=-1)))
        self.assertIn("degrees", self.kinds(swing(angle=180 / math.pi)))
        self.assertIn("hands", self.kinds(swing(torque=0, hand=2.5)))

    def test_the_fix_that_a_finding_names_removes_it(self):
        self.write("match.toml", '[scale]\n"hinge.torque" = -1\n')
        self.write("run.csv", csv_text(swing(torque=-1)))
        self.write("again.csv", csv_text(swing(torque=-1)))
        found = self.assay_json("match", "pendulum.xml", "--log", "run.csv", "--log", "again.csv", "--config", "match.toml", "--check",
                                "--json")
        self.assertNotIn("torque sign", {finding["kind"] for finding in found["findings"]})

    def test_mistakes_of_files_name_line_and_column(self):
        rows = swing()
        rows[10] = rows[10][:1] + ["nan"] + rows[10][2:]
        self.refused_log(rows, ["run.csv:12", "'hinge'", "'nan'", "remove the line"])
        rows = swing()
        rows[10], rows[11] = rows[11], rows[10]
        self.refused_log(rows, ["run.csv:13", "'time'", "does not come after"])
        self.write("run.csv", csv_text(swing(), "time,hinge,hinge.velocity,hinge.torqe"))
        self.refused("match", "pendulum.xml", "--log", "run.csv", "--check", naming=["hinge.torqe", "did you mean 'hinge.torque'"])

    def refused_log(self, rows, naming):
        self.write("run.csv", csv_text(rows))
        self.refused("match", "pendulum.xml", "--log", "run.csv", "--check", naming=naming)

    def test_compressed_files_are_read(self):
        text = csv_text(swing()).encode()
        (self.dir / "a.csv.gz").write_bytes(gzip.compress(text))
        (self.dir / "b.csv.xz").write_bytes(lzma.compress(text))
        found = self.assay_json("match", "pendulum.xml", "--log", "a.csv.gz", "--log", "b.csv.xz", "--check", "--json")
        self.assertEqual([(log["log"], log["samples"]) for log in found["logs"]], [("a", 1200), ("b", 1200)])

    def npz(self, name, arrays):
        """Writes arrays of (type, shape, bytes) as numpy.savez() does."""
        with zipfile.ZipFile(self.dir / name, "w") as archive:
            for key, (kind, shape, content) in arrays.items():
                header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
                header += b" " * (63 - (len(header) + 10) % 64) + b"\n"
                archive.writestr(key + ".npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + content)

    def test_arrays_that_cannot_be_read_are_named(self):
        rows = swing()
        column = lambda k, form="d": struct.pack(f"<{len(rows)}{form}", *(row[k] for row in rows))
        n = len(rows)
        good = {"time": ("<f8", f"({n},)", column(0)), "hinge": ("<f4", f"({n},)", column(1, "f"))}
        self.npz("a.npz", good)
        found = self.assay_json("match", "pendulum.xml", "--log", "a.npz", "--check", "--json")
        self.assertEqual(found["logs"][0]["samples"], n)
        for change, words in [
            ({"hinge": ("<f2", f"({n},)", bytes(2 * n))}, ["'hinge' is not read", "<f2"]),
            ({"hinge": ("<f8", f"({n}, 1, 1)", column(1))}, ["'hinge' is not read", "3 dimensions"]),
            ({"time": ("<f8", f"({n}, 1)", column(0))}, ["did you mean 'time[0]'"]),
            ({"hinge": ("<f8", f"({n - 1},)", column(1)[8:])}, [str(n - 1), str(n)]),
            ({"hinge": ("|O", f"({n},)", pickle.dumps([1.0] * n))}, ["'hinge'", "Python objects", "never read"]),
            ({"note": ("|O", "(1,)", pickle.dumps(["x"]))}, ["'note'", "Python objects"]),
        ]:
            with self.subTest(change=list(change), words=words):
                self.npz("b.npz", good | change)
                self.refused("match", "pendulum.xml", "--log", "b.npz", "--check", naming=["b.npz", *words])

    def test_an_index_without_a_name_is_no_motion(self):
        self.write("run.csv", csv_text([[float(i), *row] for i, row in enumerate(swing())], ",time,hinge,hinge.velocity,hinge.torque"))
        self.refused("match", "pendulum.xml", "--log", "run.csv", "--check", naming=["run.csv", "column 1 has no name", "index=False"])

    def test_faults_name_further_lines(self):
        rows = swing()
        for i in (10, 20, 30):
            rows[i] = [rows[i][0], "nan", *rows[i][2:]]
        self.refused_log(rows, ["run.csv:12", "2 more faults, in lines 22, 32"])

    def test_a_sensor_of_one_turn_is_read_as_going_on(self):
        # far over the top: wrapped and as it is the same
        whole = [[t, 4 * math.sin(2 * t), 8 * math.cos(2 * t), 0.1 * math.sin(3 * t)] for t in (i / 200 for i in range(1200))]
        wrapped = [[t, math.remainder(q, 2 * math.pi), v, u] for t, q, v, u in whole]
        found = {}
        for name, rows in (("whole", whole), ("wrapped", wrapped)):
            report = self.check(rows, name=f"{name}.csv")
            range_of = next(q for q in report["logs"][0]["quantities"] if q["quantity"] == "hinge")
            kinds = {f["kind"] for f in report["findings"] if f["log"] == name}
            found[name] = (range_of["lowest"], range_of["highest"], kinds)
        self.assertIn("turns", found["wrapped"][2])
        self.assertEqual(found["wrapped"][2] - {"turns"}, found["whole"][2])
        for k in (0, 1):
            self.assertAlmostEqual(found["wrapped"][k], found["whole"][k], places=5)
        degrees = [[t, math.degrees(q), math.degrees(v), u] for t, q, v, u in wrapped]
        self.assertIn("degrees", self.kinds(degrees))

    def test_times_in_milliseconds(self):
        rows = [[1000 * row[0], *row[1:]] for row in swing()]
        self.assertEqual(self.kinds(rows), {"time unit"})
        self.write("match.toml", '[units]\ntime = "ms"\n')
        self.write("again.csv", csv_text(rows))
        found = self.assay_json("match", "pendulum.xml", "--log", "run.csv", "--config", "match.toml", "--check", "--json")
        self.assertNotIn("time unit", {finding["kind"] for finding in found["findings"]})

    def test_what_is_to_be_fitted_is_checked_too(self):
        self.write("run.csv", csv_text(swing()))
        for words, naming in [("dampnig", ["dampnig", "damping"]), ("damping:knee", ["knee", "hinge"]), ("damping=-1,1", ["damping", "-1", "negative"]),
                              ("mass=0,1", ["mass", "above 0"])]:
            with self.subTest(words):
                self.refused("match", "pendulum.xml", "--log", "run.csv", "--check", "--fit", words, naming=naming)

    def test_the_models_of_the_examples_load(self):
        for model in ("pendulum", "double_pendulum", "cube"):
            self.assay("simulate", SOURCE / f"examples/match/{model}.xml", "--engine", "mujoco-euler", "--timestep", "1", "--duration",
                       "0.01", "--out", "-")


if __name__ == "__main__":
    main()
