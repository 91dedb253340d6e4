"""An editor with `$IVX lsp` behind it: it speaks of files by their paths, and of places by what stands there."""

import asyncio
import os

from lsprotocol import types as t
from pytest_lsp import ClientServerConfig, client_capabilities

IVX = os.environ["IVX"]


async def start(client: str, *roots):
    """An editor with the capabilities of another, in which these folders are open."""
    server = await ClientServerConfig(server_command=[IVX, "lsp"]).start()
    for asked in (t.CLIENT_REGISTER_CAPABILITY, t.WORKSPACE_INLAY_HINT_REFRESH):
        server.feature(asked)(lambda *_: None)
    folders = [t.WorkspaceFolder(uri=root.as_uri(), name=root.name) for root in roots]
    answer = await server.initialize_session(t.InitializeParams(
        capabilities=client_capabilities(client),
        root_uri=folders[0].uri,
        workspace_folders=folders,
    ))
    return Editor(server, answer.capabilities)


class Editor:
    def __init__(self, server, capabilities):
        self.server, self.capabilities, self.texts = server, capabilities, {}

    async def stop(self):
        await self.server.shutdown_session()
        await self.server.stop()

    def open(self, path, text=None):
        self.texts[path] = path.read_text() if text is None else text
        self.server.text_document_did_open(t.DidOpenTextDocumentParams(t.TextDocumentItem(
            uri=path.as_uri(), language_id="ivx", version=0, text=self.texts[path])))

    def replace(self, path, old, new):
        """Types `new` in the place of `old`."""
        text = self.texts[path]
        start = text.index(old)
        place = t.Range(self.position(text, start), self.position(text, start + len(old)))
        self.texts[path] = changed = text.replace(old, new, 1)
        sync = self.capabilities.text_document_sync
        kind = getattr(sync, "change", sync)
        by_parts = kind == t.TextDocumentSyncKind.Incremental
        self.server.text_document_did_change(t.DidChangeTextDocumentParams(
            t.VersionedTextDocumentIdentifier(uri=path.as_uri(), version=len(changed)),
            [t.TextDocumentContentChangePartial(range=place, text=new) if by_parts
             else t.TextDocumentContentChangeWholeDocument(text=changed)],
        ))

    async def faults(self, path, *codes):
        """Waits until the faults of a file have these codes, and gives them in their order."""
        return await self.wait(path, lambda found: sorted(f.code for f in found) == sorted(codes), codes)

    async def some_faults(self, path):
        """Waits until a file has faults, of whatever code."""
        return await self.wait(path, bool, "any")

    def changed(self, path):
        """Tells that another program wrote a file."""
        change = t.FileEvent(uri=path.as_uri(), type=t.FileChangeType.Changed)
        self.server.workspace_did_change_watched_files(t.DidChangeWatchedFilesParams([change]))

    async def wait(self, path, until, expected, seconds=10):
        for _ in range(seconds * 50):
            found = self.server.diagnostics.get(path.as_uri())
            if found is not None and until(found):
                return sorted(found, key=lambda f: (f.range.start.line, f.range.start.character))
            await asyncio.sleep(0.02)
        raise AssertionError(f"{path.name} has {found}, and not {expected}")

    def at(self, path, before, after=""):
        """A file, and the place in it between these texts."""
        offset = self.texts[path].index(before + after) + len(before)
        return document(path), self.position(self.texts[path], offset)

    def stands(self, path, place):
        """What stands at a place."""
        text = self.texts.get(path) or path.read_text()
        return text[self.offset(text, place.start):self.offset(text, place.end)]

    def edited(self, path, edits):
        """The text of a file after edits."""
        text = self.texts.get(path) or path.read_text()
        spans = [(self.offset(text, e.range.start), self.offset(text, e.range.end), e.new_text) for e in edits]
        for start, end, new in sorted(spans, reverse=True):
            text = text[:start] + new + text[end:]
        return text

    def position(self, text, offset):
        line_start = text.rfind("\n", 0, offset) + 1
        return t.Position(text.count("\n", 0, offset), self.units(text[line_start:offset]))

    def offset(self, text, position):
        lines = text.split("\n")
        start = sum(len(line) + 1 for line in lines[:position.line])
        line = lines[position.line] if position.line < len(lines) else ""
        units = next((i for i in range(len(line) + 1) if self.units(line[:i]) >= position.character), len(line))
        return min(start + units, len(text))

    def units(self, text):
        """How long a text is, in what positions count: UTF-16 unless the server chose another of what is offered."""
        encoding = self.capabilities.position_encoding or "utf-16"
        encoding = getattr(encoding, "value", encoding)
        return len(text.encode(encoding.replace("-16", "-16-le").replace("-32", "-32-le"))) // (
            {"utf-8": 1, "utf-16": 2, "utf-32": 4}[encoding])


async def until(what, ask, holds, seconds=10):
    """Asks until an answer holds: what nodes and results there are is found out beside the editor's work."""
    answer = None
    for _ in range(seconds * 20):
        answer = await ask()
        if holds(answer):
            return answer
        await asyncio.sleep(0.05)
    raise AssertionError(f"{what}: {answer}")


def document(path):
    return t.TextDocumentIdentifier(uri=path.as_uri())
