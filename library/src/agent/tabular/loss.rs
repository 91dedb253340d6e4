//! What learners with a number for everything lower (§C.2.1): the losses of a batch of steps.

use ivx_nn::{Graph, ParamId, Real, Shape, Var};

/// Steps of episodes, by what is known of each. States and actions are places, as tables take them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Steps<F> {
    /// Where each was taken.
    pub states: Vec<F>,
    /// What was done.
    pub actions: Vec<F>,
    /// The place of state and action together.
    pub pairs: Vec<F>,
    /// What it paid.
    pub rewards: Vec<F>,
    /// Where it led.
    pub next: Vec<F>,
    /// 1, or 0 where the episode ended.
    pub goes_on: Vec<F>,
}

/// How far the values of what was done lie above the targets of expected SARSA (Eqn. 2.44), which have no gradient: `[B]`.
///
/// ```text
/// q(s, a) - (r + γ Σ_a' π(a' | s') q(s', a'))
/// ```
///
/// - `values`, `policy`: `[S, A]`.
pub fn td_errors<F: Real>(
    graph: &Graph<F>,
    [values, policy]: [ParamId; 2],
    discount: f64,
    steps: &Steps<F>,
) -> Var {
    let follows = graph.still(|| {
        let next = column(graph, &steps.next);
        let (q, policy) = (graph.embedding(next, values), graph.embedding(next, policy));
        graph.sum_items(graph.mul(q, policy))
    });
    // Nothing follows the end of an episode.
    let follows = graph.mul(follows, column(graph, &steps.goes_on));
    let rewards = column(graph, &steps.rewards);
    let target = graph.add(rewards, graph.affine(follows, discount, 0.0));
    let q = graph.embedding(column(graph, &steps.states), values);
    let tried = graph.pick(q, column(graph, &steps.actions));
    graph.sub(tried, target)
}

/// The mean of the squares of [`td_errors`].
pub fn expected_sarsa_loss<F: Real>(
    graph: &Graph<F>,
    tables: [ParamId; 2],
    discount: f64,
    steps: &Steps<F>,
) -> Var {
    graph.mean(graph.square(td_errors(graph, tables, discount, steps)))
}

/// The mean negative log-probability, in nats, of the states that followed (Eqn. 2.51).
///
/// - `logits`: `[S · A, S]`; the softmax of each row is `p(· | s, a)`.
pub fn transition_loss<F: Real>(graph: &Graph<F>, logits: ParamId, steps: &Steps<F>) -> Var {
    let rows = graph.embedding(column(graph, &steps.pairs), logits);
    graph.mean(graph.cross_entropy(rows, column(graph, &steps.next)))
}

/// The mean squared error of rewards.
///
/// - `rewards`: `[S · A, 1]`.
pub fn reward_loss<F: Real>(graph: &Graph<F>, rewards: ParamId, steps: &Steps<F>) -> Var {
    let expected = graph.embedding(column(graph, &steps.pairs), rewards);
    graph.mean(graph.square(graph.sub(expected, column(graph, &steps.rewards))))
}

fn column<F: Real>(graph: &Graph<F>, values: &[F]) -> Var {
    graph.input(Shape::vectors(values.len(), 1), values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_nn::Params;

    /// Two states, two actions: one step that goes on, one that ends.
    fn steps() -> Steps<f64> {
        Steps {
            states: vec![0.0, 1.0],
            actions: vec![1.0, 0.0],
            pairs: vec![1.0, 2.0],
            rewards: vec![1.0, 1.0],
            next: vec![1.0, 0.0],
            goes_on: vec![1.0, 0.0],
        }
    }

    /// The value of a loss of one learned table, and its gradient.
    fn of(
        shape: [usize; 2],
        table: &[f64],
        loss: impl Fn(&Graph<f64>, [ParamId; 2]) -> Var,
    ) -> (f64, Vec<f64>) {
        let mut params = Params::default();
        let learned = params.add("table".to_owned(), shape.to_vec(), table.to_vec());
        let policy = vec![0.5, 0.5, 0.25, 0.75];
        let policy = params.add_fixed("policy".to_owned(), vec![2, 2], policy);
        let graph = Graph::new(params);
        let loss = loss(&graph, [learned, policy]);
        let value = graph.scalar(loss);
        graph.backward(loss);
        let params = graph.params();
        (value, params.grad(learned).expect("it is learned").to_vec())
    }

    fn close(found: &(f64, Vec<f64>), value: f64, gradient: &[f64]) {
        assert!((found.0 - value).abs() < 1e-12, "{found:?}");
        let apart = found.1.iter().zip(gradient).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(apart && found.1.len() == gradient.len(), "{found:?}");
    }

    #[test]
    fn losses_by_hand() {
        let q = [1.0, 2.0, 4.0, 8.0];
        // 2 − 1 − ½ (¼·4 + ¾·8) = −2.5, and 4 − 1: the mean of 6.25 and 9, and halves of twice the errors.
        let sarsa = of([2, 2], &q, |g, tables| expected_sarsa_loss(g, tables, 0.5, &steps()));
        close(&sarsa, 7.625, &[0.0, -2.5, 3.0, 0.0]);
        let rewards = of([4, 1], &q, |g, [table, _]| reward_loss(g, table, &steps()));
        close(&rewards, 5.0, &[0.0, 1.0, 3.0, 0.0]);
        // Three to one for what followed, in one row; one to one in the other.
        let logits = [0.0, 0.0, 0.0, 3.0_f64.ln(), 0.0, 0.0, 0.0, 0.0];
        let model = of([4, 2], &logits, |g, [table, _]| transition_loss(g, table, &steps()));
        let value = -f64::midpoint(0.75_f64.ln(), 0.5_f64.ln());
        close(&model, value, &[0.0, 0.0, 0.125, -0.125, -0.25, 0.25, 0.0, 0.0]);
    }
}
