#!/usr/bin/env python3
"""Reads from binaries what an engine's build is: instruction sets, precision and assertions.

binary_facts.py PLUGIN [LIBRARY...] --objdump PROGRAM --out FILE.json

The counts are those of the code of all files together: a plugin, and the shared libraries that are its engine. They say
which instructions there are, not how often they run; a library that chooses its code by the processor has some that never do.

  scalar, vector    of SSE to SSE4.2: one number, several numbers
  beyond_sse2       of these: SSE3 to SSE4.2, which the baseline does not have
  avx, avx256, avx512   VEX or EVEX encoded, by the widest register
  fma               of these: fused multiply-add
  x87               of the old floating-point unit
  single, double    arithmetic (add, sub, mul, div, sqrt, min, max, FMA) in that precision
  assertions        imported functions that end the process, and the number of messages of failed assertions
  libraries         shared libraries that the engine needs besides the system's, as built by others
"""
import argparse
import collections
import json
import re
import subprocess

ARITHMETIC = re.compile(r"^v?(?:add|sub|mul|div|sqrt|min|max|f(?:n?m)(?:add|sub|addsub|subadd)(?:132|213|231))(ss|ps|sd|pd)$")
FMA = re.compile(r"^vfn?m(?:add|sub|addsub|subadd)(?:132|213|231)[sp][sd]$")
BEYOND_SSE2 = re.compile(
    r"^(?:h(?:add|sub)p|addsubp|mov(?:ddup|shdup|sldup|ntdqa)|lddqu|p(?:shufb|alignr|abs|h(?:add|sub)|maddubsw|mulhrsw|sign|"
    r"blend|insr[bdq]|extr[bdq]|mul(?:ld|dq)|(?:min|max)(?:sb|ud|uw|sd)|mov[sz]x|test|cmp(?:eqq|gtq|[ei]str))|blend|round|"
    r"insertps|extractps|dpp[sd]|packusdw|mpsadbw|crc32)")
# "assertion failed", "Assertion `x' failed", "Bad argument(s) in": the last is ODE's.
MESSAGE = re.compile(rb"[Aa]ssert(?:ion)?\b[^\x00\n]{0,60}\bfail|Bad argument\(s\)")
ENDING = {"__assert_fail", "__assert", "__assert_rtn", "__assert_perror_fail"}
SYSTEM = re.compile(r"^(ld-linux.*|linux-vdso.*|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+|atomic))\.so")


def count_one(mnemonic, operands, counts):
    mnemonic = mnemonic.rstrip()
    counts["instructions"] += 1
    if "%xmm" not in operands and "%ymm" not in operands and "%zmm" not in operands:
        if mnemonic[:1] == "f" and ("%st" in operands or mnemonic.startswith(("fld", "fst", "fild", "fist"))):
            counts["x87"] += 1
        return
    if "%zmm" in operands:
        counts["avx512"] += 1
    elif "%ymm" in operands:
        counts["avx256"] += 1
    elif mnemonic[0] == "v":
        counts["avx"] += 1
    elif mnemonic.endswith(("ss", "sd")) or mnemonic.startswith(("cvt", "movd", "movq")):
        counts["scalar"] += 1
    else:
        counts["vector"] += 1
    if mnemonic[0] == "v":
        counts["fma"] += FMA.match(mnemonic) is not None
    else:
        counts["beyond_sse2"] += BEYOND_SSE2.match(mnemonic) is not None
    found = ARITHMETIC.match(mnemonic)
    if found:
        counts["single" if found[1][1] == "s" else "double"] += 1


def count_instructions(objdump, path, counts):
    """Adds the instructions of the ELF file's code to `counts`."""
    command = [objdump, "-d", "--no-show-raw-insn", "-M", "att", path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, errors="replace") as process:
        for line in process.stdout:
            _, tab, text = line.partition(":\t")
            if tab:
                count_one(*text.partition(" ")[::2], counts)
    if process.returncode != 0:
        raise SystemExit(f"binary_facts: '{objdump} -d {path}' failed with status {process.returncode}")


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def facts(objdump, paths):
    counts = collections.Counter(dict.fromkeys(
        ("instructions", "scalar", "vector", "beyond_sse2", "avx", "avx256", "avx512", "fma", "x87", "single", "double"), 0))
    ending, needed, messages = set(), set(), 0
    for path in paths:
        count_instructions(objdump, path, counts)
        for line in output(objdump, "-T", path).splitlines():
            words = line.split()
            if "*UND*" in words and words[-1] in ENDING:
                ending.add(words[-1])
        needed.update(re.findall(r"^\s*NEEDED\s+(\S+)", output(objdump, "-p", path), re.M))
        with open(path, "rb") as file:
            messages += len(MESSAGE.findall(file.read()))
    own = {path.rsplit("/", 1)[-1] for path in paths}
    return {"counts": dict(counts), "assertions": {"functions": sorted(ending), "messages": messages},
            "libraries": sorted(name for name in needed - own if not SYSTEM.match(name))}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binaries", nargs="+")
    parser.add_argument("--objdump", default="objdump")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    text = json.dumps(facts(arguments.objdump, arguments.binaries), indent=1)
    with open(arguments.out, "w", encoding="utf-8") as file:
        file.write(text + "\n")


if __name__ == "__main__":
    main()
