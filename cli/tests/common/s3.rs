//! A server of S3 that runs on this machine, and what can stand between it and a client.

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

/// The one bucket that the server has.
pub(crate) const BUCKET: &str = "ivx";
/// A busy machine may take so long for anything.
const BOUND: Duration = Duration::from_mins(2);

/// A server on a port of its own.
pub(crate) struct Server {
    program: PathBuf,
    child: Child,
    pub(crate) port: u16,
    data: tempfile::TempDir,
}

impl Server {
    /// A server that has started; says if none can be had.
    pub(crate) fn start() -> Option<Self> {
        let Some(program) = program() else {
            eprintln!("skipped: no moto_server or s3s-fs on the PATH or in IVX_S3_SERVER");
            return None;
        };
        let data = tempfile::tempdir().expect("temporary folders can be made");
        let port = free_port();
        let child = run(&program, port, data.path());
        let server = Self { program, child, port, data };
        server.make_bucket();
        Some(server)
    }

    pub(crate) fn kill(&mut self) {
        self.child.kill().expect("it runs");
        self.child.wait().expect("it was killed");
    }

    /// Starts it once more on the same port. What it had is there if it keeps files.
    pub(crate) fn start_again(&mut self) {
        self.child = run(&self.program, self.port, self.data.path());
        self.make_bucket();
    }

    /// Puts other bytes under a name, as someone would who can write there.
    pub(crate) fn alter(&self, name: &str, bytes: &[u8]) {
        if keeps_files(&self.program) {
            fs::write(self.data.path().join(BUCKET).join(name), bytes).expect("it is there");
        } else {
            self.put(&format!("{BUCKET}/{name}"), bytes);
        }
    }

    fn make_bucket(&self) {
        listening(self.port);
        if !keeps_files(&self.program) {
            self.put(BUCKET, b"");
        }
    }

    fn put(&self, path: &str, bytes: &[u8]) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("it listens");
        let n = bytes.len();
        // Who is named counts, and the signature does not.
        let who =
            "Credential=test/20260101/us-east-1/s3/aws4_request, SignedHeaders=host, Signature=0";
        let head = format!("Host: localhost\r\nConnection: close\r\nContent-Length: {n}");
        let signed = format!("Authorization: AWS4-HMAC-SHA256 {who}");
        write!(stream, "PUT /{path} HTTP/1.1\r\n{head}\r\n{signed}\r\n\r\n").expect("it reads");
        stream.write_all(bytes).expect("it reads");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("it answers");
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may be dead already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn program() -> Option<PathBuf> {
    if let Some(program) = std::env::var_os("IVX_S3_SERVER") {
        return Some(program.into());
    }
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let found = |name: &str| folders.iter().map(|folder| folder.join(name)).find(|file| runs(file));
    found("s3s-fs").or_else(|| found("moto_server"))
}

fn runs(program: &Path) -> bool {
    let mut command = Command::new(program);
    command.arg("--help").stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

fn keeps_files(program: &Path) -> bool {
    program.ends_with("s3s-fs")
}

fn run(program: &Path, port: u16, data: &Path) -> Child {
    let mut command = Command::new(program);
    if keeps_files(program) {
        fs::create_dir_all(data.join(BUCKET)).expect("folders can be made");
        command.args(["--host", "127.0.0.1", "--port", &port.to_string()]);
        command.args(["--access-key", "test", "--secret-key", "a-key-that-nobody-may-see"]);
        command.arg(data);
    } else {
        command.args(["-H", "127.0.0.1", "-p", &port.to_string()]);
    }
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the server starts")
}

/// A port on which nobody listens.
pub(crate) fn free_port() -> u16 {
    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("ports are free");
    listener.local_addr().expect("it has an address").port()
}

/// Waits until somebody listens on a port.
pub(crate) fn listening(port: u16) {
    let began = Instant::now();
    while TcpStream::connect(("127.0.0.1", port)).is_err() {
        assert!(began.elapsed() < BOUND, "nobody listens");
        sleep(Duration::from_millis(20));
    }
}

/// What stands between a server and its clients.
#[derive(Clone, Copy)]
pub(crate) enum Way {
    /// Each request takes so much longer.
    Slow(Duration),
    /// Nothing may be put there.
    ReadOnly,
}

/// Something that listens on a port.
pub(crate) struct Listening {
    pub(crate) port: u16,
    requests: Arc<AtomicUsize>,
}

impl Listening {
    /// How many requests came.
    pub(crate) fn n_requests(&self) -> usize {
        self.requests.load(Ordering::SeqCst)
    }
}

/// Passes on what comes to a port, in a way.
pub(crate) fn proxy(to: u16, way: Way) -> Listening {
    serve(move |mut client, requests| {
        let Ok(server) = TcpStream::connect(("127.0.0.1", to)) else { return };
        let back = (server.try_clone(), client.try_clone());
        let (Ok(mut from_server), Ok(mut to_client)) = back else { return };
        spawn(move || {
            // Whoever closes first ends both ways.
            let _ = std::io::copy(&mut from_server, &mut to_client);
            let _ = to_client.shutdown(Shutdown::Both);
        });
        let mut to_server = server;
        let mut bytes = vec![0; 1 << 16];
        while let Ok(n @ 1..) = client.read(&mut bytes) {
            let begins = [&b"GET "[..], b"PUT ", b"HEAD "].map(|verb| bytes[..n].starts_with(verb));
            if begins.contains(&true) {
                requests.fetch_add(1, Ordering::SeqCst);
                match way {
                    Way::Slow(delay) => sleep(delay),
                    Way::ReadOnly if begins[1] => {
                        answer(&mut client, "403 Forbidden");
                        break;
                    }
                    Way::ReadOnly => {}
                }
            }
            if to_server.write_all(&bytes[..n]).is_err() {
                break;
            }
        }
        let _ = to_server.shutdown(Shutdown::Both);
    })
}

/// A server that has one answer to everything.
pub(crate) fn answering(status: &'static str) -> Listening {
    serve(move |mut client, requests| {
        let mut bytes = vec![0; 1 << 16];
        while let Ok(1..) = client.read(&mut bytes) {
            requests.fetch_add(1, Ordering::SeqCst);
            answer(&mut client, status);
        }
    })
}

/// A server that never answers.
pub(crate) fn silent() -> Listening {
    serve(|mut client, requests| {
        let mut bytes = vec![0; 1 << 16];
        while let Ok(1..) = client.read(&mut bytes) {
            requests.fetch_add(1, Ordering::SeqCst);
        }
    })
}

fn serve(with: impl Fn(TcpStream, &AtomicUsize) + Clone + Send + 'static) -> Listening {
    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("ports are free");
    let port = listener.local_addr().expect("it has an address").port();
    let requests = Arc::<AtomicUsize>::default();
    let counted = Arc::clone(&requests);
    spawn(move || {
        for client in listener.incoming().flatten() {
            let (with, requests) = (with.clone(), Arc::clone(&counted));
            spawn(move || with(client, &requests));
        }
    });
    Listening { port, requests }
}

fn answer(client: &mut TcpStream, status: &str) {
    // Who has gone wants no answer.
    let _ = write!(client, "HTTP/1.1 {status}\r\nContent-Length: 0\r\n\r\n");
}
