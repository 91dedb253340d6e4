//! A Gaussian belief over coefficients.

use ivx_math::polynomial::polynomial;
use ivx_op::{Artifact, Data, Tensors};

/// A Gaussian belief over the coefficients of a polynomial with Gaussian noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Posterior {
    /// The mean of each coefficient, from the constant up: `[D]`.
    pub mean: Vec<f64>,
    /// A root of the covariance `root rootᵀ`, row by row: `[D, D]`.
    pub root: Vec<f64>,
    /// The standard deviation of the noise.
    pub noise: f64,
    /// The log density of the data before they were seen.
    pub log_evidence: f64,
}

impl Posterior {
    /// The mean function: the prediction, averaged over the belief.
    #[must_use]
    pub fn mean_at(&self, xs: &[f64]) -> Vec<f64> {
        polynomial(&self.mean, xs)
    }

    /// The variance of the function, without noise: `‖rootᵀ φ(x)‖²`.
    #[must_use]
    pub fn variance_at(&self, xs: &[f64]) -> Vec<f64> {
        let width = self.mean.len();
        let column = |j| self.root.iter().skip(j).step_by(width).copied().collect::<Vec<f64>>();
        let columns = (0..width).map(|j| polynomial(&column(j), xs));
        let mut variance = vec![0.0; xs.len()];
        for column in columns {
            for (sum, value) in variance.iter_mut().zip(column) {
                *sum += value * value;
            }
        }
        variance
    }

    /// The covariance of coefficients `i` and `j`.
    ///
    /// # Panics
    /// If there is no such coefficient.
    #[must_use]
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        let width = self.mean.len();
        let row = |i: usize| &self.root[i * width..(i + 1) * width];
        row(i).iter().zip(row(j)).map(|(a, b)| a * b).sum()
    }
}

impl Artifact for Posterior {
    const KIND: &'static str = "Posterior";

    fn encode(&self) -> Vec<u8> {
        let width = self.mean.len();
        let arrays = [
            ("facts".to_owned(), Data::F64(vec![2], vec![self.noise, self.log_evidence])),
            ("mean".to_owned(), Data::F64(vec![width], self.mean.clone())),
            ("root".to_owned(), Data::F64(vec![width, width], self.root.clone())),
        ];
        Tensors { arrays: arrays.into() }.encode(Self::KIND, &())
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, ()) = Tensors::decode(Self::KIND, bytes)?;
        let (_, facts) = tensors.f64("facts")?;
        let [noise, log_evidence] = facts.try_into().ok()?;
        let (_, mean) = tensors.f64("mean")?;
        let (shape, root) = tensors.f64("root")?;
        let square = shape == [mean.len(), mean.len()];
        square.then_some(Self { mean, root, noise, log_evidence })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn posterior() -> Posterior {
        Posterior {
            mean: vec![1.0, -2.0],
            root: vec![2.0, 1.0, 0.0, 3.0],
            noise: 0.1,
            log_evidence: -4.5,
        }
    }

    #[test]
    fn survives_the_round_trip() {
        assert_eq!(Posterior::decode(&posterior().encode()), Some(posterior()));
    }

    #[test]
    fn the_line_at_two() {
        // 1 − 2·2 = −3; the columns of the root are the lines 2 and 1 + 3x: 2² + 7² = 53.
        assert_eq!(posterior().mean_at(&[2.0]), [-3.0]);
        assert_eq!(posterior().variance_at(&[2.0]), [53.0]);
        // Covariance [[5, 3], [3, 9]]: 5 + 2·2·3 + 4·9 = 53.
        let covariance = |i, j| posterior().covariance(i, j);
        assert_eq!([covariance(0, 0), covariance(0, 1), covariance(1, 1)], [5.0, 3.0, 9.0]);
    }
}
