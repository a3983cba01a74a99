"""Committed results, docs/lab/claims.md, docs/lab/contact-truth.md, docs/lab/engines.md and docs/lab/settings.md: the pages agree with the results, and no file names
a path of the machine."""

import lzma
import math
import re
import subprocess
import sys

from harness import SOURCE, AssayTest, main

sys.path.insert(0, str(SOURCE / "docs"))
from tables import claims, common, contacts  # noqa: E402

RESULTS = SOURCE / "results/intel-xeon-2-cores"
PAGE = SOURCE / "docs/lab/claims.md"
VERDICTS = {"holds": "holds", "changed": "**changed**", "not-settled": "not settled", "not-measurable": "**not measurable**"}
ABSOLUTE = re.compile(rb"(?<![\w.~-])/(?:tmp|work|root|home|mnt|opt|srv|Users)/[\w.-]+|\b[A-Z]:\\\\?Users\b")


class ClaimsPageTest(AssayTest):
    def database(self):
        return lzma.decompress((RESULTS / "assay.sqlite.xz").read_bytes())

    def unpack(self):
        folder = self.dir / "results"
        folder.mkdir()
        (folder / "assay.sqlite").write_bytes(self.database())
        return folder

    def test_the_page_says_what_the_results_say(self):
        folder = self.unpack()
        text = PAGE.read_text(encoding="utf-8")
        blocks = {"claims": self.assay("claims", folder, "--markdown"), "failures": claims.failures(folder)}
        self.assertEqual(common.updated(text, blocks), text, "write it with docs/update.py claims")
        verdicts = self.assay_json("claims", folder, "--json")
        self.assertEqual([claim["number"] for claim in verdicts], list(range(1, 18)))
        for claim in verdicts:
            self.assertIn(f"| {claim['number']} | {claim['title']} | {VERDICTS[claim['verdict']]} |", text)
            explained = re.search(rf"^### {claim['number']}: ", text, re.MULTILINE) is not None
            self.assertEqual(explained, claim["verdict"] in ("changed", "not-settled"), f"claim {claim['number']}")

    def test_the_values_are_those_of_the_database(self):
        exported = self.assay("export", self.unpack(), "--format", "csv")
        self.assertEqual(exported.splitlines(), (RESULTS / "values.csv").read_text(encoding="utf-8").splitlines())

    def test_no_file_tells_where_it_was_made(self):
        own = [path for path in RESULTS.rglob("*") if path.is_file()]
        self.assertLess(sum(path.stat().st_size for path in own), 22e6)
        self.assertIn(RESULTS / "report.html", own)
        for path in [path for path in RESULTS.parent.glob("*/**/*") if path.is_file()]:
            data = path.read_bytes()
            found = ABSOLUTE.search(lzma.decompress(data) if path.suffix == ".xz" else data)
            self.assertIsNone(found, f"{path}: {found and found.group()}")

    def test_the_page_of_the_engines_says_what_their_results_say(self):
        page = SOURCE / "docs/lab/engines.md"
        field, worlds = (SOURCE / "results" / re.search(rf"results/({kind}-[\d-]+)/README", page.read_text(encoding="utf-8")).group(1)
                         / "assay.sqlite.xz" for kind in ("field", "worlds"))
        again = self.write("engines.md", page.read_text(encoding="utf-8"))
        subprocess.run([sys.executable, "-B", SOURCE / "docs/update.py", "engines", self.program, field, "--worlds", worlds, "--page",
                        again], check=True, env=self.env)
        self.assertEqual(again.read_text(encoding="utf-8"), page.read_text(encoding="utf-8"),
                         "write it with docs/update.py engines")

    def test_the_tables_of_settings_and_builds_say_what_their_results_say(self):
        pages = {name: (SOURCE / "docs/lab" / name).read_text(encoding="utf-8") for name in ("settings.md", "performance.md")}
        for name, text in pages.items():
            self.write(name, text)
        results = {kind: SOURCE / "results" / re.search(rf"results/({kind}-[\d-]+)/README", text).group(1) / "assay.sqlite.xz"
                   for kind, text in zip(("settings", "builds"), pages.values())}
        subprocess.run([sys.executable, "-B", SOURCE / "docs/update.py", "settings", self.program, "--settings", results["settings"], "--builds",
                        results["builds"], "--pages", self.dir], check=True, env=self.env)
        for name, text in pages.items():
            self.assertEqual((self.dir / name).read_text(encoding="utf-8"), text, "write it with docs/update.py settings")

    def test_the_page_of_contacts_says_what_its_results_say(self):
        page = SOURCE / "docs/lab/contact-truth.md"
        text = page.read_text(encoding="utf-8")
        results = SOURCE / "results" / re.search(r"results/(contacts-[\d-]+)/README", text).group(1) / "assay.sqlite.xz"
        again = self.write("contact-truth.md", text)
        subprocess.run([sys.executable, "-B", SOURCE / "docs/update.py", "contacts", results, "--page", again], check=True, env=self.env)
        self.assertEqual(again.read_text(encoding="utf-8"), text, "write it with docs/update.py contacts")
        self.assertEqual(again.with_suffix(".svg").read_bytes(), page.with_suffix(".svg").read_bytes(), "write it with docs/update.py contacts")

    # The same braking in short steps.
    def test_where_laws_of_friction_let_the_box_stop(self):
        box = contacts.SlidingBox()
        a, (x_side, y_side, z) = box.a, box.half
        free = [1 / (1 + 3 * z ** 2 / (side ** 2 + z ** 2)) for side in (x_side, y_side)]

        def towards(x, y):
            size = math.hypot(x, y)
            return a * x / size, a * y / size

        def inside(vx, vy):
            if abs(vx - vy) < 1e-4:  # about a step
                return a / 2, a / 2
            return (a, 0) if vx > vy else (0, a)
        laws = {box.cone: towards, box.scaled: lambda vx, vy: towards(free[0] * vx, free[1] * vy), box.pyramid_inside: inside,
                box.pyramid_around: lambda vx, vy: (a * (vx > 0), a * (vy > 0))}
        for law, braking in laws.items():
            vx, vy, x, y, step = box.vx, box.vy, 0, 0, 2e-5
            while math.hypot(vx, vy) > 2e-4:
                ax, ay = braking(vx, vy)
                vx, vy = max(0, vx - step * ax), max(0, vy - step * ay)
                x, y = x + step * vx, y + step * vy
            self.assertLess(math.dist((x, y), law()), 1e-4, law.__name__)


if __name__ == "__main__":
    main()
