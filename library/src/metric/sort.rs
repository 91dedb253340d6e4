//! Sorting.

use ivx_math::order::sorted;
use ivx_op::{Array, AxisNames, Ctx, Dim, Labels, Named, Op, OpError, declare};

use super::reduce::Groups;

declare! {
    /// The numbers in ascending order, over `rank`: 0 is the lowest.
    pub struct Sort = "sort" @ 1 -> Array [reduce x to rank] {
        /// What to sort.
        x: Named<Array>;
        /// The axes and dimensions whose place `rank` takes.
        over: AxisNames;
    }
}

impl Op for Sort {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let x = Array::stack(&self.x.0).map_err(OpError::Failed)?;
        let groups = Groups::of(&x, &self.over.0)?;
        let mut dims: Vec<Dim> = groups.kept.iter().map(|&d| x.dims[d].clone()).collect();
        if dims.iter().any(|dim| dim.name == "rank") {
            return Err(OpError::Failed("the value already has a dimension `rank`".to_owned()));
        }
        dims.push(Dim::new("rank", Labels::count(groups.offsets.len())));
        let values = groups.starts.iter().flat_map(|&start| sorted(&groups.gather(&x, start)));
        Ok(Array { values: values.collect(), dims })
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Gathered, Labels};

    use super::*;

    #[test]
    fn each_group_is_sorted_by_itself() {
        let member = Dim::new("member", Labels::count(3));
        let ke = Dim::new("#0", Labels::Names(vec!["WCM".into(), "MA".into()]));
        let rows = [vec![3.0, 1.0, 2.0], vec![0.0, -1.0, 9.0]];
        let values = rows.map(|row| Array::series(member.clone(), row)).to_vec();
        let x = Named(Gathered { dims: vec![ke.clone()], values, name: String::new() });
        let over = AxisNames(vec!["member".to_owned()]);
        let ctx = Ctx::new("sort", 0, None);
        let ranked = Sort { x, over }.run(&ctx).unwrap();
        assert_eq!(ranked.dims, [ke, Dim::new("rank", Labels::count(3))]);
        assert_eq!(ranked.values, [1.0, 2.0, 3.0, -1.0, 0.0, 9.0]);
    }
}
