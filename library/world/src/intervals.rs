//! The union of several regions.

use ivx_op::{OpError, declare};

use super::Region;

declare! {
    /// The union of several regions; what they share counts once.
    pub struct Intervals = "intervals" @ 1 {
        /// The regions.
        parts: Vec<Box<dyn Region>>;
    }
}

impl Region for Intervals {
    fn intervals(&self) -> Result<Vec<(f64, f64)>, OpError> {
        let mut all = Vec::new();
        for part in &self.parts {
            all.extend(part.intervals()?);
        }
        if all.is_empty() {
            return Err(OpError::Failed("the region has no intervals".to_owned()));
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut merged: Vec<(f64, f64)> = Vec::new();
        for (low, high) in all {
            match merged.last_mut() {
                Some(last) if low <= last.1 => last.1 = last.1.max(high),
                _ => merged.push((low, high)),
            }
        }
        Ok(merged)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Interval;
    use super::*;

    fn union(parts: &[(f64, f64)]) -> Result<Vec<(f64, f64)>, String> {
        let part = |&(low, high): &(f64, f64)| Box::new(Interval { low, high }) as _;
        let region = Intervals { parts: parts.iter().map(part).collect() };
        region.intervals().map_err(|error| error.to_string())
    }

    #[test]
    fn overlaps_count_once() {
        let parts = [(2.0, 3.0), (-1.0, 0.5), (0.0, 1.0), (0.25, 0.5)];
        assert_eq!(union(&parts), Ok(vec![(-1.0, 1.0), (2.0, 3.0)]));
    }

    #[test]
    fn what_is_no_region_is_explained() {
        assert_eq!(union(&[]), Err("the region has no intervals".into()));
        let backwards = "the interval ends at 0, before it starts at 1";
        assert_eq!(union(&[(0.0, 1.0), (1.0, 0.0)]), Err(backwards.into()));
    }
}
