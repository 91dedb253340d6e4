//! Worlds at the other end of a pipe: what all lanes do is one message, and what came of it another.

use std::path::Path;
use std::process::Command;

use ivx_data::{Columns, Field, Kind, Values};
use ivx_op::OpError;
use ivx_world::{Act, Actions, End, Luck, Spec, Step, Worlds};

use crate::hello::{MOST_SAID, spec};
use crate::pipe::Pipe;

/// What runs at the other end, and what the frames are.
const SCRIPT: &str = include_str!("worlds.py");

/// Most bytes of what is seen in all lanes.
const MOST_BYTES: usize = 1 << 30;

/// What a lane is asked for.
const NOTHING: u8 = 0;
const STEP: u8 = 1;
const RESET: u8 = 2;

/// A world as Python is asked for it.
pub(crate) struct Asked<'a> {
    /// The interpreter.
    pub(crate) program: &'a Path,
    /// What the environment is called.
    pub(crate) name: &'a str,
    /// What it is made with, as JSON.
    pub(crate) kwargs: &'a str,
    /// How long an answer may take, in seconds.
    pub(crate) time_limit: f64,
}

/// Starts Python: what it says of the world, and the pipe to it.
///
/// # Errors
/// If there is no Python, no gymnasium or no such world.
pub(crate) fn hear(asked: &Asked<'_>) -> Result<(String, Pipe), String> {
    let mut command = Command::new(asked.program);
    command.args(["-c", SCRIPT, asked.name, asked.kwargs]).current_dir("/").env_clear();
    // The order of what is hashed and the number of threads are not to reach a result.
    command.envs([
        ("PYTHONHASHSEED", "0"),
        ("OMP_NUM_THREADS", "1"),
        ("OPENBLAS_NUM_THREADS", "1"),
    ]);
    let program = asked.program.file_name().unwrap_or(asked.program.as_os_str());
    let mut pipe = Pipe::start(command, &program.to_string_lossy(), asked.time_limit)?;
    let said = pipe.line(MOST_SAID)?;
    String::from_utf8(said)
        .map(|said| (said, pipe))
        .map_err(|_| "it said what is no text instead of what the world is".to_owned())
}

/// Lanes of such worlds.
pub(crate) struct Bridge {
    pipe: Pipe,
    n: usize,
    sees: Vec<Field>,
    /// The bytes of a row of what is seen.
    row: usize,
    /// How many frames there were.
    frames: u32,
    asked: Vec<u8>,
    answer: Vec<u8>,
}

impl Bridge {
    /// `n` lanes of worlds that are as they were `told`.
    ///
    /// # Errors
    /// If they are not, or there are none.
    pub(crate) fn open(asked: &Asked<'_>, told: &str, n: usize) -> Result<Self, OpError> {
        let failed = |why: String| OpError::Failed(format!("`{}`: {why}", asked.name));
        let Spec { sees, does, .. } = spec(told).map_err(failed)?;
        let row: usize = sees.iter().map(|field| field.width() * size(field.kind)).sum();
        let wide = if let Actions::Continuous { low, .. } = &does { low.len() } else { 1 };
        if (row + 4 * wide).saturating_mul(n) > MOST_BYTES {
            return Err(failed(format!("{n} lanes show more than {} MiB", MOST_BYTES >> 20)));
        }
        let (said, mut pipe) = hear(asked).map_err(failed)?;
        if said != told {
            let why = "is not what it was when the spec was read: run again";
            return Err(OpError::Failed(format!("`{}` {why}", asked.name)));
        }
        let lanes = u32::try_from(n).map_err(|_| failed("there are too many lanes".to_owned()))?;
        pipe.send(&lanes.to_ne_bytes()).map_err(failed)?;
        let (asked, answer) = (Vec::new(), Vec::new());
        Ok(Self { pipe, n, sees, row, frames: 0, asked, answer })
    }

    /// Asks the same of each of `lanes`; what follows is to be appended.
    fn ask(&mut self, lanes: &[usize], what: u8) {
        self.asked.clear();
        self.asked.resize(self.n, NOTHING);
        for &lane in lanes {
            self.asked[lane] = what;
        }
    }

    /// Sends what is asked, and writes what is seen then in `lanes`.
    fn exchange(&mut self, lanes: &[usize], seen: &mut Columns) -> Result<(), OpError> {
        self.frames = self.frames.wrapping_add(1);
        // The number of the frame, what is seen, and a reward and an end for each.
        self.answer.resize(4 + lanes.len() * (self.row + 9), 0);
        self.pipe.send(&self.asked).map_err(OpError::Failed)?;
        self.pipe.receive(&mut self.answer).map_err(OpError::Failed)?;
        self.read(lanes, seen).map_err(|why| OpError::Failed(self.pipe.failed(why)))
    }

    fn read(&self, lanes: &[usize], seen: &mut Columns) -> Result<(), &'static str> {
        let (number, mut rest) = self.answer.split_at(4);
        if number != self.frames.to_ne_bytes() {
            return Err("answered what is no frame");
        }
        for (i, field) in self.sees.iter().enumerate() {
            let width = field.width();
            let (own, others) = rest.split_at(lanes.len() * width * size(field.kind));
            rest = others;
            let rows = lanes.iter().zip(own.chunks_exact(width * size(field.kind)));
            match (seen.values_mut(i).0, field.kind) {
                (Values::F32(values), _) => {
                    for (lane, row) in rows {
                        numbers(row, &mut values[lane * width..][..width])?;
                    }
                }
                (Values::U8(values), kind) => {
                    for (lane, row) in rows {
                        if kind == Kind::Bit && row.iter().any(|bit| *bit > 1) {
                            return Err("showed a bit that is neither 0 nor 1");
                        }
                        values[lane * width..][..width].copy_from_slice(row);
                    }
                }
                (Values::Index(values), kind) => {
                    let Kind::Index(n) = kind else { unreachable!("an index is of so many") };
                    for (lane, row) in rows {
                        let place = u32::from_ne_bytes(word(row));
                        if place as usize >= n {
                            return Err("showed one of so many that is none of them");
                        }
                        values[*lane] = place;
                    }
                }
            }
        }
        Ok(())
    }

    /// Rewards and ends, as they were answered last.
    fn outcome(&self, lanes: &[usize], step: &mut Step) -> Result<(), &'static str> {
        let rest = &self.answer[4 + lanes.len() * self.row..];
        let (rewards, ends) = rest.split_at(8 * lanes.len());
        for (i, &lane) in lanes.iter().enumerate() {
            let reward = f64::from_ne_bytes(word(&rewards[8 * i..]));
            if !reward.is_finite() {
                return Err("paid what is no number");
            }
            step.rewards[lane] = reward;
            step.ends[lane] = match ends[i] {
                0 => End::No,
                1 => End::Terminal,
                2 => End::Limit,
                _ => return Err("answered what is no frame"),
            };
        }
        Ok(())
    }
}

impl Worlds for Bridge {
    fn reset(
        &mut self,
        lanes: &[usize],
        luck: &mut [Luck],
        seen: &mut Columns,
    ) -> Result<(), OpError> {
        self.ask(lanes, RESET);
        for &lane in lanes {
            // Some worlds take seeds of 31 bits only.
            self.asked.extend((luck[lane].bits() >> 1).to_ne_bytes());
        }
        self.exchange(lanes, seen)
    }

    fn step(&mut self, lanes: &[usize], _: &mut [Luck], step: &mut Step) -> Result<(), OpError> {
        self.ask(lanes, STEP);
        for &lane in lanes {
            match step.acts.get(lane) {
                Act::Index(place) => {
                    self.asked.extend(i32::try_from(place).expect("far fewer").to_ne_bytes());
                }
                Act::Vector(vector) => {
                    self.asked.extend(vector.iter().flat_map(|x| x.to_ne_bytes()));
                }
            }
        }
        self.exchange(lanes, &mut step.after)?;
        self.outcome(lanes, step).map_err(|why| OpError::Failed(self.pipe.failed(why)))
    }
}

/// The bytes of a number on the way.
fn size(kind: Kind) -> usize {
    match kind {
        Kind::F32 | Kind::Index(_) => 4,
        Kind::U8 | Kind::Bit => 1,
    }
}

fn word<const N: usize>(bytes: &[u8]) -> [u8; N] {
    *bytes.first_chunk().expect("a word is whole")
}

fn numbers(row: &[u8], values: &mut [f32]) -> Result<(), &'static str> {
    let (words, _) = row.as_chunks::<4>();
    for (value, word) in values.iter_mut().zip(words) {
        *value = f32::from_ne_bytes(*word);
        if value.is_nan() {
            return Err("showed what is no number");
        }
    }
    Ok(())
}
