"""What drivers cost: python3 benches/cluster.py IVX [workers|ray|slurm [WORD ..]]

Tells nodes a second through the driver in batches of 1, 20 and 100, the overhead of nodes of one second, and how much
faster 64 of them are on its machines than one after another here. `workers` starts two of one thread each; for the
others there must be a cluster of two such machines. Of `ray`, `ivx-on-ray` runs with the python3 of PATH.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

RECORDER = """#!{python}
import json, sys
print(json.dumps({{"ready": "a recorder", "cpus": 100000, "largest_cpus": 1}}), flush=True)
n, keys = 0, open("keys.json", "w")
for line in sys.stdin:
    keys.write(line)
    n += len(json.loads(line)["keys"])
    if n == {n}:
        break
"""
TINY = """edition "2026"
experiment tiny {{
    axis seed = 0..{n}
    let data = sample(sinusoids(), n: 10)
    let model = train(map_estimate(net: mlp(hidden: [2])), on: data, steps: 1)
    measure y = mean(predict(model, at: grid(0.0, 1.0, points: 2)), over: x)
}}
"""
SLEEPS = """edition "2026"
experiment sleeps {{
    axis i = 0..{n}
    let run = command("sh", args: ["-c", "sleep 1; echo $1", "{tag}", i], stdout: "o.json")
    measure x = read_scalar(run, "o.json")
}}
"""
N = 2_000


def tickets(ivx, folder, n):
    """Keys of nodes whose tickets lie in the folder's store."""
    (folder / "tiny.ivx").write_text(TINY.format(n=n))
    driver = folder / "ivx-on-recorder"
    driver.write_text(RECORDER.format(python=sys.executable, n=n))
    driver.chmod(0o755)
    environment = {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"}
    recorded = subprocess.run([ivx, "exec", "tiny.ivx", "--store", "store", "--on", "recorder"], cwd=folder, env=environment,
                              capture_output=True, text=True)
    assert "nobody runs it any more" in recorded.stderr, recorded.stderr
    return [key for line in (folder / "keys.json").read_text().splitlines() for key in json.loads(line)["keys"]]


class Driver:
    def __init__(self, command, folder):
        self.process = subprocess.Popen(command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        while not json.loads(self.process.stdout.readline()).get("cpus"):
            pass

    def nodes_a_second(self, batches):
        begun = time.perf_counter()
        for run, keys in enumerate(batches):
            print(json.dumps({"run": run, "keys": keys, "cpus": 1, "gpus": 0, "memory": 0}), file=self.process.stdin)
        self.process.stdin.flush()
        left = len(batches)
        while left:
            told = json.loads(self.process.stdout.readline())
            if told.get("done") is not None:
                assert told.get("code") == 0, told
                left -= 1
        return sum(map(len, batches)) / (time.perf_counter() - begun)

    def end(self):
        self.process.stdin.close()
        self.process.wait()


def command(ivx, on, store):
    words = on.split()
    program = [ivx, "node", "serve"] if words[0] == "workers" else [f"ivx-on-{words[0]}"]
    ours = ["--ivx", ivx, "--store", str(store), "--library", library(ivx), "--ivx-version", version(ivx)]
    return program + ours + words[1:]


def version(ivx):
    return subprocess.run([ivx, "--version"], capture_output=True, text=True).stdout.strip().split(" ", 1)[1]


def library(ivx):
    """In full: a key that nobody has is refused with it."""
    told = subprocess.run([ivx, "node", "exec", "0" * 64, "--store", "/nowhere", "--library", "?"], capture_output=True, text=True)
    return told.stderr.split("and this is ")[1].split(":")[0]


def seconds(ivx, folder, n, *more):
    (folder / "sleeps.ivx").write_text(SLEEPS.format(n=n, tag=time.time_ns()))
    begun = time.perf_counter()
    environment = {**os.environ, "IVX_CACHE": str(Path(tempfile.mkdtemp(dir=folder)))}
    done = subprocess.run([ivx, "exec", "sleeps.ivx", *more], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return time.perf_counter() - begun


def main(ivx, on="workers"):
    ivx = str(Path(ivx).resolve())
    with tempfile.TemporaryDirectory() as root:
        folder = Path(root)
        (folder / ".ivx").mkdir()
        keys = tickets(ivx, folder, N)
        store, workers = folder / "store", []
        if on.split()[0] == "workers":
            workers = [subprocess.Popen([ivx, "worker", store, "--cpus", "1", "--cache", folder / f"w{i}"], stdout=subprocess.DEVNULL)
                       for i in range(2)]
            time.sleep(1)
        try:
            driver = Driver(command(ivx, on, store), folder)
            for size, n in ((1, 40), (20, 400), (100, 1_000)):
                own, keys = keys[:n], keys[n:]
                rate = driver.nodes_a_second([own[i : i + size] for i in range(0, n, size)])
                print(f"{on}: {rate:.0f} nodes a second in batches of {size}", flush=True)
            driver.end()
            few, many = (seconds(ivx, folder, n, "--store", store, "--on", on) for n in (2, 22))
            # Twenty more on two machines: ten seconds, and what they cost more.
            print(f"{on}: a node of one second costs {(many - few) / 10 - 1:.1%} more")
            here = seconds(ivx, folder, 64, "--jobs", "1")
            there = seconds(ivx, folder, 64, "--store", store, "--on", on)
            print(f"{on}: 64 nodes of one second in {there:.1f} s, here one after another in {here:.1f} s: {here / there:.2f} times")
        finally:
            for worker in workers:
                worker.terminate()


if __name__ == "__main__":
    main(sys.argv[1], " ".join(sys.argv[2:]) or "workers")
