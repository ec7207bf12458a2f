"""Turns the wire's schemas into the Python package lbea_client._schema.

generate_schema.py FLATC SCHEMA_DIR PACKAGE_DIR

flatc puts one module per type into packages named after the schemas' namespaces, which would claim the names `lbea` and
`foxglove` in every Python that has them. Here all of them become siblings in one private package.
"""
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path


def main(flatc, schema, package):
    package = Path(package)
    shutil.rmtree(package, ignore_errors=True)
    package.mkdir(parents=True)
    with tempfile.TemporaryDirectory() as work:
        source, made = Path(work, "schema"), Path(work, "made")
        shutil.copytree(schema, source)
        files = sorted(source.rglob("*.fbs"))
        for file in files:  # flatc 2.0.8 writes Python for a nested buffer of another namespace that is none
            file.write_text(re.sub(r', nested_flatbuffer: "[^"]*"', "", file.read_text()))
        subprocess.run([flatc, "--python", "--gen-object-api", "-I", source, "-I", source / "foxglove", "-o", made, *files], check=True)
        for module in made.rglob("*.py"):
            text = re.sub(r"\b(lbea\.wire|foxglove)\.(?=[A-Z])", "lbea_client._schema.", module.read_text())
            (package / module.name).write_text(text)


main(*sys.argv[1:])
