//! Messages over standard input and output.

use std::io::{self, BufRead, Read as _};
use std::thread::{self, JoinHandle};

use crossbeam_channel::{bounded, unbounded};
use lsp_server::{Connection, Message};

use super::remark;

/// The threads that read and write.
pub(super) struct Threads {
    reader: JoinHandle<io::Result<()>>,
    writer: JoinHandle<io::Result<()>>,
}

impl Threads {
    /// Waits until all is written, of an editor that says no more.
    pub(super) fn join(self) -> io::Result<()> {
        let ends = [self.reader, self.writer].map(JoinHandle::join);
        ends.into_iter().try_for_each(|end| end.expect("reading and writing do not panic"))
    }
}

/// An editor at the other end of standard input and output.
///
/// What it says is read as soon as it is there, so that one sees how much of it waits.
pub(super) fn stdio() -> (Connection, Threads) {
    let (sender, written) = bounded::<Message>(0);
    let (read, receiver) = unbounded();
    let writer = thread::spawn(move || written.iter().try_for_each(|message| write(&message)));
    let reader = thread::spawn(move || {
        let mut input = io::stdin().lock();
        while let Some(body) = body(&mut input)? {
            match serde_json::from_slice(&body) {
                Ok(message) => {
                    let ends =
                        matches!(&message, Message::Notification(note) if note.method == "exit");
                    if read.send(message).is_err() || ends {
                        break;
                    }
                }
                // The next message begins where it would in any case.
                Err(error) => write(&remark(&format!("a message is none: {error}")).into())?,
            }
        }
        Ok(())
    });
    (Connection { sender, receiver }, Threads { reader, writer })
}

fn write(message: &Message) -> io::Result<()> {
    message.write(&mut io::stdout().lock())
}

/// The next message as it is written; none at the end.
///
/// # Errors
/// If the input cannot be read, ends within a message, or does not say how long one is.
fn body(input: &mut impl BufRead) -> io::Result<Option<Vec<u8>>> {
    let mut length = None;
    loop {
        let mut line = String::new();
        if input.read_line(&mut line)? == 0 {
            return Ok(None);
        }
        match line.trim_end().split_once(':') {
            Some((name, value)) if name.eq_ignore_ascii_case("Content-Length") => {
                length = value.trim().parse::<u64>().ok();
            }
            Some(_) => {}
            None if line.trim_end().is_empty() => break,
            None => return Err(io::Error::other(format!("`{}` is no header", line.trim_end()))),
        }
    }
    let length = length.ok_or_else(|| io::Error::other("a message does not say how long it is"))?;
    // What is promised need not come: room is made for what does.
    let mut body = Vec::new();
    let n_read = input.take(length).read_to_end(&mut body)?;
    if n_read as u64 == length { Ok(Some(body)) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_cut_where_their_headers_say() {
        let check = |mut text: &[u8], expected: Result<&[&str], &str>| {
            let mut found = Vec::new();
            let end = loop {
                match body(&mut text) {
                    Ok(Some(body)) => found.push(String::from_utf8(body).expect("it is ASCII")),
                    Ok(None) => break Ok(&found[..]),
                    Err(error) => break Err(error.to_string()),
                }
            };
            match expected {
                Ok(expected) => assert_eq!(end.expect("it can be read"), expected),
                Err(why) => assert!(end.expect_err("it cannot").contains(why)),
            }
        };
        check(b"", Ok(&[]));
        check(b"Content-Length: 2\r\n\r\n{}content-length:1\r\nX: y\r\n\r\n1", Ok(&["{}", "1"]));
        check(b"Content-Length: 0\r\n\r\n", Ok(&[""]));
        check(b"Content-Length: 18446744073709551615\r\n\r\n{", Err("end of file"));
        check(b"Content-Length: -1\r\n\r\n{}", Err("how long"));
        check(b"\r\n", Err("how long"));
        check(b"nonsense\r\n", Err("no header"));
    }
}
