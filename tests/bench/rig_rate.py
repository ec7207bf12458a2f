"""One run of rig_rate.sh: FOLDER POINTS RATE TIME QUEUE [what runs each program]."""
import json
import pathlib
import random
import shutil
import subprocess
import sys
import time

folder = pathlib.Path(sys.argv[1])
points, rate, seconds, queue = int(sys.argv[2]), float(sys.argv[3]), float(sys.argv[4]), sys.argv[5]
before = sys.argv[6:]
rigs = {"left": "sensor", "right": "opposite"}
count = int(rate * seconds)


def thin(source, target):
    """Writes as many points of a cloud, in random order."""
    head, body = source.read_bytes().split(b"end_header\n", 1)
    assert b"binary_little_endian" in head, source
    cloud = [body[i : i + 12] for i in range(0, len(body) - 11, 12)]
    chosen = random.sample(cloud, points) if len(cloud) >= points else random.choices(cloud, k=points)
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {points}"]
    header += [f"property float {axis}" for axis in "xyz"] + ["end_header", ""]
    target.write_bytes("\n".join(header).encode() + b"".join(chosen))


def clouds_of(rig):
    """The undeformed component, the crash, the deformed component."""
    random.seed(1)
    files = {}
    for kind in ("moving", "0-1", "0-2", "0-3", "0-4", "20-1", "20-2", "20-3", "20-4"):
        files[kind] = []
        for source in sorted((folder / f"{kind}-{rig}").glob("*.ply")):
            target = folder / f"thin-{kind}-{rig}-{source.name}"
            if not target.exists():
                thin(source, target)
            files[kind].append(target)
    still = [files[f"0-{seed}"][0] for seed in (1, 2, 3, 4)]
    end = [files[f"20-{seed}"][0] for seed in (1, 2, 3, 4)]
    sequence = [still[i % 4] for i in range(count // 2)] + files["moving"]
    return (sequence + [end[i % 4] for i in range(count)])[:count]


def write_sequence(name, rig):
    shutil.rmtree(folder / name, ignore_errors=True)
    (folder / name).mkdir()
    stamps = ["file,stamp_ns"]
    for i, cloud in enumerate(clouds_of(rig)):
        (folder / name / f"{i:06}.ply").symlink_to(cloud)
        stamps.append(f"{i:06}.ply,{int(i * 1e9 / rate)}")
    (folder / name / "stamps.csv").write_text("\n".join(stamps) + "\n")


def start(words, output):
    return subprocess.Popen(before + words, stdout=open(folder / output, "w"), stderr=open(folder / f"{output}.log", "w"))


def processor_s(process):
    """Per thread."""
    times = {}
    for task in pathlib.Path(f"/proc/{process.pid}/task").iterdir():
        times[int(task.name) - process.pid] = int((task / "schedstat").read_text().split()[0]) / 1e9
    return times


def wait_until(moment):
    while time.time() < moment:
        time.sleep(0.01)


for name, rig in rigs.items():
    write_sequence(name, rig)
results = f"ipc://{folder}/results"
words = ["lbea-serve", f"{folder}/rail.lbea", "--results", results, "--queue", queue, "--json"]
for name, rig in rigs.items():
    words += ["--frames", f"{name}=ipc://{folder}/{name}.frames", "--pose", f"{name}={folder}/{rig}.json"]
serve = start(words, "serve")
while "ready: " not in (folder / "serve.log").read_text():
    time.sleep(0.05)
    if serve.poll() is not None:
        sys.exit((folder / "serve.log").read_text())
begin = time.time() + 2 + count / 400  # the senders read their clouds first
senders = {}
for name in rigs:
    words = ["lbea-send", f"{folder}/{name}", "--to", f"ipc://{folder}/{name}.frames", "--results", results]
    senders[name] = start(words + ["--realtime", "--begin-ns", str(int(begin * 1e9)), "--json"], f"send-{name}")
wait_until(begin - 0.2)
at_begin, sending_at_begin = processor_s(serve), sum(sum(processor_s(s).values()) for s in senders.values())
wait_until(begin + seconds)
at_end, sending_at_end = processor_s(serve), sum(sum(processor_s(s).values()) for s in senders.values() if s.poll() is None)
for sender in senders.values():
    sender.wait()
serve.terminate()
serve.wait()

served, lost, exact = json.loads((folder / "serve").read_text()), 0, True
for name in rigs:
    sent, rig = json.loads((folder / f"send-{name}").read_text()), served["rigs"][name]
    lost += count - rig["matched"]
    exact = exact and rig["adds_up"] and rig["captured"] == sent["captured"] == count
    reasons = {**rig["rejected_by_reason"], **rig["dropped_by_reason"]}
    print(f"{name}: captured {count}, matched {rig['matched']}", *(f"{k} {v}" for k, v in reasons.items() if v), sep=", ")
shares = sorted(((t - at_begin.get(k, 0)) / count * 1e3 for k, t in at_end.items()), reverse=True)
print("lbea-serve, ms of processor time per capture by thread:", *(f"{s:.2f}" for s in shares if s >= 0.01), end="; ")
print(f"senders {(sending_at_end - sending_at_begin) / count * 1e3:.2f}")
print("all frames are counted" if exact else "A FRAME IS NOT COUNTED")
sys.exit(2 if not exact else 1 if lost else 0)
