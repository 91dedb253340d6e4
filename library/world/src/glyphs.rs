//! Ten glyphs to be told apart.

use ivx_data::Form;
use ivx_op::declare;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::Task;

declare! {
    /// The digits as small images to be told apart: each is 5 × 7 dots, somewhere in an image of
    /// 10 × 10, with Gaussian noise on every dot.
    pub struct Glyphs = "glyphs" @ 1 {
        /// Standard deviation of the noise; dots are 0 or 1.
        noise: f64 = 0.3, in 0.0..;
    }
}

/// Rows and columns of an image.
const SIZE: usize = 10;
/// Rows and columns of a glyph.
const GLYPH: (usize, usize) = (7, 5);

/// The dots of each digit, row after row.
const DIGITS: [[&str; 7]; 10] = [
    [".###.", "#...#", "#...#", "#...#", "#...#", "#...#", ".###."],
    ["..#..", ".##..", "..#..", "..#..", "..#..", "..#..", ".###."],
    [".###.", "#...#", "....#", "..##.", ".#...", "#....", "#####"],
    [".###.", "#...#", "....#", "..##.", "....#", "#...#", ".###."],
    ["...#.", "..##.", ".#.#.", "#..#.", "#####", "...#.", "...#."],
    ["#####", "#....", "####.", "....#", "....#", "#...#", ".###."],
    [".###.", "#....", "#....", "####.", "#...#", "#...#", ".###."],
    ["#####", "....#", "...#.", "..#..", "..#..", "..#..", "..#.."],
    [".###.", "#...#", "#...#", ".###.", "#...#", "#...#", ".###."],
    [".###.", "#...#", "#...#", ".####", "....#", "....#", ".###."],
];

impl Task for Glyphs {
    fn form(&self) -> Form {
        Form {
            input: vec![1, SIZE, SIZE],
            target: Vec::new(),
            classes: Some(DIGITS.len()),
            ..Form::default()
        }
    }

    fn draw(&self, rng: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>) {
        let digit = rng.random_range(0..DIGITS.len());
        let (rows, cols) = GLYPH;
        let top = rng.random_range(0..=SIZE - rows);
        let left = rng.random_range(0..=SIZE - cols);
        let mut image = vec![0.0; SIZE * SIZE];
        for (y, row) in DIGITS[digit].iter().enumerate() {
            for (x, dot) in row.bytes().enumerate() {
                image[(top + y) * SIZE + left + x] = if dot == b'#' { 1.0 } else { 0.0 };
            }
        }
        for dot in &mut image {
            let noise: f64 = StandardNormal.sample(rng);
            *dot += self.noise * noise;
        }
        #[expect(clippy::cast_precision_loss, reason = "there are ten")]
        let class = digit as f64;
        (image, vec![class])
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;

    #[test]
    fn an_image_has_the_dots_of_its_digit_anywhere() {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut seen = std::collections::BTreeSet::new();
        for _ in 0..400 {
            let (image, class) = Glyphs { noise: 0.0 }.draw(&mut rng);
            let digit = DIGITS.iter().zip(0_u8..).find(|(_, i)| f64::from(*i) == class[0]);
            let (digit, index) = digit.unwrap();
            let dots = digit.concat().bytes().filter(|dot| *dot == b'#').count();
            assert_eq!(image.iter().filter(|dot| **dot == 1.0).count(), dots);
            let first = image.iter().position(|dot| *dot == 1.0).unwrap();
            seen.insert((index, first));
        }
        assert!(seen.len() > 150, "{} of 240 digits and places", seen.len());
    }
}
