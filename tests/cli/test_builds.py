"""How engines were built: what is read from binaries, and what the program says of its engines."""

import importlib.util
import json
import subprocess

from harness import SOURCE, AssayTest, main

# Without libraries and start files, so that nothing but this code is in the binary.
CODE = """
#include <assert.h>
double half(double x) { return 0.5 * x; }
float third(float x) { return x / 3; }
void scale(double* x, double a) { for (int i = 0; i < 64; ++i) x[i] = a * x[i] + 1; }
void check(int n) { assert(n > 0); }
"""


def read(*paths):
    spec = importlib.util.spec_from_file_location("binary_facts", SOURCE / "cmake/binary_facts.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.facts("objdump", [str(path) for path in paths])


class Binaries(AssayTest):
    def compiled(self, name, *flags):
        source = self.dir / "code.c"
        source.write_text(CODE)
        subprocess.run(["cc", "-O3", "-fPIC", "-shared", "-nostdlib", *flags, "-o", self.dir / name, source], check=True)
        return self.dir / name

    def test_instruction_sets_and_precision(self):
        base = read(self.compiled("base.so", "-DNDEBUG"))
        counts = base["counts"]
        self.assertGreater(counts["scalar"], 2)
        self.assertGreater(counts["vector"], 0, "the loop is a vector loop")
        self.assertEqual([counts[key] for key in ("avx", "avx256", "avx512", "fma", "x87", "beyond_sse2")], [0] * 6)
        self.assertGreaterEqual(counts["single"], 1)
        self.assertGreater(counts["double"], counts["single"])
        self.assertEqual(base["assertions"], {"functions": [], "messages": 0})
        wide = read(self.compiled("wide.so", "-DNDEBUG", "-march=x86-64-v3"))["counts"]
        self.assertEqual(wide["scalar"] + wide["vector"], 0, "all of it is VEX encoded")
        self.assertGreater(wide["avx"], 0)
        self.assertGreater(wide["avx256"], 0)
        self.assertGreater(wide["fma"], 0, "a * x + 1 is contracted")
        apart = read(self.compiled("apart.so", "-DNDEBUG", "-march=x86-64-v3", "-ffp-contract=off"))["counts"]
        self.assertEqual(apart["fma"], 0)
        both = read(self.dir / "base.so", self.dir / "wide.so")["counts"]
        self.assertEqual(both, {key: counts[key] + wide[key] for key in counts})

    def test_assertions_are_seen(self):
        self.assertEqual(read(self.compiled("checked.so"))["assertions"]["functions"], ["__assert_fail"])


class Engines(AssayTest):
    """What `assay list engines --builds` says of each engine, against what its adapter declares."""

    def setUp(self):
        super().setUp()
        self.builds = self.assay_json("engines", "--builds", "--json")["builds"]
        if all(build["binary"] is None for build in self.builds):
            self.skipTest("this build does not read its binaries")

    def test_the_baseline_is_the_baseline(self):
        from_source = [build for build in self.builds if build["build"] == "baseline" and ("-O3" in build["flags"] or build["engine"] == "rapier")]
        if not from_source:
            self.skipTest("no engine was built from source")
        for build in from_source:
            with self.subTest(engine=build["engine"]):
                counts = build["binary"]["counts"]
                wider = counts["avx"] + counts["avx256"] + counts["avx512"]
                self.assertTrue(build["binary"]["instruction_set"].startswith("SSE"))
                self.assertEqual(build["binary"]["assertions"]["functions"], [])
                if build["engine"] in ("ode", "dart"):
                    # ODE's, which DART's plugin has in it: release builds keep the checks of arguments and of what only a defect could break
                    self.assertEqual([wider, counts["fma"]], [0, 0])
                    self.assertLess(build["binary"]["assertions"]["messages"], 30)
                elif build["engine"] == "rapier":
                    # a crate chooses its matrix products when it runs; Rust keeps its assertions in release builds
                    self.assertLess(wider, 0.01 * (wider + counts["scalar"] + counts["vector"]))
                else:
                    self.assertEqual([wider, counts["fma"]], [0, 0])
                    self.assertEqual(build["binary"]["assertions"]["messages"], 0)
                self.assertNotIn("-march", build["flags"])

    def test_another_build_has_its_instructions(self):
        others = [build for build in self.builds if build["build"] == "v3"]
        if not others:
            self.skipTest("no engine has the build v3 here")
        for build in others:
            with self.subTest(engine=build["engine"]):
                counts = build["binary"]["counts"]
                self.assertGreater(counts["avx"] + counts["avx256"], counts["scalar"] + counts["vector"])
                self.assertGreater(counts["avx256"], 0)

    def test_another_build_conforms(self):
        """Rows of the adapter are arrays that the model library allocates and the adapter frees, or the other way round."""
        contenders = {"ode": "ode-step", "bullet-f64": "bullet-si-f64", "dart": "dart"}
        ours = [contenders[build["engine"]] + "@v3" for build in self.builds if build["build"] == "v3" and build["engine"] in contenders]
        if not ours:
            self.skipTest("no engine has the build v3 here")
        tests = [part for test in ("coupling", "wide-range", "tendon-limit", "planar-chain") for part in ("--test", test)]
        for row in self.assay_json("conformance", *ours, *tests, "--json")["contenders"]:
            self.assertEqual({each["test"]: each["note"] for each in row["results"] if each["status"] == "fail"}, {}, row["contender"])

    def test_precision_is_what_the_adapter_declares(self):
        declared = {}
        for contender in self.assay_json("engines", "--json")["contenders"]:
            declared.setdefault(contender["engine"], set()).add(contender["capabilities"]["precision"])
        compared = 0
        for build in self.builds:
            counts = build["binary"]["counts"] if build["binary"] else {"single": 0, "double": 0}
            # Rapier has both precisions in one library; Jolt's double precision is that of positions.
            if declared.get(build["engine"]) not in ({"single"}, {"double"}) or build["engine"].startswith("jolt"):
                continue
            if counts["single"] + counts["double"] < 5000:
                continue  # runs elsewhere: Havok in Node
            compared += 1
            # assay's own code, in every plugin, is double; ODE's meshes, which no model here uses, are single
            most = "single" if counts["single"] > counts["double"] / 2 else "double"
            if build["engine"] != "ode":
                self.assertEqual({most}, declared[build["engine"]], build["engine"])
        self.assertGreater(compared, 0)


if __name__ == "__main__":
    main()
