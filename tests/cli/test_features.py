"""`assay list engines --features`: which parts of a model each engine has."""

from harness import SOURCE, AssayTest, main


class Features(AssayTest):
    def test_every_feature_of_every_contender_stands_in_the_table(self):
        listed = self.assay_json("engines", "--json")["contenders"]
        table = self.assay_json("engines", "--features", "--json")
        contenders = [name for group in table["groups"] for name in group["contenders"]]
        self.assertEqual(sorted(contenders), sorted(c["contender"] for c in listed if c["contender"] != "null"))
        keys = [feature["feature"] for feature in table["features"]]
        self.assertIn("slide", keys)
        for group in table["groups"]:
            self.assertEqual(list(group["support"]), keys)
            for feature, support in group["support"].items():
                with self.subTest(contender=group["label"], feature=feature):
                    self.assertIn(support["fidelity"], ("exact", "approximated", "refused"))
                    self.assertTrue(support["how"] or support["fidelity"] != "approximated", "does not say how")

    def test_the_table_fits_a_terminal(self):
        groups = len(self.assay_json("engines", "--features", "--json")["groups"])
        for columns in (60, 100):  # the narrow one needs several tables
            status, text = self.on_terminal("engines", "--features", columns=columns, NO_COLOR="1")
            self.assertEqual(status, 0)
            for feature in ("slide", "torsional-friction"):
                rows = [line for line in text.splitlines() if line.startswith(feature + " ")]
                marks = [mark for row in rows for mark in row.split()[1:]]
                self.assertEqual(len(marks), groups)
                self.assertLessEqual(set(marks), {"=", "~", "-"})
                self.assertLessEqual(max(map(len, rows)), columns)

    def test_the_document_is_up_to_date(self):
        listed = self.assay_json("engines", "--json")
        engines = SOURCE / "src/engines"
        rare = {path.parent.name for path in engines.glob("*/about.toml") if 'set_up = "rare"' in path.read_text()}
        rare |= {path.parent.name for path in engines.glob("*/requirements.txt")}
        here = {row["engine"] for row in listed["contenders"]}
        # what ./test sets up
        if here & rare or not {row["engine"] for row in listed["absent"]} <= rare:
            self.skipTest("the document has all engines but those that are set up only when they are named")
        document = (SOURCE / "src/engines/features.md").read_text(encoding="utf-8")
        self.assertEqual(document, self.assay("engines", "--features", "--markdown"),
                         "run ./assay list engines --features --markdown > src/engines/features.md")


if __name__ == "__main__":
    main()
