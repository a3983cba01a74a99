"""The table of docs/lab/reliability.md: what the tests of faults leave, and what docs/update.py makes of it."""

import json
import os
import subprocess
import sys
import textwrap

from harness import SOURCE, AssayTest, main

# Indented: CTest takes tests from lines that begin as a class or a test does.
MODULE = textwrap.dedent("""
    import sys
    sys.path.insert(0, {folder!r})
    from harness import AssayTest, main, reliability

    class Faults(AssayTest):
        def test_a_part_fails(self):
            with self.subTest("part"):
                self.fail("on purpose")
            reliability("of a part that fails", 1, "outcome", "lost")

        def test_all_parts_pass(self):
            with self.subTest("part"):
                pass
            reliability("of parts | that pass", 2, "outcome", "nothing")

        def test_left_out(self):
            self.skipTest("nothing is here")

    main()
    """)
PAGE = """before
<!-- faults: begin -->
| fault | tries | outcome | lost |
| --- | ---: | --- | --- |
| of parts \\\\| that pass | 1 | outcome | nothing |
| what is not run | 1 | outcome | nothing |
<!-- faults: end -->
after
"""


class Reliability(AssayTest):
    def setUp(self):
        super().setUp()
        self.write("lines/other.txt", "")
        self.write("test_made.py", MODULE.format(folder=str(SOURCE / "tests/cli")))
        made = subprocess.run([sys.executable, "-B", "test_made.py"], cwd=self.dir, capture_output=True, text=True,
                              env={**os.environ, "ASSAY_RELIABILITY": str(self.dir / "lines"), "ASSAY_PROGRAM": "none"})
        self.assertEqual(made.returncode, 1, made.stderr)
        self.page = self.write("page.md", PAGE.replace("\\\\", "\\"))

    def update(self, *arguments):
        return subprocess.run([sys.executable, "-B", str(SOURCE / "docs/update.py"), "reliability", "lines", "--page", "page.md", *arguments],
                              cwd=self.dir, capture_output=True, text=True)

    def test_a_failed_part_leaves_no_line_and_a_skip_is_told(self):
        left = [json.loads(path.read_text()) for path in (self.dir / "lines").glob("*.json")]
        self.assertEqual([line["fault"] for line in left if "fault" in line], ["of parts | that pass"])
        self.assertEqual([(line["skipped"], line["reason"]) for line in left if "skipped" in line],
                         [("test_made.Faults.test_left_out", "nothing is here")])

    def test_no_line_of_the_page_is_lost_silently(self):
        before = self.page.read_text()
        done = self.update()
        self.assertEqual(done.returncode, 1)
        self.assertIn("\nwhat is not run\n", done.stderr)
        self.assertNotIn("of parts", done.stderr)
        self.assertEqual(self.page.read_text(), before)
        for _ in range(2):  # the second time from the page that the first one wrote
            self.assertEqual(self.update("--allow-missing").returncode, 0)
            text = self.page.read_text()
            self.assertIn("| of parts \\| that pass | 2 | outcome | nothing |\n", text)
            self.assertRegex(text, r"\nRun on \d{4}-\d\d-\d\d, .+, Linux .+; skipped: test_made.Faults.test_left_out \(nothing is here\)\.\n")
            self.assertEqual(text.count("\n- not run here: what is not run\n"), 1)
        self.assertEqual(self.update().returncode, 1, "it still counts")
        self.assertEqual(self.update("--forget").returncode, 0)
        self.assertNotIn("what is not run", self.page.read_text())
        self.assertEqual(self.update().returncode, 0)
        self.assertTrue(self.page.read_text().startswith("before\n") and self.page.read_text().endswith("after\n"))


if __name__ == "__main__":
    main()
