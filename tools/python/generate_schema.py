"""Generates the Python package lbea_client._schema from the schemas of the wire.

generate_schema.py FLATC SCHEMA_DIR PACKAGE_DIR

flatc generates one module per type, in packages named after the namespaces of the schemas. They would occupy the global
package names `lbea` and `foxglove`; here all modules move into one private package.
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
        for file in files:  # flatc 2.0.8 generates invalid Python for a nested buffer of another namespace
            file.write_text(re.sub(r', nested_flatbuffer: "[^"]*"', "", file.read_text()))
        subprocess.run([flatc, "--python", "--gen-object-api", "-I", source, "-I", source / "foxglove", "-o", made, *files], check=True)
        for module in made.rglob("*.py"):
            text = re.sub(r"\b(lbea\.wire|foxglove)\.(?=[A-Z])", "lbea_client._schema.", module.read_text())
            (package / module.name).write_text(text)


main(*sys.argv[1:])
