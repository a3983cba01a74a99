"""`assay parity`: the certificate as a file, in results, and in their report."""

import json
import re

from harness import AssayTest, campaign, main


class Certificate(AssayTest):
    def test_in_results_is_a_section_of_the_report(self):
        self.write("small.toml", campaign("small", [4], ["drift"], duration_s=0.064, sample_ms=32))
        self.assay("run", "small.toml", "--out", "results")
        self.assay("report", "results")
        self.assertEqual(self.in_report(), [])
        done = self.run_assay("parity", "planar-chain", "mujoco-euler", "--samples", "2", "--out", "results")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("assay report results", done.stderr)
        stored = json.loads((self.dir / "results/parity/planar-chain.json").read_text())
        self.assertEqual(stored["model"], "planar-chain")
        self.assay("report", "results")
        self.assertEqual(self.in_report(), [stored])

    def test_is_not_written_through_links(self):
        victim = self.write("victim", "mine")
        (self.dir / "r/parity").mkdir(parents=True)
        file = self.dir / "r/parity/planar-chain.json"
        file.symlink_to(victim)
        command = ["parity", "planar-chain", "mujoco-euler", "--samples", "2", "--out"]
        self.assay(*command, "r")
        self.assertFalse(file.is_symlink())
        self.assertEqual(json.loads(file.read_text())["model"], "planar-chain")
        file.unlink()
        file.parent.rmdir()
        (self.dir / "elsewhere").mkdir()
        file.parent.symlink_to(self.dir / "elsewhere")

        def is_refused(out, naming):
            done = self.run_assay(*command, out)
            self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
            self.check_sentence(done.stderr.splitlines()[-1], naming)  # after the progress

        is_refused("r", ["r/parity'", "a symbolic link"])
        self.assertEqual(list((self.dir / "elsewhere").iterdir()), [])
        (self.dir / "one.json.partial").symlink_to(victim)
        is_refused("one.json", ["'one.json.partial'", "a symbolic link"])
        self.assertEqual(victim.read_text(), "mine")

    def in_report(self):
        page = (self.dir / "results/report.html").read_text()
        data = re.search(r'<script[^>]*id="assay-data"[^>]*>(.*?)</script>', page, re.S).group(1)
        return json.loads(data)["parity"]

    def test_of_a_folder_or_a_file(self):
        folder = self.dir / "certificates"
        folder.mkdir()
        for out, file in (("certificates", "certificates/parity/planar-chain.json"), ("one.json", "one.json")):
            self.assay("parity", "planar-chain", "mujoco-euler", "--samples", "2", "--out", out)
            certificate = json.loads((self.dir / file).read_text())["certificates"][0]
            self.assertEqual(certificate["verdict"], "same")
            for joint in certificate["joints"]:
                self.assertEqual(set(joint) - {"element"}, {"inertia", "Coriolis", "gravity", "springs", "damping", "dry friction",
                                                            "armature", "torque"})
                self.assertLess(joint["armature"]["error"], 1e-6)


if __name__ == "__main__":
    main()
