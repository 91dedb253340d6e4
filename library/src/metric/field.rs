//! The fields of records; `run.success` is written for it.

use ivx_op::{AnyArtifact, AnyRecord, Ctx, One, Op, OpError, declare};

declare! {
    /// One field of a record.
    pub struct Field = "field" @ 1 -> AnyArtifact {
        /// Of what.
        record: One<AnyRecord>;
        /// The field.
        name: String;
    }
}

impl Op for Field {
    fn run(&self, _: &Ctx) -> Result<AnyArtifact, OpError> {
        let bytes = self.record.0.0.get(&self.name);
        let missing = || OpError::Failed(format!("there is no field `{}`", self.name));
        bytes.cloned().map(AnyArtifact).ok_or_else(missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_is_its_own_bytes() {
        let record =
            || One(AnyRecord([("a".to_owned(), vec![1, 2]), ("b".to_owned(), vec![3])].into()));
        let ctx = Ctx::new("field", 0, None);
        let field = |name: &str| Field { record: record(), name: name.to_owned() }.run(&ctx);
        assert_eq!(field("b"), Ok(AnyArtifact(vec![3])));
        assert!(field("c").is_err());
    }
}
