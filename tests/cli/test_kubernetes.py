"""The manifests of docs/kubernetes: they fit the published schema, and their commands measure a campaign in parts."""

import copy
import json
import os
import re
import subprocess
import sys
import unittest

from harness import SOURCE, main
from test_campaign import CampaignTest

FOLDER = SOURCE / "docs/kubernetes"


def read_yaml(path):
    program = "import json, sys, yaml; json.dump(yaml.safe_load(open(sys.argv[1], encoding='utf-8')), sys.stdout)"
    for python in (sys.executable, "/usr/bin/python3"):
        done = subprocess.run([python, "-c", program, path], capture_output=True, text=True)
        if done.returncode == 0:
            return json.loads(done.stdout)
    raise AssertionError(f"no Python here reads {path}: install python3-yaml; {done.stderr[-500:]}")


TYPES = {"string": str, "integer": int, "boolean": bool, "object": dict, "array": list, "number": (int, float), "null": type(None)}


def is_of(value, kind):
    return isinstance(value, TYPES[kind]) and (kind == "boolean" or not isinstance(value, bool))


def faults(value, schema, root, where=""):
    """What a value does not fit in; of JSON Schema's words those that the schema uses."""
    known = {"$schema", "$comment", "$defs", "$ref", "type", "enum", "oneOf", "required", "properties", "additionalProperties", "items",
             "format"}
    if not known.issuperset(schema):
        return [f"the schema has {set(schema) - known}"]
    if "$ref" in schema:
        return faults(value, root["$defs"][schema["$ref"].rsplit("/", 1)[1]], root, where)
    kinds = schema.get("type", list(TYPES))
    if not any(is_of(value, kind) for kind in ([kinds] if isinstance(kinds, str) else kinds)):
        return [f"{where} is {value!r}, no {kinds}"]
    found = []
    if "enum" in schema and value not in schema["enum"]:
        found.append(f"{where} is {value!r}, none of {schema['enum']}")
    if "oneOf" in schema and sum(not faults(value, each, root, where) for each in schema["oneOf"]) != 1:
        found.append(f"{where} is {value!r}")
    if isinstance(value, dict):
        found += [f"{where}.{name} is missing" for name in schema.get("required", []) if name not in value]
        more = schema.get("additionalProperties", True)
        for name, part in value.items():
            inside = schema.get("properties", {}).get(name, more)
            if inside is False:
                found.append(f"{where}.{name} is unknown")
            elif isinstance(inside, dict):
                found += faults(part, inside, root, f"{where}.{name}")
    if isinstance(value, list) and "items" in schema:
        for index, part in enumerate(value):
            found += faults(part, schema["items"], root, f"{where}[{index}]")
    return found


class Manifests(unittest.TestCase):
    def setUp(self):
        self.schema = json.loads((FOLDER / "job-batch-v1.json").read_text(encoding="utf-8"))
        self.manifests = {path.name: read_yaml(path) for path in sorted(FOLDER.glob("*.yaml"))}

    def test_fit_the_published_schema(self):
        self.assertEqual(list(self.manifests), ["accuracy.yaml", "merge.yaml", "timing.yaml"])
        for name, manifest in self.manifests.items():
            self.assertEqual(faults(manifest, self.schema, self.schema, name), [])

    def test_the_check_finds_mistakes(self):
        def broken(change):
            manifest = copy.deepcopy(self.manifests["accuracy.yaml"])
            change(manifest["spec"], manifest["spec"]["template"]["spec"]["containers"][0])
            return faults(manifest, self.schema, self.schema)

        self.assertIn(".spec.completion is unknown", broken(lambda spec, container: spec.update(completion=3)))
        self.assertRegex(" ".join(broken(lambda spec, container: spec.update(completions="3"))), "completions is '3'")
        self.assertRegex(" ".join(broken(lambda spec, container: container.pop("name"))), "name is missing")
        self.assertRegex(" ".join(broken(lambda spec, container: container.update(args="run"))), "args is 'run'")
        self.assertRegex(" ".join(broken(lambda spec, container: spec.pop("template"))), "template is missing")

    def test_numbers_of_parts_agree(self):
        for name in ("accuracy", "timing"):
            spec = self.manifests[f"{name}.yaml"]["spec"]
            args = spec["template"]["spec"]["containers"][0]["args"]
            self.assertIn(f"--shard=auto/{spec['completions']}", args)
            self.assertEqual(spec["completionMode"], "Indexed")


class Commands(CampaignTest):
    """What the containers run, here, one after the other as the controller numbers them."""

    def commands(self, name, parts, index=""):
        pod = read_yaml(FOLDER / f"{name}.yaml")["spec"]["template"]["spec"]
        for container in [*pod.get("initContainers", []), *pod["containers"]]:
            words = [word.replace("/results", "results").replace("$(JOB_COMPLETION_INDEX)", str(index)) for word in container["args"]]
            yield [re.sub(r"auto/\d+", f"auto/{parts}", "tiny.toml" if word == "paper" else word) for word in words]

    def test_measure_a_campaign(self):
        self.run_tiny("whole")
        os.makedirs(self.dir / "results/shards")
        for name in ("accuracy", "timing"):
            for index in range(2):
                self.env.update(JOB_COMPLETION_INDEX=str(index), ASSAY_NODE=f"node-{index}")
                for words in self.commands(name, 2, index):
                    self.assay(*words)
        del self.env["JOB_COMPLETION_INDEX"]
        for words in self.commands("merge", 0):
            self.assay(*words)
        self.assertEqual(self.table("results/union"), self.table("whole"))
        self.assertTrue((self.dir / "results/union/report.html").is_file())


if __name__ == "__main__":
    main()
