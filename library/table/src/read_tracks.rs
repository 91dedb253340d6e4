//! The windows of past and future that lie in files of the project.

use ivx_data::{Dataset, Form};
use ivx_op::{
    Args, Content, Ctx, Facts, File, Literal as _, Needs, Op, OpError, Shapes, Wrong, declare,
};

use crate::format::SMALL;
use crate::read_table::twice;
use crate::tracks::{Cut, Scene, argoverse, ethucy, paced, windows};

declare! {
    /// Where people and cars went, as windows that are cut from the tracks of one file or more: the input is the past,
    /// `[past, 2]`, and the target what came, `[future, 2]`, in metres from the last place of the past.
    ///
    /// `.txt` has pedestrians as ETH and UCY are passed on, a line for each at each time with frame, number, x and y;
    /// `.csv` a log of Argoverse 2, with the columns `track`, `category`, `step_10hz`, `x` and `y`. Windows are in the
    /// order of files, of who, and of time. Steps are those of a file: where all its frames are ten apart, one of ten frames.
    pub struct ReadTracks = "read_tracks" @ 1 -> Dataset {
        /// Files beside the spec, in quotes.
        files: Vec<File>;
        /// How many places are known, the last of them now.
        past: usize = 8, in 1.0..=1e6;
        /// How many places are to be foretold.
        future: usize = 12, in 1.0..=1e6;
        /// How many steps lie between two places.
        every: usize = 1, in 1.0..=1e9;
        /// How many steps lie between the begins of two windows, counted from the first step of their file.
        stride: usize = 1, in 1.0..=1e9;
        /// How far the last place is from the first at least, in metres.
        least: f64 = 0.0, in 0.0..=1e9;
        /// The categories whose tracks are cut; by default all.
        kinds: Vec<String> = Vec::<i64>::new();
    }
    rule are_tracks;
    shapes of_windows;
}

/// How a file of tracks is read.
type Read = fn(&str, &[u8]) -> Result<Scene, String>;

/// How the file of this name is read, and whether it says kinds; `None` where the name does not say it.
fn format(name: &str) -> Option<(Read, bool)> {
    let is = |extension: &str| name.to_ascii_lowercase().ends_with(extension);
    match (is(".txt"), is(".csv")) {
        (true, _) => Some((ethucy::read, false)),
        (_, true) => Some((argoverse::read, true)),
        _ => None,
    }
}

fn bytes(file: &File) -> &[u8] {
    match &file.0.content {
        Content::File { bytes, .. } => bytes,
        _ => unreachable!("a file has the content of one"),
    }
}

impl ReadTracks {
    fn form(&self) -> Form {
        let side = |n| vec![n, 2];
        Form { input: side(self.past), target: side(self.future), ..Form::default() }
    }

    /// # Errors
    /// What is wrong with a file, and how to mend it.
    fn read(&self) -> Result<Dataset, (String, &'static str)> {
        let cut = Cut {
            past: self.past,
            future: self.future,
            every: self.every as u64,
            stride: self.stride as u64,
            least: self.least,
            kinds: self.kinds.clone(),
        };
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for file in &self.files {
            let name = &file.0.name;
            let Some((read, _)) = format(name) else {
                let why = format!("`{name}` does not say how it is written");
                return Err((why, NAMED));
            };
            let scene = read(name, bytes(file)).map_err(|why| (why, MEND))?;
            let found =
                windows(&[paced(scene)], &cut).map_err(|why| (format!("`{name}`: {why}"), CUT))?;
            let parts =
                found.past.chunks_exact(self.past).zip(found.future.chunks_exact(self.future));
            for (past, future) in parts {
                let now = past[past.len() - 1];
                let from_now = |at: &[f64; 2]| [at[0] - now[0], at[1] - now[1]];
                x.extend(past.iter().flat_map(from_now));
                y.extend(future.iter().flat_map(from_now));
            }
        }
        Ok(Dataset { form: self.form(), x, y })
    }

    /// What the checker knows of a call.
    fn of(facts: &Facts<'_>) -> Option<Self> {
        Some(Self {
            files: facts.arg("files")?,
            past: facts.arg("past")?,
            future: facts.arg("future")?,
            every: facts.arg("every")?,
            stride: facts.arg("stride")?,
            least: facts.arg("least")?,
            kinds: facts.arg("kinds")?,
        })
    }
}

const NAMED: &str =
    "the name of a file of tracks ends in `.txt` (ETH and UCY) or `.csv` (Argoverse 2)";

const MEND: &str = "mend the file; `docs/data.md` tells how tracks are written";

const CUT: &str = "let windows have fewer places (`past`, `future`) or nearer ones (`every`), or take more tracks (`least`, `kinds`)";

/// What can be told before anything runs: of small files all.
fn are_tracks(facts: &Facts<'_>) -> Result<(), Wrong> {
    let Some(read) = ReadTracks::of(facts) else { return Ok(()) };
    let wrong = |arg, message: String, help: &str| Err(Wrong { arg, message, help: help.into() });
    let names: Vec<String> = read.files.iter().map(|file| file.0.name.clone()).collect();
    if names.is_empty() {
        return wrong("files", "no file has no tracks".to_owned(), "name one: `[\"eth.txt\"]`");
    }
    twice("files", &names)?;
    for name in &names {
        match format(name) {
            None => {
                return wrong("files", format!("`{name}` does not say how it is written"), NAMED);
            }
            Some((_, false)) if !read.kinds.is_empty() => {
                let message = format!("`{name}` does not say of what kind a track is");
                return wrong("kinds", message, "leave `kinds` out");
            }
            Some(_) => {}
        }
    }
    if read.files.iter().map(|file| bytes(file).len()).sum::<usize>() > SMALL {
        return Ok(());
    }
    read.read().map(drop).or_else(|(message, help)| wrong("files", message, help))
}

/// They depend on no file.
fn of_windows(facts: &Facts<'_>) -> Option<Shapes> {
    ReadTracks::of(facts).map(|read| read.form().shapes())
}

impl Op for ReadTracks {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        self.read().map_err(|(why, help)| OpError::Failed(format!("{why}; {help}")))
    }

    fn needs(args: &Args, _: Option<&Shapes>, _: u64) -> Needs {
        let files = args.get("files").and_then(|files| Vec::<File>::from_lit(files).ok());
        let n_bytes: usize = files.iter().flatten().map(|file| bytes(file).len()).sum();
        let count = |name| args.get(name).and_then(|n| usize::from_lit(n).ok()).unwrap_or(0);
        // A row of some sixteen bytes is cells and a point, and begins one window, whose numbers are there twice.
        let places = count("past").saturating_add(count("future")) as u64;
        let of_byte = places.saturating_mul(2).saturating_add(10);
        Needs { memory: (n_bytes as u64).saturating_mul(of_byte), ..Needs::default() }
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::External;

    use super::*;

    fn read(files: &[(&str, &str)], change: impl Fn(&mut ReadTracks)) -> Result<Dataset, OpError> {
        let file = |(name, text): &(&str, &str)| {
            File(External::file((*name).to_owned(), text.as_bytes().to_vec(), false))
        };
        let files = files.iter().map(file).collect();
        let kinds = Vec::new();
        let mut op =
            ReadTracks { files, past: 2, future: 1, every: 1, stride: 1, least: 0.0, kinds };
        change(&mut op);
        op.run(&Ctx::new("read_tracks", 0, None))
    }

    /// Somebody who walks to the east by one, two and three metres.
    const WALK: &str =
        "780\t1.0\t5.0\t2.0\n790\t1.0\t6.0\t2.0\n800\t1.0\t8.0\t2.5\n810\t1.0\t11.0\t3.0\n";
    const DRIVE: &str = "track,category,step_10hz,x,y\n4,BUS,7,0,0\n4,BUS,8,0,-2\n4,BUS,9,0,-4\n";

    #[test]
    fn places_are_seen_from_the_last_that_is_known() {
        let data = read(&[("a.txt", WALK)], |_| {}).unwrap();
        assert_eq!((data.form.input, data.form.target), (vec![2, 2], vec![1, 2]));
        assert_eq!(data.x, [-1.0, 0.0, 0.0, 0.0, -2.0, -0.5, 0.0, 0.0]);
        assert_eq!(data.y, [2.0, 0.5, 3.0, 0.5]);
        // Three frames of ten lie between the first and the last: two windows would need four.
        let data = read(&[("a.txt", WALK)], |op| (op.past, op.every) = (1, 3)).unwrap();
        assert_eq!((data.x, data.y), (vec![0.0, 0.0], vec![6.0, 1.0]));
    }

    #[test]
    fn several_files_are_one_data_set() {
        let data = read(&[("b.csv", DRIVE), ("a.txt", WALK)], |_| {}).unwrap();
        assert_eq!(data.x, [0.0, 2.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -2.0, -0.5, 0.0, 0.0]);
        assert_eq!(data.y, [0.0, -2.0, 2.0, 0.5, 3.0, 0.5]);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_file() {
        let why = |files: &[(&str, &str)], change: fn(&mut ReadTracks)| {
            let Err(OpError::Failed(why)) = read(files, change) else { panic!("it can be read") };
            why
        };
        let short = why(&[("a.txt", WALK), ("b.csv", DRIVE)], |op| op.future = 2);
        assert!(short.starts_with("`b.csv`: none of 1 tracks has 4 points, 1 steps"), "{short}");
        assert!(short.contains("`past`"), "{short}");
        let foreign = why(&[("a.txt", DRIVE)], |_| {});
        assert!(foreign.starts_with("`a.txt`, line 1: 1 numbers in the place of"), "{foreign}");
        let none = why(&[("b.csv", DRIVE)], |op| op.kinds = vec!["TRAM".to_owned()]);
        assert!(none.starts_with("`b.csv`: no track is of `TRAM`; there are `BUS`"), "{none}");
        assert!(why(&[("a.npy", "")], |_| {}).contains("`.txt` (ETH and UCY)"));
    }
}
