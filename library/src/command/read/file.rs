//! A file as it is.

use ivx_data::{Blob, Outputs};
use ivx_op::{Ctx, One, Op, OpError, declare};

use super::{is_left_behind, output};

declare! {
    /// One file that a program wrote, as it is, executable where it was: for `as_file`, which gives it to another.
    pub struct ReadFile = "read_file" @ 2 -> Blob {
        /// What `command` left behind.
        outputs: One<Outputs>;
        /// The file's name.
        name: String;
    }
    rule is_left_behind;
}

impl Op for ReadFile {
    fn run(&self, _: &Ctx) -> Result<Blob, OpError> {
        output(&self.outputs, &self.name).cloned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_found_by_its_name() {
        let outputs = Outputs {
            files: [("a".to_owned(), Blob { bytes: b"x".to_vec(), is_executable: true })].into(),
        };
        let read = |name: &str| {
            let read = ReadFile { outputs: One(outputs.clone()), name: name.to_owned() };
            read.run(&Ctx::new("read_file", 0, None)).map_err(|error| error.to_string())
        };
        assert_eq!(read("a"), Ok(outputs.files["a"].clone()));
        assert_eq!(read("b"), Err("there is no output `b`; there is `a`".to_owned()));
    }
}
