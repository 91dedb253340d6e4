"""What a keystroke costs `ivx lsp` in a spec of 5 000 lines: python3 benches/editor.py IVX

Tells medians over 50 keystrokes: milliseconds from the keystroke to what is wrong, and of the server's processor.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

EXPERIMENT = """
/// What acting greedily on a learned reward costs, {i}.
experiment gaps{i} {{
    param members: Int = 8   /// ensemble size
    axis seed = 0..20
    axis ke = {{ "WCM": wcm(), "MA": ma(), "BCM": bcm() }}
    let data = sample(sinusoids(), n: 20, noise: 0.1, stream: "s{i}")
    let model = train(
        ensemble(map_estimate(net: mlp(hidden: [64, 64])), members: members),
        on: data, steps: 2_000)
    let decision = argmax(model, ke: ke, among: grid(-2.0, 2.0, points: 1001))
    measure gap = hallucination(decision, under: sinusoids())
    figure "gaps{i}" = bars(gap, by: ke)
    claim "pessimism is less deceived" : gap[ke: "WCM"] < gap[ke: "BCM"]
}}
"""
LINES = 5_000
KEYSTROKES = 50


class Server:
    def __init__(self, ivx):
        self.process = subprocess.Popen([ivx, "lsp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.n = 0

    def tell(self, method, params, **more):
        body = json.dumps({"jsonrpc": "2.0", "method": method, "params": params, **more}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.process.stdin.flush()

    def ask(self, method, params):
        self.n += 1
        self.tell(method, params, id=self.n)
        return self.until(lambda message: message.get("id") == self.n and "method" not in message)

    def until(self, is_it):
        while True:
            length = 0
            while line := self.process.stdout.readline().strip():
                name, value = line.split(b":")
                length = int(value) if name.lower() == b"content-length" else length
            message = json.loads(self.process.stdout.read(length))
            if is_it(message):
                return message

    def processor_ms(self):
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) * 1000 / os.sysconf("SC_CLK_TCK")


def main(ivx):
    text, i = 'edition "2026"\n', 0
    while text.count("\n") < LINES:
        text, i = text + EXPERIMENT.format(i=i), i + 1
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / ".git").mkdir()
        server = Server(ivx)
        server.ask("initialize", {"processId": None, "rootUri": None, "capabilities": {}})
        server.tell("initialized", {})
        uri = (Path(folder) / "long.ivx").as_uri()
        document = {"uri": uri, "languageId": "ivx", "version": 0, "text": text}
        faults = lambda message: message.get("method") == "textDocument/publishDiagnostics"
        server.tell("textDocument/didOpen", {"textDocument": document})
        server.until(faults)
        # The `t` of the last `data` goes and comes back.
        line = text[: text.rindex("on: data")].count("\n")
        column = text.split("\n")[line].index("on: data") + len("on: dat")
        took, used = [], []
        for n in range(KEYSTROKES):
            end = {"line": line, "character": column + 1}
            place = {"start": {"line": line, "character": column}, "end": end}
            change = {"range": place, "text": ""} if n % 2 == 0 else {"range": {**place, "end": place["start"]}, "text": "a"}
            begun, before = time.perf_counter(), server.processor_ms()
            server.tell("textDocument/didChange", {
                "textDocument": {"uri": uri, "version": n + 1}, "contentChanges": [change]})
            found = server.until(faults)["params"]["diagnostics"]
            assert bool(found) == (n % 2 == 0), found
            took.append((time.perf_counter() - begun) * 1000)
            time.sleep(0.3)
            used.append(server.processor_ms() - before)
        asked = {}
        for method in ("completion", "hover", "semanticTokens/full", "inlayHint", "foldingRange"):
            begun = time.perf_counter()
            server.ask(f"textDocument/{method}", {"textDocument": {"uri": uri}, "position": place["start"]})
            asked[method] = (time.perf_counter() - begun) * 1000
        print(f"{text.count(chr(10))} lines: told after {statistics.median(took):.0f} ms, at most {max(took):.0f};"
              f" {statistics.median(used):.0f} ms of the processor with what is known of nodes")
        print("; ".join(f"{method} {ms:.0f} ms" for method, ms in asked.items()))
        server.ask("shutdown", None)
        server.tell("exit", None)
        server.process.wait()


if __name__ == "__main__":
    main(sys.argv[1])
