"""How `ivx lsp` begins, listens and ends, to a client that minds no protocol."""

import json
import subprocess

import pytest

from editor import IVX


class Client:
    def __init__(self):
        self.process = subprocess.Popen([IVX, "lsp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def say(self, *messages):
        self.process.stdin.write(b"".join(map(framed, messages)))
        self.process.stdin.flush()

    def begin(self):
        self.say({"id": 0, "method": "initialize", "params": {"capabilities": {}}}, {"method": "initialized", "params": {}})
        assert self.hear()["id"] == 0

    def hear(self):
        """The next message; none at the end. Whatever else is written there is a mistake."""
        header = self.process.stdout.readline()
        if not header:
            return None
        assert header.startswith(b"Content-Length: ") and self.process.stdout.readline() == b"\r\n"
        return json.loads(self.process.stdout.read(int(header.split()[1])))

    def ends(self):
        """The code of the process once nothing is said any more."""
        self.process.stdin.close()
        while self.hear():
            pass
        return self.process.wait(10)


@pytest.fixture
def client():
    client = Client()
    yield client
    client.process.kill()
    client.process.wait()


def framed(message):
    body = message if isinstance(message, bytes) else json.dumps({"jsonrpc": "2.0", **message}).encode()
    return b"Content-Length: %d\r\n\r\n" % len(body) + body


@pytest.mark.parametrize("begun", [False, True])
@pytest.mark.parametrize("last", [b"", b"Content-Le", b"Content-Length: 500\r\n\r\n{", b"Content-Length: 18446744073709551615\r\n\r\n{"])
def test_who_hangs_up_ends_it(client, begun, last):
    if begun:
        client.begin()
    client.process.stdin.write(last)
    assert client.ends() in (0, 1, 3)


def test_who_hears_nothing_more_ends_it(client):
    client.begin()
    client.process.stdout.close()
    for _ in range(2):
        client.say({"id": 1, "method": "nonsense"})
    client.process.wait(10)


def test_an_end_without_a_shutdown_is_told_by_the_code(client):
    client.begin()
    client.say({"id": 1, "method": "shutdown"}, {"id": 2, "method": "nonsense"}, {"method": "exit"})
    assert [client.hear().get("error", {}).get("code") for _ in range(2)] == [None, -32600]
    assert client.ends() == 0
    other = Client()
    other.begin()
    other.say({"method": "exit"})
    assert other.ends() == 1


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"{}", b"\xff", b'{"id": 7}', b'{"method": 5}', b"[" * 100_000])
def test_what_is_no_message_is_noted(client, body):
    client.begin()
    client.say(body, {"id": 1, "method": "nonsense"})
    heard = [client.hear() for _ in range(2)]
    assert sorted(message.get("method", "an answer") for message in heard) == ["an answer", "window/logMessage"]


def test_of_what_is_typed_at_once_the_last_is_checked(client, tmp_path):
    client.begin()
    uri = (tmp_path / "long.ivx").as_uri()
    text = 'edition "2026"\n' + "".join(f"experiment e{i} {{ axis seed = 0..5 }}\n" for i in range(2_000))
    client.say({"method": "textDocument/didOpen", "params": {
        "textDocument": {"uri": uri, "languageId": "ivx", "version": 0, "text": text}}})
    # A bracket comes and goes.
    places = [{"start": {"line": 1, "character": 0}, "end": {"line": 1, "character": n % 2}} for n in range(201)]
    client.say(*({"method": "textDocument/didChange", "params": {
        "textDocument": {"uri": uri, "version": n + 1},
        "contentChanges": [{"range": place, "text": "}" if n % 2 == 0 else ""}]}} for n, place in enumerate(places)))
    client.say({"id": 1, "method": "nonsense"})
    told = []
    while "id" not in (message := client.hear()):
        told.append(message["params"])
    assert told[-1]["version"] == 201 and told[-1]["diagnostics"]
    assert len(told) < 20, "not every one of 201 texts was checked"
