//! The one declaration.

/// Declares an operation or a part: a struct whose fields are its arguments.
///
/// ```
/// use ivx_op::{Array, One, declare};
///
/// declare! {
///     /// A part: what follows `@` is its version.
///     pub struct Cvar = "cvar" @ 1 {
///         /// Share of members kept.
///         alpha: f64 = 0.25, in 0.01..=1.0;
///     }
/// }
///
/// declare! {
///     /// An operation: it has a result. `stochastic` ones vary over `seed`.
///     pub struct Jitter = "jitter" @ 1, stochastic -> Array [like value] {
///         /// A port: an artifact, one coordinate at a time.
///         value: One<Array>;
///         /// A port that may be left out.
///         beside: Option<One<Array>>;
///         /// A description, with its range and its unit.
///         scale: f64 = 1.0, in 0.0.., unit "metres";
///     }
/// }
/// ```
///
/// Behind the braces, `rule name;` names a [`Rule`](crate::Rule): a function that says which arguments
/// do not go together. Behind that, `shapes name;` names a [`ShapeRule`](crate::ShapeRule) of an operation:
/// a function that says which shapes its result has, for the rules of what takes it.
///
/// Dimensions inside the result: none, `[x, y]`, `[like port]`, `[union]` of all arrays without the
/// named axes, `[union to rank]`, `[reduce port]` without the named axes, `[reduce port to rank]`,
/// `[named dims]` as the argument `dims` says.
#[macro_export]
macro_rules! declare {
    (
        $(#[doc = $doc:literal])+
        $vis:vis struct $ty:ident = $name:literal @ $version:literal $(, $flag:ident)?
        $(-> $out:ident $([$($dims:tt)+])?)? {
            $(
                $(#[doc = $arg_doc:literal])+
                $field:ident: $field_ty:ty $(= $default:expr)? $(, in $range:expr)?
                    $(, unit $unit:literal)?;
            )*
        }
        $(rule $rule:path;)?
        $(shapes $shapes:path;)?
    ) => {
        $(#[doc = $doc])+
        #[derive(Debug)]
        $vis struct $ty { $( $(#[doc = $arg_doc])+ pub $field: $field_ty, )* }

        impl $crate::Declared for $ty {
            const NAME: &'static str = $name;
            const VERSION: u32 = $version;
            const DOCS: &'static str = concat!($($doc, "\n"),+);
            const STOCHASTIC: bool = $crate::declare!(@flag $($flag)?);
            const RULE: Option<$crate::Rule> = $crate::declare!(@function $($rule)?);
            const SHAPES: Option<$crate::ShapeRule> = $crate::declare!(@function $($shapes)?);

            fn args() -> Vec<$crate::ArgDecl> {
                vec![$( $crate::ArgDecl {
                    name: $crate::field_name(stringify!($field)),
                    docs: concat!($($arg_doc, "\n"),+),
                    kind: <$field_ty as $crate::Arg>::kind(),
                    default: None$(.or(Some($crate::Lit::from($default))))?,
                    range: None$(.or(Some($crate::Range::from($range))))?,
                    unit: None$(.or(Some($unit)))?,
                    how: <$field_ty as $crate::Arg>::HOW,
                } ),*]
            }

            #[expect(clippy::allow_attributes, reason = "unused only where there are no arguments")]
            #[allow(unused_variables)]
            fn build(call: &$crate::Call) -> Result<Self, $crate::ArgError> {
                Ok(Self { $( $field: $crate::Arg::take(call, $crate::field_name(stringify!($field)))?, )* })
            }
        }

        $(
            impl $crate::Produces for $ty {
                type Out = $out;
                const DIMS: $crate::Dims = $crate::declare!(@dims $($($dims)+)?);
            }
        )?
    };
    (@function) => { None };
    (@function $function:path) => { Some($function) };
    (@flag) => { false };
    (@flag stochastic) => { true };
    (@dims) => { $crate::Dims::Fixed(&[]) };
    (@dims like $port:ident) => { $crate::Dims::Reduced { port: stringify!($port), add: &[] } };
    (@dims reduce $port:ident) => { $crate::Dims::Reduced { port: stringify!($port), add: &[] } };
    (@dims reduce $port:ident to $add:ident) => {
        $crate::Dims::Reduced { port: stringify!($port), add: &[stringify!($add)] }
    };
    (@dims union) => { $crate::Dims::Union { add: &[] } };
    (@dims union to $add:ident) => { $crate::Dims::Union { add: &[stringify!($add)] } };
    (@dims named $arg:ident) => { $crate::Dims::Named(stringify!($arg)) };
    (@dims $($dim:ident),+) => { $crate::Dims::Fixed(&[$(stringify!($dim)),+]) };
}

/// Makes a family of parts an argument type: `Box<dyn Trait>`, looked up in the family's table.
///
/// The table is a function that returns `&'static Parts<dyn Trait>`. The name is given here and
/// not read from the table, since a part that holds others of its family is declared while
/// the table is being made.
#[macro_export]
macro_rules! family {
    ($part:ty, $name:literal, $table:path) => {
        impl $crate::Family for $part {
            const NAME: &'static str = $name;
        }

        impl $crate::Literal for Box<$part> {
            fn ty() -> $crate::Ty {
                $crate::Ty::Part($name.to_owned())
            }
            fn from_lit(lit: &$crate::Lit) -> Result<Self, $crate::ArgError> {
                let $crate::Lit::Part(part) = lit else {
                    return Err($crate::ArgError::Type {
                        expected: Self::ty(),
                        found: lit.clone(),
                    });
                };
                $table().build(part)
            }
        }
    };
}

/// The name of a field in the language: `r#in` is `in`.
#[must_use]
pub const fn field_name(name: &'static str) -> &'static str {
    match name.as_bytes() {
        [b'r', b'#', ..] => name.split_at(2).1,
        _ => name,
    }
}
