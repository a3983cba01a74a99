#!/usr/bin/env python3
"""Writes docs/kubernetes/job-batch-v1.json, the published schema of a Kubernetes Job with all that it refers to, from the wheel of
kubernetes-validate (setup/pip/kubernetes.txt). Its strict form refuses fields that it does not know.

    pip download --no-deps --require-hashes --only-binary :all: -r setup/pip/kubernetes.txt
    docs/kubernetes/update_schema.py kubernetes_validate-1.37.0-py3-none-any.whl
"""

import json
import pathlib
import sys
import zipfile

VERSION = "1.31.0"  # the oldest API that the manifests have to fit


def main():
    wheel = zipfile.ZipFile(sys.argv[1])
    folder = f"kubernetes_validate/kubernetes-json-schema/v{VERSION}-local-strict"
    job = json.loads(wheel.read(f"{folder}/job-batch-v1.json"))
    everything = json.loads(wheel.read(f"{folder}/_definitions.json"))["$defs"]
    used = {}

    def reduced(node):
        """Without descriptions, and with references into this file; collects what they name."""
        if isinstance(node, list):
            return [reduced(each) for each in node]
        if not isinstance(node, dict):
            return node
        out = {}
        for key, value in node.items():
            if key == "$ref":
                name = value.rsplit("/", 1)[1]
                out[key] = f"#/$defs/{name}"
                if name not in used:
                    used[name] = None
                    used[name] = reduced(everything[name])
            elif key == "properties":
                out[key] = {name: reduced(schema) for name, schema in value.items()}
            elif key != "description" and not key.startswith("x-kubernetes") and key not in ("$id", "$schema"):
                out[key] = reduced(value)
        return out

    schema = {"$schema": "http://json-schema.org/draft-07/schema#",
              "$comment": f"Job of Kubernetes {VERSION}, Apache-2.0, without descriptions; written by update_schema.py",
              **reduced(job)}
    schema["$defs"] = dict(sorted(used.items()))
    target = pathlib.Path(__file__).parent / "job-batch-v1.json"
    target.write_text(json.dumps(schema, separators=(",", ":"), sort_keys=True) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
