"""What a person sees: lines that fit the terminal, colour only where it is wanted, names that cannot steer it."""

import re
import unicodedata

from harness import BALL, COMMANDS, AssayTest, campaign, main

ESCAPE = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")
# Springs, limits, armature and contacts: each engine has something to say of it.
MODEL = "humanoid"

TINY = campaign("tiny", ["1/4", 1], ["raw_speed", "consistency"], timing={"rounds": 3, "batch_ms": 1}, duration_s=0.16, pieces=2,
                piece_ms=32)


def columns_of(line):
    """Columns that a terminal shows."""
    return sum(0 if unicodedata.combining(c) or unicodedata.category(c) == "Cf" else
               2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in ESCAPE.sub("", line))


class Terminal(AssayTest):
    LISTINGS = [("--help",), *((command, "--help") for command in COMMANDS), ("engines",), ("systems",), ("check", MODEL),
                ("conformance", "--list"), ("conformance", "mujoco-euler", "--test", "free-fall", "--test", "readback")]
    REFUSALS = [("check", "planar-chian"), ("simlate",), ("simulate", MODEL, "--timstep", "1"), ("check", "nowhere.xml"),
                ("conformance", "mujoco-rk5"), ("recommend", "nowhere", MODEL, "--error", "1mm")]

    def check_fits(self, text, columns):
        for line in text.splitlines():
            for shown in re.split(r"\r(?:\x1b\[K)?", line):
                self.assertLessEqual(columns_of(shown), columns, line)

    def test_listings_fit(self):
        for columns in (80, 40):
            for arguments in self.LISTINGS:
                with self.subTest(f"{arguments} in {columns}"):
                    status, text = self.on_terminal(*arguments, columns=columns)
                    self.assertEqual(status, 0, text)
                    self.assertGreater(len(text.splitlines()), 2)
                    self.check_fits(text, columns)

    def test_refusals_fit(self):
        for columns in (80, 40):
            for arguments in self.REFUSALS:
                with self.subTest(f"{arguments} in {columns}"):
                    status, text = self.on_terminal(*arguments, columns=columns)
                    self.assertEqual(status, 2, text)
                    self.check_fits(text, columns)

    def test_nothing_is_lost_by_fitting(self):
        # headings of first columns and of columns that are empty stand in a table alone
        words = set(re.findall(r"[\w-]+", self.assay("check", MODEL))) - {"engine", "refused", "approximated", "elements", "by",
                                                                         "each", "alone"}
        for columns in (80, 40):
            shown = ESCAPE.sub("", self.on_terminal("check", MODEL, columns=columns)[1])
            self.assertLessEqual(words, set(re.findall(r"[\w-]+", shown)), columns)

    def test_numbers_are_not_broken(self):
        rows = self.assay_json("systems", "--json")["systems"]
        for columns in (80, 40):
            words = ESCAPE.sub("", self.on_terminal("systems", columns=columns)[1]).replace(";", "").split()
            for row in rows:
                self.assertIn(str(row["contact_pairs"]), words)

    def test_a_terminal_that_does_not_know_its_size(self):
        _, text = self.on_terminal("check", MODEL, columns=0, COLUMNS="60")
        self.check_fits(text, 60)
        self.assertGreater(max(map(columns_of, text.splitlines())), 50)
        _, text = self.on_terminal("check", MODEL, columns=0)
        self.check_fits(text, 80)

    def test_a_pipe_gets_whole_lines(self):
        self.env["COLUMNS"] = "40"
        self.assertEqual(len(self.assay("systems").splitlines()),
                         1 + len(self.assay_json("systems", "--json")["systems"]))
        self.assertEqual(len(self.assay("engines").split("\n\n")[0].splitlines()), 1 + len(self.contenders()))

    def test_colour_is_for_terminals_that_want_it(self):
        coloured = self.on_terminal("check", MODEL)[1]
        self.assertRegex(coloured, r"\x1b\[[0-9;]+mapproximated\x1b\[0m")
        self.assertRegex(self.on_terminal("--help")[1], r"\x1b\[1mOptions\x1b\[0m:")
        for environment in ({"NO_COLOR": "1"}, {"TERM": "dumb"}, {"NO_COLOR": "1", "CLICOLOR_FORCE": "1"}):
            with self.subTest(environment):
                plain = self.on_terminal("check", MODEL, **environment)[1]
                self.assertNotIn("\x1b", plain)
                # the words say what the colours say
                self.assertEqual(plain, ESCAPE.sub("", coloured))
        self.assertNotIn("\x1b", self.assay("check", MODEL))
        self.env["CLICOLOR_FORCE"] = "1"
        self.assertEqual(ESCAPE.sub("", self.assay("check", MODEL)), self.run_plain("check", MODEL))
        self.assertIn("\x1b[", self.assay("check", MODEL))

    def run_plain(self, *arguments):
        self.env["NO_COLOR"] = "1"
        text = self.assay(*arguments)
        del self.env["NO_COLOR"]
        return text

    def test_progress_stays_on_one_line(self):
        self.use_mishap_engine()
        self.write("ball.xml", BALL)
        status, text = self.on_terminal("simulate", "ball.xml", "--engine", "mishap-slow", "--timestep", "10",
                                        "--duration", "2", "--out", "run.csv", columns=30)
        self.assertEqual(status, 0)
        self.assertIn("…", text)
        self.assertNotIn("\n", text)
        self.check_fits(text, 29)


    def test_campaign_and_its_results_fit(self):
        self.write("tiny.toml", TINY)
        for columns in (80, 40):
            status, text = self.on_terminal("run", "tiny.toml", "--out", f"results-{columns}", columns=columns)
            self.assertEqual(status, 0, text)
            self.assertRegex(text, r"\d+ cells in ")
            self.check_fits(text, columns)
            for arguments in [("report", f"results-{columns}"),
                              ("export", f"results-{columns}", "--trajectories", "csv", "--out", f"states-{columns}")]:
                self.check_fits(self.on_terminal(*arguments, columns=columns)[1], columns)


class Safety(AssayTest):
    NAME = "\u009b31mred\u202ekcab \U0001f916\u673a\u68b0"  # an escape, a turn of the direction, wide characters

    def test_names_of_a_model_cannot_steer_the_terminal(self):
        self.use_mishap_engine()
        self.write("ball.xml", BALL.replace('body name="ball"', f'body name="{self.NAME}"'))
        for text in (self.assay("check", "ball.xml"), self.on_terminal("check", "ball.xml", columns=40)[1]):
            self.assertIn("\\u009b31mred\\u202ekcab", text)
            for raw in ("\u009b", "\u202e"):
                self.assertNotIn(raw, text)
            for line in text.splitlines():
                if text.count("\x1b"):
                    self.assertLessEqual(columns_of(line), 40, line)

    def test_arguments_cannot_steer_the_terminal(self):
        for arguments in [("check", "no\x1b[2Jwhere.xml"), ("\x1b]0;title\x07",), ("check", "a\nassay: forged"),
                          ("simulate", "planar-chain", "--\x1b[31m")]:
            with self.subTest(arguments):
                done = self.run_assay(*arguments)
                self.assertEqual(done.returncode, 2)
                self.assertNotRegex(done.stderr, r"[\x00-\x09\x0b-\x1f\x7f]")
                self.check_sentence(done.stderr)

    def test_invalid_text_is_shown_as_bytes(self):
        done = self.run_assay("check", b"caf\xe9.xml".decode("utf-8", "surrogateescape"))
        self.check_sentence(done.stderr, ["caf\\xe9.xml"])


if __name__ == "__main__":
    main()
