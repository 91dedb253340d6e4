//! The program that hands nodes out, as the engine sees it.

use std::ffi::{OsStr, OsString};
use std::io::{self, BufRead as _, BufReader, Write as _};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use ivx_cache::{Digest, Place};
use ivx_engine::{Crew, News, Room};
use ivx_library::{SOURCE_DIGEST, command};
use ivx_op::Needs;

use super::words::{Ask, Batch, Tell, words};
use crate::version::version;

/// The most bytes of the driver's standard error that are told of when it ends.
const TAIL: usize = 4000;
/// How long a driver may take to end once it is not needed.
const PATIENCE: Duration = Duration::from_secs(5);

/// What `--on` names, not started yet.
pub(crate) struct Driver {
    program: PathBuf,
    args: Vec<OsString>,
    shared: Arc<Shared>,
    child: Mutex<Option<(Child, ChildStdin)>>,
}

/// Who is told what becomes of batches.
type Listener = Box<dyn FnMut(News) + Send>;

struct Shared {
    room: Mutex<Room>,
    tell: Mutex<Option<Listener>>,
}

impl Driver {
    /// The driver that is asked for: `ray`, or with arguments of its own `slurm --workers 8 --partition long`.
    ///
    /// # Errors
    /// If there is none.
    pub(crate) fn find(on: &str, store: &OsStr) -> Result<Self, String> {
        let mut words = on.split_whitespace();
        let name = words
            .next()
            .ok_or("`--on` names nobody: write `--on ray`, `--on slurm` or `--on workers`")?;
        let ivx = std::env::current_exe().map_err(|error| error.to_string())?;
        let (program, mut args) = if name == "workers" {
            (ivx.clone(), vec!["node".into(), "serve".into()])
        } else {
            let called = format!("ivx-on-{name}");
            let search = std::env::var_os("PATH").unwrap_or_default();
            let found = command::find(&called, &search).map_err(|why| {
                format!(
                    "`{called}` {why}: the wheel (`pip install ivx`) brings those of Ray and Slurm"
                )
            })?;
            (found, Vec::new())
        };
        let store = match Place::parse(store)? {
            Place::Folder(folder) => {
                std::path::absolute(folder).map_err(|error| error.to_string())?.into_os_string()
            }
            bucket @ Place::Bucket { .. } => bucket.to_string().into(),
        };
        let ours = [
            ("--ivx", ivx.into_os_string()),
            ("--store", store),
            ("--library", SOURCE_DIGEST.into()),
            ("--ivx-version", version().into()),
        ];
        args.extend(ours.into_iter().flat_map(|(flag, value)| [flag.into(), value]));
        args.extend(words.map(OsString::from));
        let room = Room { threads: 0, largest: Needs { threads: 1, memory: u64::MAX } };
        let shared = Arc::new(Shared { room: Mutex::new(room), tell: Mutex::new(None) });
        Ok(Self { program, args, shared, child: Mutex::new(None) })
    }

    fn say(&self, ask: &Ask) -> io::Result<()> {
        let mut child = held(&self.child);
        let gone = || io::Error::other("it has not begun");
        let (_, stdin) = child.as_mut().ok_or_else(gone)?;
        let line = serde_json::to_string(ask)?;
        writeln!(stdin, "{line}")?;
        stdin.flush()
    }
}

impl Crew for Driver {
    fn room(&self) -> Room {
        *held(&self.shared.room)
    }

    fn begin(&self, tell: Listener) -> io::Result<()> {
        *held(&self.shared.tell) = Some(tell);
        let mut child = held(&self.child);
        if child.is_some() {
            return Ok(());
        }
        let mut command = Command::new(&self.program);
        command
            .args(&self.args)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        // A Ctrl-C is for this process, which tells the driver what to do about it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let name = self.program.display().to_string();
        let unstarted = |error| io::Error::other(format!("{name} cannot be started: {error}"));
        let mut started = command.spawn().map_err(unstarted)?;
        let (stdin, stdout, stderr) =
            (started.stdin.take(), started.stdout.take(), started.stderr.take());
        let (Some(stdin), Some(stdout), Some(stderr)) = (stdin, stdout, stderr) else {
            return Err(io::Error::other("its pipes are not there"));
        };
        let tail = Arc::new(Mutex::new(Vec::new()));
        let heard = Arc::clone(&tail);
        thread::spawn(move || listen(stderr, &heard));
        let shared = Arc::clone(&self.shared);
        thread::spawn(move || {
            let mut failed = None;
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                if let Ok(tell) = serde_json::from_str::<Tell>(&line) {
                    failed = tell.failed.clone().or(failed);
                    shared.hear(&tell);
                }
            }
            let tail = held(&tail);
            let tail = String::from_utf8_lossy(&tail);
            let why = failed.unwrap_or_else(|| match tail.trim() {
                "" => format!("{name} has ended"),
                tail => format!("{name} has ended; its standard error ends:\n{tail}"),
            });
            shared.tell(News::Gone { why });
        });
        *child = Some((started, stdin));
        Ok(())
    }

    fn run(&self, batch: u64, keys: &[Digest], needs: Needs) -> io::Result<()> {
        let (keys, cpus) = (keys.to_vec(), needs.threads);
        self.say(&Ask::Run(Batch { run: batch, keys, cpus, gpus: 0, memory: needs.memory }))
    }

    fn cancel(&self, batch: u64) -> io::Result<()> {
        self.say(&Ask::Cancel { cancel: batch })
    }
}

impl Shared {
    fn tell(&self, news: News) {
        if let Some(tell) = &mut *held(&self.tell) {
            tell(news);
        }
    }

    fn hear(&self, tell: &Tell) {
        let Tell { ready, note, lost, done, why, .. } = tell;
        if let Some(what) = ready {
            let memory = if tell.largest_memory == 0 { u64::MAX } else { tell.largest_memory };
            let largest = Needs { threads: tell.largest_cpus.max(1), memory };
            *held(&self.room) = Room { threads: tell.cpus, largest };
            self.tell(News::Noted { what: format!("nodes run on {what}") });
        }
        if let Some(what) = note {
            self.tell(News::Noted { what: what.clone() });
        }
        if let Some(batch) = *lost {
            self.tell(News::Lost { batch, why: why.clone() });
        }
        if let Some(batch) = *done {
            let ended = match tell.code {
                0 => String::new(),
                code if code < 0 => why.clone(),
                code => format!("`ivx node exec` ended with {code}"),
            };
            let why = [ended.trim(), tell.err.trim()].join("\n").trim().to_owned();
            self.tell(News::Done { batch, words: words(&tell.said), why });
        }
    }
}

/// Ends the driver, which then has nothing more to do.
impl Drop for Driver {
    fn drop(&mut self) {
        *held(&self.shared.tell) = None;
        let Some((mut child, stdin)) = held(&self.child).take() else { return };
        drop(stdin);
        let since = Instant::now();
        while matches!(child.try_wait(), Ok(None)) {
            if since.elapsed() > PATIENCE {
                let _ = child.kill();
            }
            thread::sleep(Duration::from_millis(20));
        }
    }
}

/// Keeps the end of what is said.
fn listen(mut from: impl io::Read, tail: &Mutex<Vec<u8>>) {
    let mut bytes = [0; 4096];
    while let Ok(n @ 1..) = from.read(&mut bytes) {
        let mut tail = held(tail);
        tail.extend(&bytes[..n]);
        let over = tail.len().saturating_sub(TAIL);
        tail.drain(..over);
    }
}

fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
