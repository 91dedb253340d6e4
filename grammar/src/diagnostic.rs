//! What is wrong with a spec, as data.

use crate::{Advice, Span};

/// One fault, with everything a reader needs to mend it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Which fault; stable, printed as `IVX0203`.
    pub code: Code,
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// Where; the first label is the place itself.
    pub labels: Vec<Label>,
    /// How to mend it.
    pub help: Option<String>,
    /// A word at its place, and what would stand there rightly.
    pub instead: Option<Box<(String, String)>>,
}

/// A stretch of text and what is to be said about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// Where.
    pub span: Span,
    /// What; short.
    pub text: String,
}

/// Whether a spec can run all the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// It cannot.
    Error,
    /// It can.
    Warning,
}

macro_rules! codes {
    ($($(#[doc = $doc:literal])+ $name:ident = $number:literal $severity:ident;)+) => {
        /// The faults there are.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Code {
            $($(#[doc = $doc])+ $name = $number,)+
        }

        impl Code {
            /// Every fault there is.
            pub const ALL: &[Self] = &[$(Self::$name),+];

            /// Whether a spec with this fault can run.
            #[must_use]
            pub fn severity(self) -> Severity {
                match self { $(Self::$name => Severity::$severity,)+ }
            }

            /// What the fault is, in one sentence.
            #[must_use]
            pub fn docs(self) -> &'static str {
                match self { $(Self::$name => concat!($($doc, "\n"),+),)+ }
            }
        }
    };
}

codes! {
    /// The text does not read as the language.
    Syntax = 101 Error;
    /// Brackets are nested more deeply than 256.
    Nesting = 102 Error;
    /// A number does not fit.
    Number = 103 Error;
    /// The file does not begin with an edition that this version knows.
    Edition = 104 Error;
    /// A doc comment stands before nothing.
    StrayDoc = 105 Warning;

    /// A file, a program or a variable that the spec names cannot be used.
    File = 201 Error;
    /// Files name each other in a circle.
    Cycle = 202 Error;
    /// A file lies outside the project.
    Outside = 203 Error;

    /// A name is not known here.
    UnknownName = 301 Error;
    /// No operation, part or function has this name.
    UnknownCall = 302 Error;
    /// The call has no such argument.
    UnknownArgument = 303 Error;
    /// A required argument is left out.
    MissingArgument = 304 Error;
    /// An argument is given twice.
    TwiceGiven = 305 Error;
    /// An axis or dimension is not known here.
    UnknownAxis = 306 Error;
    /// An axis has no such label.
    UnknownLabel = 307 Error;
    /// No parameter or profile has this name.
    UnknownParameter = 308 Error;
    /// A name is declared twice, or hides another.
    Shadowing = 309 Error;
    /// A name is defined in terms of itself.
    Recursion = 310 Error;
    /// A match has no arm for a label of its axis.
    MissingArm = 311 Error;

    /// A value has the wrong type.
    Type = 401 Error;
    /// A number lies outside the range declared.
    Range = 402 Error;
    /// A description must be known before anything runs, but is computed.
    NotLiteral = 403 Error;
    /// Dimensions of one name and different extent are combined.
    Dimensions = 404 Error;
    /// An axis mentions what is not known before anything runs, or has no value.
    Axis = 405 Error;
    /// One side of a claim varies over an axis that the other lacks.
    ClaimAxes = 406 Error;
    /// The statement needs a value of another kind.
    Kind = 407 Error;
    /// A file of published numbers does not read as such.
    Published = 408 Error;
    /// The arguments of a call do not go together.
    Rule = 409 Error;

    /// The program expands to more nodes than allowed.
    TooLarge = 501 Error;

    /// A name is declared and not used.
    Unused = 601 Warning;
    /// Two samples draw the same numbers and feed one consumer.
    SharedStream = 602 Warning;
}

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "IVX{:04}", *self as u16)
    }
}

impl Diagnostic {
    /// A fault at one place.
    #[must_use]
    pub fn new(
        code: Code,
        span: Span,
        message: impl Into<String>,
        label: impl Into<String>,
    ) -> Self {
        let labels = vec![Label { span, text: label.into() }];
        Self { code, message: message.into(), labels, help: None, instead: None }
    }

    /// The same, with advice.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The same, with advice where there is some.
    #[must_use]
    pub fn maybe_help(mut self, help: Option<impl Into<Advice>>) -> Self {
        if let (None, Some(advice)) = (&self.help, help) {
            let Advice { said, instead } = advice.into();
            (self.help, self.instead) = (Some(said), instead);
        }
        self
    }

    /// The same, with a second place.
    #[must_use]
    pub fn also(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into() });
        self
    }
}

/// `a` or `an`, as the name of a type wants it in a message.
#[must_use]
pub fn article(name: &str) -> &'static str {
    if name.starts_with(['A', 'E', 'I', 'O']) { "an" } else { "a" }
}
