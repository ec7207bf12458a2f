"""Reads ISO-MME that lbea wrote with pyisomme, a reader that is not ours.

   read_with_pyisomme.py WRITER FOLDER
Takes an installed pyisomme, else one from PyPI in FOLDER/venv. Exit code 77 without either: a skipped test.
"""
import json
import logging
import math
import pathlib
import shutil
import subprocess
import sys
import venv

VERSION = "pyisomme==0.0.3"


def find_reader(folder):
    """Goes on in the virtual environment when this interpreter has no pyisomme."""
    try:
        import pyisomme

        return pyisomme
    except ImportError:
        pass
    environment = folder / "venv"
    python = environment / "bin" / "python"
    if pathlib.Path(sys.prefix) == environment:
        raise SystemExit("pyisomme is installed, but cannot be imported")
    if not (environment / "complete").exists():
        shutil.rmtree(environment, ignore_errors=True)
        try:
            venv.create(environment, with_pip=True)
            subprocess.run([python, "-m", "pip", "install", "--quiet", "--retries", "0", VERSION], check=True)
        except subprocess.CalledProcessError:
            shutil.rmtree(environment, ignore_errors=True)
            print("no pyisomme and no network")
            raise SystemExit(77)
        (environment / "complete").touch()
    raise SystemExit(subprocess.run([python, *sys.argv]).returncode)


def check(channel, wanted):
    assert str(channel.code) == wanted["code"], (channel.code, wanted["code"])
    assert str(channel.unit).replace(" ", "") == wanted["unit"], (channel.unit, wanted["unit"])
    values = [float(value) for value in channel.data.to_numpy().ravel()]
    assert len(values) == len(wanted["values"]), wanted["code"]
    for i, (read, written) in enumerate(zip(values, wanted["values"])):
        assert math.isnan(read) if written is None else read == float(f"{written:.9g}"), (wanted["code"], i, read)
        time_s = wanted["first_s"] + i * wanted["interval_s"]
        assert abs(float(channel.data.index[i]) - time_s) < 1e-12, (wanted["code"], i)


def main():
    writer, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    pyisomme = find_reader(folder)
    logging.disable(logging.WARNING)
    test = folder / "sample"
    shutil.rmtree(test, ignore_errors=True)
    wanted = json.loads(subprocess.run([writer, test], check=True, capture_output=True).stdout)
    read = pyisomme.Isomme().read(test / "sample.mme")
    assert read.test_number == "sample"
    assert len(read.channels) == len(wanted) == 9, len(read.channels)
    for channel, expected in zip(read.channels, wanted):
        assert channel.code.is_valid(), channel.code
        check(channel, expected)
    names = [channel.get_info("Name of the channel") for channel in read.channels]
    assert names[:6] == ["struck end", "Träger, \"oben\" 'links'", "of two  lines and  controls", "never seen", "once",
                         None], names
    print(f"{len(wanted)} channels read by pyisomme")


main()
