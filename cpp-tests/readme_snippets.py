"""Compiles the C and C++ snippets of README.md: readme_snippets.py README INCLUDE_DIR"""
import pathlib
import re
import subprocess
import sys

readme, include = pathlib.Path(sys.argv[1]).read_text(), sys.argv[2]
compilers = {"c": ["cc", "-std=c99", "-x", "c"], "cpp": ["c++", "-std=c++17", "-x", "c++"]}
found = re.findall(r"```(c|cpp)\n(.*?)```", readme, re.S)
assert {kind for kind, _ in found} == set(compilers), "README.md has no snippet of each language"
for kind, code in found:
    command = [*compilers[kind], "-Wall", "-Wextra", "-Werror", "-fsyntax-only", f"-I{include}", "-"]
    subprocess.run(command, input=code, text=True, check=True)
print(f"{len(found)} snippets compile")
