"""Documents: links resolve, commands exist, and lists that repeat another source agree with it."""

import json
import re

from harness import COMMANDS, OLD_COMMANDS, SOURCE, AssayTest, main

SKIPPED = {"node_modules", "build", ".cache", ".git"}


def documents():
    return [path for path in sorted(SOURCE.rglob("*.md")) if not SKIPPED & set(path.relative_to(SOURCE).parts)]


def anchors(path):
    """Anchors that forges give the headings of a page."""
    headings = re.findall(r"^#+ (.*)", path.read_text(encoding="utf-8"), re.MULTILINE)
    texts = [re.sub(r"[`*]", "", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)).strip().lower() for heading in headings]
    return {re.sub(r"[^\w\- ]", "", text).replace(" ", "-") for text in texts}


def rows(path, section=""):
    """(first, second) cell of each row of the first table after `section`."""
    text = path.read_text(encoding="utf-8")
    table = re.search(r"(?:^\|.*\n)+", text[text.index(section):], re.MULTILINE).group()
    return [tuple(cell.strip() for cell in line.split("|")[1:3]) for line in table.splitlines()[2:]]


def prose(path):
    """Lines outside of code, formulae, generated blocks, tables and pictures."""
    text = re.sub(r"```.*?```|\$\$.*?\$\$|<!-- ([\w-]+): begin -->.*?<!-- \1: end -->", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    return [line for line in text.splitlines() if not line.startswith(("|", "![", "<img"))]


class Documents(AssayTest):
    def test_pages_are_few_and_short(self):
        pages = sorted((SOURCE / "docs").glob("*.md"))
        self.assertLessEqual(len(pages), 10)
        self.assertGreater(len(pages), 5)
        self.assertLessEqual(sum(len(page.read_text(encoding="utf-8").split()) for page in pages), 35000)
        self.assertLessEqual(len((SOURCE / "README.md").read_text(encoding="utf-8").split()), 1200)
        for page in pages:
            with self.subTest(page.name):
                first_screen = page.read_text(encoding="utf-8").split("\n")[:30]
                self.assertTrue(any(line.startswith(("```", "![")) for line in first_screen), "begin with a picture or an example")

    def test_lines_are_short(self):
        for page in [SOURCE / "README.md", SOURCE / "CHANGELOG.md", *(SOURCE / "docs").glob("*.md"), *(SOURCE / "docs/lab").glob("*.md")]:
            if page.name == "builds.md":  # the program's
                continue
            self.assertEqual([line for line in prose(page) if len(line) > 120], [], page)

    def test_an_entry_of_the_changelog_is_a_line(self):
        text = (SOURCE / "CHANGELOG.md").read_text(encoding="utf-8")
        entries = text[text.index("## ["):].splitlines()
        self.assertGreater(len(entries), 50)
        for line in entries:
            self.assertRegex(line, r"^(## \[|### |- |$)")

    def test_one_version(self):
        """CMakeLists.txt owns the version; what repeats it is that of the newest release."""
        version = re.search(r"project\(assay VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)
        released = re.search(r"^## \[([\d.]+)\] - ([\d-]+)$", (SOURCE / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
        self.assertEqual(released.group(1), version)
        citation = (SOURCE / "CITATION.cff").read_text(encoding="utf-8")
        self.assertIn(f"\nversion: {version}\ndate-released: {released.group(2)}\n", citation)
        named = [found for page in documents() for found in re.findall(r"\bassay(?:_\w+)?-(\d[\d.]*)-(?:py3|\.\.\.)", page.read_text(encoding="utf-8"))]
        self.assertGreater(len(named), 2)
        self.assertEqual(set(named), {version}, "names of wheels")

    def test_links_resolve(self):
        self.assertGreater(len(documents()), 20)
        for page in documents():
            prose = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
            for link in re.findall(r"(?:\]\(|src=\")([^)\"\s]+)[)\"]", prose):
                if link.startswith("https://") or link.startswith("http://"):
                    continue
                name, _, anchor = link.partition("#")
                target = (page.parent / name).resolve() if name else page
                with self.subTest(page=page.relative_to(SOURCE), link=link):
                    self.assertTrue(target.exists())
                    if anchor and target.suffix == ".md":
                        self.assertIn(anchor, anchors(target))

    def test_readmes_of_engines_lead_to_tests_findings_and_loops(self):
        engines = sorted(path.parent for path in SOURCE.glob("src/engines/*/find.cmake"))
        self.assertGreater(len(engines), 8)
        for engine in engines:
            text = (engine / "README.md").read_text(encoding="utf-8")
            for pattern in [f"tests/engines/{engine.name}_test.cc", f"findings/{engine.name}/*.cc", f"benchmarks/direct_{engine.name}.cc",
                            f"findings/{engine.name}/[!s]*.py", f"benchmarks/direct_{engine.name}.py"]:
                for path in SOURCE.glob(pattern):
                    self.assertIn(f"](../../../{path.relative_to(SOURCE)})", text, engine.name)
            self.assertIn("](../../conformance/README.md)", text, engine.name)

    def test_commands_exist(self):
        seen = set()
        for page in documents():
            text = page.read_text(encoding="utf-8")
            for command in re.findall(r"(?m)(?:^|`|\$ )(?:\./|(?<=`)|(?<=\$ ))assay ([a-z]+)\b", text):
                seen.add(command)
                self.assertIn(command, [*COMMANDS, *OLD_COMMANDS, "completion", "robots", "setup"], page)  # the launcher itself does these
        self.assertEqual(set(COMMANDS) - seen, set(), "commands that no document mentions")

    def test_the_readme_begins_the_glossary(self):
        short = rows(SOURCE / "README.md", "## Terms")
        self.assertEqual(short, rows(SOURCE / "docs/methodology.md", "## Terms")[:len(short)])
        self.assertEqual(len(short), 5)

    def test_the_page_of_engines_has_their_versions(self):
        versions = {row["contender"]: row["version"] for row in self.assay_json("engines", "--json")["contenders"]}
        table = {re.match(r"`([\w-]+?)-?\*?`", contenders).group(1): engine
                 for engine, contenders in rows(SOURCE / "docs/engines.md", "## Versions and contenders")}
        checked = set()
        for contender, version in versions.items():
            own = [name for name in table if contender == name or contender.startswith(name + "-")]
            if own:
                engine = table[max(own, key=len)]  # `mujoco-warp` is none of `mujoco-*`
                self.assertIn(f" {version}", engine, contender)
                checked.add(engine)
        self.assertGreater(len(checked), 8)

    def test_third_party_work_is_complete(self):
        listed = (SOURCE / "THIRD_PARTY.md").read_text(encoding="utf-8")
        packages = []
        for names in [SOURCE / "setup/apt-packages.txt", *SOURCE.glob("src/engines/*/apt-packages.txt")]:
            packages += re.findall(r"^([a-z][\w.+-]+) +\|", names.read_text(), re.MULTILINE)
        for pins in [*SOURCE.glob("src/engines/*/recipe/*pins.txt"), *SOURCE.glob("setup/pip/*.txt"),
                     *SOURCE.glob("src/engines/*/requirements.txt")]:
            packages += re.findall(r"^([\w-]+)==", pins.read_text(), re.MULTILINE)
        for crates in SOURCE.glob("src/engines/*/recipe/Cargo.toml"):
            packages += re.findall(r"^([\w-]+) = .*\"=", crates.read_text(), re.MULTILINE)
        for manifest in [SOURCE / "web/package.json", *SOURCE.glob("src/engines/*/recipe/package.json")]:
            npm = json.loads(manifest.read_text())
            packages += [name for kind in ("dependencies", "devDependencies") for name in npm.get(kind, {})]
        self.assertGreater(len(packages), 40)
        for package in packages:
            name = "@types/" if package.startswith("@types/") else package
            self.assertRegex(listed, rf"(?<![\w-]){re.escape(name)}(?![\w-])" if name == package else re.escape(name))


if __name__ == "__main__":
    main()
