//! Networks learn tasks that others cannot.

use ivx_data::Dataset;
use ivx_library::metric::Accuracy;
use ivx_library::registry;
use ivx_nn::optim::Pull;
use ivx_nn::{Loss, Model, Net, Optimiser, Training, fit, init};
use ivx_op::{Ctx, Lit, Literal, One, Op as _, Part};
use ivx_world::{Copying, Glyphs, Task};

fn drawn(task: &dyn Task, n: usize, stream: &str) -> Dataset {
    let mut rng = Ctx::new("examples", 0, None).rng("examples", &[stream]);
    let mut data = Dataset { form: task.form(), ..Dataset::default() };
    for _ in 0..n {
        let (x, y) = task.draw(&mut rng);
        data.x.extend(x);
        data.y.extend(y);
    }
    data
}

/// A part as it is built from a description.
fn built<T: Literal>(part: &Part) -> T {
    T::from_lit(&registry().complete(part).into()).expect("it is of this family")
}

fn trained(net: &Part, data: &Dataset, lr: f64, steps: u64) -> Model {
    let rate = Part::new("linear").with("from", lr).with("to", 0.0);
    let optimiser: Box<dyn Optimiser> = built(&Part::new("adamw").with("lr", rate));
    let loss: Box<dyn Loss> = built(&Part::new("cross_entropy"));
    let net: Box<dyn Net> = built(net);
    let mut rng = Ctx::new("train", 5, None).rng("init", &[]);
    let net = init(&*net, &*loss, &data.form, &mut rng).expect("it takes such data");
    let how = Training {
        loss: &*loss,
        optimiser: &*optimiser,
        pull: Pull::NONE,
        batch: 64,
        adversarial: 0.0,
        steps,
    };
    Model::Net(fit(net, data, &how, &Ctx::new("train", 0, None)).expect("nobody stops it"))
}

/// The share of targets whose class has the largest logit.
fn accuracy(model: &Model, data: &Dataset) -> f64 {
    let accuracy = Accuracy { model: One(model.clone()), on: One(data.clone()) };
    accuracy.run(&Ctx::new("accuracy", 0, None)).expect("it runs").values[0]
}

/// Who remembers nothing is right at 17 of 20 steps, and at one of four of the others: 0.8875.
#[test]
fn a_recurrent_unit_learns_to_copy_over_twenty_steps() {
    let task = Copying { length: 3, delay: 14, symbols: 4 };
    let (data, test) = (drawn(&task, 2000, "main"), drawn(&task, 500, "test"));
    let gru = trained(&Part::new("gru").with("units", 48_i64), &data, 1e-2, 2500);
    let forgetful = trained(&Part::new("mlp").with("hidden", vec![32_i64]), &data, 1e-2, 300);
    let (gru, forgetful) = (accuracy(&gru, &test), accuracy(&forgetful, &test));
    assert!(forgetful < 0.9, "without memory {forgetful}");
    assert!(gru > 0.99, "with memory {gru}, without {forgetful}");
}

/// A linear map of the dots cannot know where the glyph is.
#[test]
fn a_convolutional_network_tells_ten_glyphs_apart() {
    let task = Glyphs { noise: 0.3 };
    let (data, test) = (drawn(&task, 6000, "main"), drawn(&task, 500, "test"));
    let cnn = Part::new("cnn").with("channels", vec![16_i64, 32]);
    let cnn = accuracy(&trained(&cnn, &data, 3e-3, 1200), &test);
    let flat = Part::new("sequence").with("layers", Lit::List(vec![Part::new("flatten").into()]));
    let linear = accuracy(&trained(&flat, &data, 3e-3, 600), &test);
    assert!(cnn > 0.97 && linear < 0.8, "{cnn} by convolutions, {linear} by a linear map");
}
