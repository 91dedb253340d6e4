//! Boxes of marbles.

use ivx_op::{Ctx, Figure, Op, OpError, declare, shown};
use ivx_world::Problem;

use super::drawing::{Axis, Drawing, Form, Mark, Series, Tint};
use super::page::count;
use super::render::render;
use super::text::chance;

declare! {
    /// What may be drawn from each box of a problem (Figure 2.2): a marble for each outcome, with what it pays inside,
    /// and below it how probable it is where that is not certain. Of several lotteries that are held possible
    /// one stands above the other.
    pub struct Marbles = "marbles" @ 1 -> Figure {
        /// The problem.
        of: Box<dyn Problem>;
        /// Above the boxes.
        title: String = "";
    }
}

/// The room that a marble has to the side, and upwards.
const ROOM: (f64, f64) = (1.4, 1.6);

/// Between boxes.
const GAP: f64 = 0.7;

/// More marbles beside each other, or lotteries above each other, have no room.
const MOST: usize = 8;

/// A box: the lotteries that it may be, and how probable each is.
struct Choice<'a> {
    name: &'a str,
    models: Vec<(&'a [f64], &'a [f64])>,
    weights: Vec<f64>,
}

impl Op for Marbles {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let actions = self.of.actions();
        let mut choices = Vec::new();
        for (name, belief) in &actions {
            let (models, weights) = belief.models()?;
            let models = models.iter().map(|lottery| lottery.atoms()).collect::<Result<_, _>>()?;
            choices.push(Choice { name, models, weights });
        }
        let sizes = choices.iter().flat_map(|c| c.models.iter().map(|(x, _)| x.len()));
        let most = sizes.chain(choices.iter().map(|c| c.models.len())).max().unwrap_or(0);
        if most > MOST {
            let message = format!("there is room for {MOST} marbles in a row, and here are {most}");
            return Err(OpError::Failed(message));
        }
        let high = ROOM.1 * count(choices.iter().map(|c| c.models.len()).max().unwrap_or(1));
        let mut left = 0.0;
        let mut marks = Vec::new();
        for choice in &choices {
            marks.extend(choice.drawn(left, high));
            left += choice.width() + GAP;
        }
        let axis = |low, high| Axis { range: Some((low, high)), bare: true, ..Axis::default() };
        let (x, y) = (axis(-0.1, left - GAP + 0.1), axis(-0.7, high + 0.1));
        let series = vec![Series { marks, ..Series::default() }];
        Ok(render(&Drawing { title: self.title.clone(), x, y, series, ..Drawing::default() }))
    }
}

impl Choice<'_> {
    /// Room for its marbles, and for its weights on the left.
    fn width(&self) -> f64 {
        let most = self.models.iter().map(|(x, _)| x.len()).max().unwrap_or(1);
        count(most) * ROOM.0 + 1.0
    }

    fn drawn(&self, left: f64, high: f64) -> Vec<Mark> {
        let size = (self.width(), high);
        let at = (left + size.0 / 2.0, high / 2.0);
        let (form, tint) = (Form::Rectangle, Tint::White);
        let mut marks = vec![
            Mark::Shape { at, size, form, tint, text: String::new() },
            Mark::Text(at.0, -0.6, self.name.to_owned()),
        ];
        let row = high / count(self.models.len());
        let are_even = self.weights.iter().all(|weight| *weight == self.weights[0]);
        for (i, ((outcomes, chances), weight)) in self.models.iter().zip(&self.weights).enumerate()
        {
            let y = high - (count(i) + 0.5) * row;
            if !are_even {
                marks.push(Mark::Text(left + 0.45, y - 0.1, chance(*weight)));
            }
            let first = at.0 - ROOM.0 * (count(outcomes.len()) - 1.0) / 2.0;
            for (j, (pays, p)) in outcomes.iter().zip(*chances).enumerate() {
                marks.extend(marble((first + ROOM.0 * count(j), y), *pays, *p));
            }
        }
        marks
    }
}

fn marble(at: (f64, f64), pays: f64, p: f64) -> Vec<Mark> {
    let text = shown(pays).replace('-', "−");
    let size = (0.8, 0.8);
    let mut marks = vec![Mark::Shape { at, size, form: Form::Circle, tint: Tint::of(pays), text }];
    if p != 1.0 {
        marks.push(Mark::Text(at.0, at.1 - 0.75, chance(p)));
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_world::{Belief, BeliefOver, Boxes, Discrete, Lottery};

    fn marbles(left: Box<dyn Belief>, right: Box<dyn Belief>) -> String {
        let marbles = Marbles { of: Box::new(Boxes { left, right }), title: String::new() };
        marbles.run(&Ctx::new("marbles", 0, None)).unwrap().files["svg"].clone()
    }

    fn belief(models: &[(&[f64], &[f64])], weights: &[f64]) -> Box<dyn Belief> {
        let lottery = |(outcomes, probabilities): &(&[f64], &[f64])| {
            let (outcomes, probabilities) = (outcomes.to_vec(), probabilities.to_vec());
            Box::new(Discrete { outcomes, probabilities }) as Box<dyn Lottery>
        };
        let models = models.iter().map(lottery).collect();
        Box::new(BeliefOver { models, weights: weights.to_vec() })
    }

    #[test]
    fn each_box_has_its_marbles() {
        let risk = belief(&[(&[-1.0, 1.0], &[0.25, 0.75])], &[]);
        let unknown = belief(&[(&[-1.0], &[1.0]), (&[0.0], &[1.0]), (&[1.0], &[1.0])], &[]);
        let found = marbles(risk, unknown);
        let texts = |text: &str| found.matches(&format!(">{text}<")).count();
        assert_eq!([texts("LEFT"), texts("RIGHT"), texts("0.25"), texts("0.75")], [1; 4]);
        assert_eq!([texts("−1"), texts("0"), texts("1")], [2, 1, 2]);
        assert_eq!(found.matches("<circle").count(), 5);
        assert_eq!(found.matches(r##"fill="#8fd3b6""##).count(), 2);
    }

    #[test]
    fn beliefs_that_are_not_even_say_so() {
        let sure = || belief(&[(&[0.0], &[1.0])], &[]);
        let uneven = belief(&[(&[-1.0], &[1.0]), (&[1.0], &[1.0])], &[0.9, 0.1]);
        let found = marbles(sure(), uneven);
        assert!(found.contains(">0.9<") && found.contains(">0.1<"));
    }
}
