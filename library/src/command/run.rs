//! A program as a node.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

use ivx_data::{Blob, Outputs};
use ivx_op::{
    Content, Ctx, Facts, File, How, Lit, Literal as _, Op, OpError, Program, Shapes, Word, Wrong,
    declare,
};

use super::folder::{Folder, MAX_OUTPUT, relative};
use super::input::Input;
use super::setting::Setting;
use super::{outside, process};

declare! {
    /// The files that a program leaves behind, run in an empty folder with the files and variables
    /// it is given and nothing on its standard input.
    ///
    /// The program runs again when its name or its bytes, an argument, a file, an input or a
    /// variable is another. Where `seed` is mentioned it varies over `seed`, and nowhere else. What
    /// it reads beyond this is not contained and not known. `docs/command.md` tells all of it.
    pub struct RunProgram = "command" @ 2 -> Outputs {
        /// A program found in PATH, or its absolute path, in quotes.
        program: Program;
        /// What follows its name; no shell reads it.
        args: Vec<Word> = Vec::<i64>::new();
        /// Files beside the spec that the program finds in its folder, in quotes; those that may be executed still may.
        files: Vec<File> = Vec::<i64>::new();
        /// What was computed before, as files.
        inputs: Vec<Box<dyn Input>> = Vec::<i64>::new();
        /// The files that it must write; no other is kept.
        outputs: Vec<String> = Vec::<i64>::new();
        /// The name by which its standard output is one more output; by default it is none.
        stdout: String = "";
        /// Its environment, which has nothing else.
        env: Vec<Box<dyn Setting>> = Vec::<i64>::new();
        /// The file that pins what the program loads, such as `requirements.txt` or `uv.lock`. It
        /// is one more of the files.
        lock: Option<File> = "";
        /// After so long it is killed.
        time_limit: How<f64> = 3600.0, in f64::MIN_POSITIVE.., unit "seconds";
    }
    rule names_are_given_once;
    shapes outputs;
}

/// The outputs by name, for what reads them.
fn outputs(facts: &Facts<'_>) -> Option<Shapes> {
    let mut names = facts.arg::<Vec<String>>("outputs")?;
    names.extend(facts.arg::<String>("stdout").filter(|name| !name.is_empty()));
    Some(names.into_iter().map(|name| (name, Vec::new())).collect())
}

/// Every file in the working folder has a name of its own, whoever wrote it.
fn names_are_given_once(facts: &Facts<'_>) -> Result<(), Wrong> {
    let files = facts.arg::<Vec<File>>("files").unwrap_or_default();
    let lock = facts.arg::<Option<File>>("lock").flatten();
    let inputs = match facts.args.get("inputs") {
        Some(Lit::List(inputs)) => inputs.as_slice(),
        _ => &[],
    };
    let input = |input: &Lit| match input {
        Lit::Part(part) => part.args.get("name").and_then(|name| String::from_lit(name).ok()),
        _ => None,
    };
    let outputs = facts.arg::<Vec<String>>("outputs").unwrap_or_default();
    let stdout = facts.arg::<String>("stdout").filter(|name| !name.is_empty());
    let all = (files.into_iter().map(|File(file)| ("files", "a file", file.name)))
        .chain(lock.map(|File(file)| ("lock", "the lock", file.name)))
        .chain(inputs.iter().filter_map(input).map(|name| ("inputs", "an input", name)))
        .chain(outputs.into_iter().map(|name| ("outputs", "an output", name)))
        .chain(stdout.map(|name| ("stdout", "the standard output", name)));
    let mut known: BTreeMap<PathBuf, &str> = BTreeMap::new();
    for (arg, what, name) in all {
        let path = relative(&name).map_err(|message| {
            let help = "write a path in the folder, such as `\"out/result.json\"`".to_owned();
            Wrong { arg, message, help }
        })?;
        if let Some(before) = known.insert(path, what) {
            let message = format!("`{name}` is the name of {before} and of {what}");
            let help = "give one of them another name: what a program is given is no output of it";
            return Err(Wrong { arg, message, help: help.to_owned() });
        }
    }
    Ok(())
}

impl Op for RunProgram {
    fn run(&self, _: &Ctx) -> Result<Outputs, OpError> {
        let failed = |why: String| OpError::Failed(why);
        let program = &self.program.0;
        let Content::Program(path) = &program.content else {
            unreachable!("a program has the content of one")
        };
        let mut folder = Folder::new().map_err(failed)?;
        for File(file) in self.files.iter().chain(&self.lock) {
            let Content::File { bytes, is_executable } = &file.content else {
                unreachable!("a file has the content of one")
            };
            folder.put(&file.name, bytes, *is_executable).map_err(failed)?;
        }
        for input in &self.inputs {
            let (name, file) = input.write()?;
            folder.put(&name, &file.bytes, file.is_executable).map_err(failed)?;
        }
        let wanted = self.outputs.iter().map(|name| Ok((name, folder.take(name)?)));
        let wanted: Vec<_> = wanted.collect::<Result<_, String>>().map_err(failed)?;
        let keeps = !self.stdout.is_empty();
        if keeps {
            folder.take(&self.stdout).map_err(failed)?;
        }
        if outside::digest(path).ok() != Some(program.digest) {
            let why = "is not what it was when the spec was read: run again";
            return Err(failed(format!("`{}` {why}", program.name)));
        }
        let mut command = Command::new(path);
        command.args(self.args.iter().map(|Word(word)| word));
        command.current_dir(&folder.path).env_clear().envs(self.variables()?);
        let keep = keeps.then_some(MAX_OUTPUT);
        let stdout = process::run(command, &program.name, *self.time_limit, keep);
        // Where the folder lay is no part of what went wrong.
        let place = folder.path.display().to_string();
        let stdout = stdout
            .map_err(|why| failed(why.replace(&format!("{place}/"), "").replace(&place, ".")))?;
        let mut files = BTreeMap::new();
        for (name, path) in wanted {
            files.insert(name.clone(), folder.collect(&path).map_err(failed)?);
        }
        if keeps {
            folder.fits(stdout.len()).map_err(failed)?;
            files.insert(self.stdout.clone(), Blob::plain(stdout));
        }
        Ok(Outputs { files })
    }
}

impl RunProgram {
    /// Its environment.
    fn variables(&self) -> Result<BTreeMap<String, OsString>, OpError> {
        let mut variables = BTreeMap::new();
        for setting in &self.env {
            if let Some((name, value)) = setting.setting()?
                && variables.insert(name.clone(), value).is_some()
            {
                return Err(OpError::Failed(format!("the variable `{name}` is given twice")));
            }
        }
        Ok(variables)
    }
}

#[cfg(test)]
mod tests {
    use std::ffi::OsStr;

    use ivx_op::{AnyArtifact, Array, Artifact as _, External, One};

    use super::super::input::AsFile;
    use super::super::setting::SetVariable;
    use super::*;

    const CTX: Ctx = Ctx::new("command", 0, None);

    fn shell(script: &str) -> RunProgram {
        let args = ["-c", script].map(|word| Word(word.to_owned())).to_vec();
        RunProgram {
            program: Program(outside::program("sh", OsStr::new("/bin:/usr/bin")).unwrap()),
            args,
            files: Vec::new(),
            inputs: Vec::new(),
            outputs: vec!["out".to_owned()],
            stdout: String::new(),
            env: Vec::new(),
            lock: None,
            time_limit: How(60.0),
        }
    }

    fn file(name: &str, text: &str) -> File {
        File(External::file(name.to_owned(), text.into(), false))
    }

    #[track_caller]
    fn check(command: &RunProgram, expected: Result<&str, &str>) {
        match (command.run(&CTX), expected) {
            (Ok(outputs), Ok(text)) => {
                assert_eq!(String::from_utf8_lossy(&outputs.files["out"].bytes), text);
            }
            (Err(error), Err(part)) => assert!(error.to_string().contains(part), "{error}"),
            (found, _) => panic!("{found:?}"),
        }
    }

    #[test]
    fn a_program_sees_what_it_is_given_and_nothing_else() {
        let number = AsFile {
            value: One(AnyArtifact(Array::scalar(0.5).encode())),
            name: "in/x.json".to_owned(),
        };
        let variable = SetVariable { name: "SEED".to_owned(), value: Word("3".to_owned()) };
        let command = RunProgram {
            files: vec![file("a.txt", "a")],
            lock: Some(file("uv.lock", "l")),
            inputs: vec![Box::new(number)],
            env: vec![Box::new(variable)],
            ..shell(
                "{ find . -type f | sort; cat a.txt in/x.json; env | grep -v -e PWD -e ^_=; cat; } > ../$$; cat ../$$ > out; rm ../$$",
            )
        };
        check(&command, Ok("./a.txt\n./in/x.json\n./uv.lock\na0.5SEED=3\n"));
    }

    #[test]
    fn only_declared_outputs_are_kept() {
        let mut command = shell("echo more > more; echo said; echo x > out");
        command.stdout = "log".to_owned();
        let outputs = command.run(&CTX).unwrap();
        assert_eq!(outputs.files.keys().collect::<Vec<_>>(), ["log", "out"]);
        assert_eq!(outputs.files["log"].bytes, b"said\n");
        check(&shell("true"), Err("`out` was not written"));
        check(&shell("ln -s /etc/passwd out"), Err("`out` is a link"));
        check(&shell("echo no >&2; exit 4"), Err("exit code 4"));
        check(&shell("echo $PWD/a.py in $PWD >&2; exit 4"), Err("ends:\n    a.py in ."));
    }

    #[test]
    fn who_may_execute_a_file_still_may() {
        let run = File(External::file("run".to_owned(), b"#!/bin/sh\necho 4\n".to_vec(), true));
        let mut command = shell("./run > out; ./x; cp run made; cp x out2");
        command.files = vec![run];
        let input = Blob { bytes: b"#!/bin/sh\necho 5 >> out\n".to_vec(), is_executable: true };
        let value = One(AnyArtifact(input.encode()));
        command.inputs = vec![Box::new(AsFile { value, name: "x".to_owned() })];
        command.outputs = ["out", "made"].map(str::to_owned).to_vec();
        let outputs = command.run(&CTX).unwrap();
        assert_eq!(outputs.files["out"], Blob::plain(b"4\n5\n".to_vec()));
        assert!(outputs.files["made"].is_executable);
    }

    #[test]
    fn names_are_given_once() {
        let clash = |change: &dyn Fn(&mut RunProgram)| {
            let mut command = shell("echo x > out");
            change(&mut command);
            check(&command, Err("two files are called"));
        };
        clash(&|command| command.files = vec![file("out", "")]);
        clash(&|command| command.stdout = "out".to_owned());
        clash(&|command| command.outputs.push("out".to_owned()));
        clash(&|command| command.files = vec![file("a", ""), file("a", "")]);
        let mut command = shell("echo x > out");
        command.outputs[0] = "../out".to_owned();
        check(&command, Err("no name of a file"));
    }

    #[test]
    fn a_program_that_changed_since_it_was_looked_up_does_not_run() {
        let mut command = shell("echo x > out");
        command.program.0.digest[0] ^= 1;
        check(&command, Err("not what it was when the spec was read"));
    }
}
