"""A server of S3 that keeps everything in memory and takes so long for each request.

    benches/bucket.py PORT MILLISECONDS [RECORDS]

It has one bucket, and in it so many records below `made/`, of which only the names are there. Signatures are not looked at.
`GET /count` says how many requests came since it was last asked.
"""

import asyncio
import bisect
import hashlib
import sys
import urllib.parse
from xml.sax.saxutils import escape

PIECE = 1000
port, delay = int(sys.argv[1]), float(sys.argv[2]) / 1000
kept = {"made/version": b"ivx store 1\n"}
for i in range(int(sys.argv[3]) if len(sys.argv) > 3 else 0):
    key = hashlib.sha256(i.to_bytes(8, "little")).hexdigest()
    kept[f"made/records/{key[:2]}/{key}-x86_64-linux"] = b""
names, is_sorted, n_requests = sorted(kept), True, 0


def listing(asked: dict[str, list[str]]) -> bytes:
    global is_sorted
    if not is_sorted:
        names.sort()
        is_sorted = True
    prefix, after = asked.get("prefix", [""])[0], asked.get("continuation-token", [""])[0]
    begin = bisect.bisect_right(names, after) if after else bisect.bisect_left(names, prefix)
    end = bisect.bisect_left(names, prefix + "\U0010ffff")
    page = names[begin : min(begin + PIECE, end)]
    cut = begin + PIECE < end
    entry = "<Contents><Key>{}</Key><LastModified>2026-01-01T00:00:00.000Z</LastModified><Size>{}</Size></Contents>"
    body = "".join(entry.format(escape(name), len(kept[name])) for name in page)
    token = f"<NextContinuationToken>{escape(page[-1])}</NextContinuationToken>" if cut else ""
    head = f"<IsTruncated>{str(cut).lower()}</IsTruncated><KeyCount>{len(page)}</KeyCount>"
    return f"<ListBucketResult>{head}{token}{body}</ListBucketResult>".encode()


def answer(method: str, target: str, headers: dict[str, str], body: bytes) -> tuple[str, bytes]:
    global is_sorted, n_requests
    if target == "/count":
        n_requests, said = 0, n_requests
        return "200 OK", str(said).encode()
    n_requests += 1
    path, _, query = target.partition("?")
    name = urllib.parse.unquote(path).lstrip("/").partition("/")[2]
    if method == "GET" and not name:
        return "200 OK", listing(urllib.parse.parse_qs(query))
    if method == "PUT":
        if headers.get("if-none-match") == "*" and name in kept:
            return "412 Precondition Failed", b""
        if name not in kept:
            names.append(name)
            is_sorted = False
        kept[name] = body
        return "200 OK", b""
    return ("200 OK", kept[name]) if name in kept else ("404 Not Found", b"")


async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    try:
        while True:
            first, *rest = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").strip().split("\r\n")
            method, target, _ = first.split(" ")
            headers = {k.lower(): v.strip() for k, _, v in (line.partition(":") for line in rest)}
            body = await reader.readexactly(int(headers.get("content-length", 0)))
            if target != "/count":
                await asyncio.sleep(delay)
            status, said = answer(method, target, headers, body)
            tag = 'ETag: "x"\r\nLast-Modified: Thu, 01 Jan 2026 00:00:00 GMT\r\n'
            writer.write(f"HTTP/1.1 {status}\r\n{tag}Content-Length: {len(said)}\r\n\r\n".encode())
            writer.write(b"" if method == "HEAD" else said)
            await writer.drain()
    except (asyncio.IncompleteReadError, ConnectionError):
        writer.close()


async def main() -> None:
    server = await asyncio.start_server(serve, "127.0.0.1", port, limit=1 << 26)
    await server.serve_forever()


asyncio.run(main())
