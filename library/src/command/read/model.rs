//! A learned function of a file.

use std::collections::BTreeMap;

use ivx_data::{Form, Outputs};
use ivx_nn::{Curve, Module};
use ivx_nn::{Head, Model, NetModel};
use ivx_op::{Artifact as _, Ctx, Data, One, Op, OpError, declare, kind_of, read_tensors};

use super::{is_left_behind, output, wrong};

declare! {
    /// The model that a program wrote as `.safetensors`: one that `as_file` gave it, or one of these.
    ///
    /// - A polynomial has the array `theta`: its coefficients from the constant up.
    /// - A network has the arrays `0.weight` of shape `[in, out]`, `0.bias`, `1.weight` and so on,
    ///   and the metadata `activation` with the name of what follows each hidden layer. Numbers are
    ///   rounded to single precision.
    pub struct ReadModel = "read_model" @ 2 -> Model {
        /// What `command` left behind.
        outputs: One<Outputs>;
        /// The file's name.
        name: String;
    }
    rule is_left_behind;
}

impl Op for ReadModel {
    fn run(&self, _: &Ctx) -> Result<Model, OpError> {
        let bytes = &output(&self.outputs, &self.name)?.bytes[..];
        let model = if kind_of(bytes).is_some() {
            Model::decode(bytes).ok_or_else(|| "it is an artifact, and no model".to_owned())
        } else {
            read_tensors(bytes).and_then(|(tensors, metadata)| model(tensors.arrays, &metadata))
        };
        model.and_then(sound).map_err(|why| wrong(&self.name, &why))
    }
}

/// The model, if it can be evaluated.
fn sound(model: Model) -> Result<Model, String> {
    match &model {
        Model::Net(net) => ivx_nn::check(net).map(|()| model),
        // What decodes can be evaluated.
        Model::Polynomial(_) | Model::Fitted(_) => Ok(model),
    }
}

fn model(
    mut arrays: BTreeMap<String, Data>,
    metadata: &BTreeMap<String, String>,
) -> Result<Model, String> {
    if let Some(theta) = arrays.remove("theta") {
        let (shape, theta) = wide("theta", theta)?;
        if !arrays.is_empty() || shape.len() != 1 || theta.is_empty() {
            return Err("a polynomial has one array, `theta`, of one dimension".to_owned());
        }
        return Ok(Model::Polynomial(theta));
    }
    let activation = metadata.get("activation").map_or("", String::as_str);
    let curve = ivx_nn::curve(activation)?;
    let mut layers = Vec::new();
    let mut params = Vec::new();
    #[expect(clippy::cast_possible_truncation, reason = "networks are of single precision")]
    let narrow = |values: Vec<f64>| values.into_iter().map(|x| x as f32).collect();
    for (name, data) in arrays {
        let (shape, values) = wide(&name, data)?;
        if let Some(layer) = name.strip_suffix(".weight").and_then(|layer| layer.parse().ok()) {
            let [inputs, outputs] = shape[..] else {
                return Err(format!("`{name}` has the shape [in, out], and not {shape:?}"));
            };
            layers.push((layer, Module::Dense { inputs, outputs, curve }));
        }
        params.push((name, shape, narrow(values)));
    }
    layers.sort_unstable_by_key(|(layer, _): &(usize, _)| *layer);
    let mut layers: Vec<Module> = layers.into_iter().map(|(_, layer)| layer).collect();
    match layers.last_mut() {
        Some(Module::Dense { curve, .. }) => *curve = Curve::Identity,
        _ => return Err("a network has the arrays `0.weight` and `0.bias`".to_owned()),
    }
    let (module, form, head) = (Module::Sequence(layers), Form::default(), Head::Mean);
    Ok(Model::Net(NetModel::new(module, form, head, 0.0, params)))
}

/// The numbers in double precision.
fn wide(name: &str, data: Data) -> Result<(Vec<usize>, Vec<f64>), String> {
    let (shape, values) = match data {
        Data::F64(shape, values) => (shape, values),
        Data::F32(shape, values) => (shape, values.into_iter().map(f64::from).collect()),
        Data::U8(..) => return Err(format!("`{name}` holds bytes; numbers are F64 or F32")),
    };
    let finite = values.iter().all(|x| x.is_finite());
    if finite {
        Ok((shape, values))
    } else {
        Err(format!("`{name}` has a number that is not finite"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_data::Blob;

    fn array(shape: &[usize], values: &[f64]) -> Data {
        Data::F64(shape.to_vec(), values.to_vec())
    }

    fn check(arrays: &[(&str, Data)], activation: &str, expected: Result<f64, &str>) {
        let arrays = arrays.iter().map(|(name, data)| ((*name).to_owned(), data.clone()));
        let metadata = [("activation".to_owned(), activation.to_owned())].into();
        match (model(arrays.collect(), &metadata).and_then(sound), expected) {
            (Ok(model), Ok(value)) => assert_eq!(model.predict(&[2.0]), [value]),
            (Err(why), Err(part)) => assert!(why.contains(part), "{why}"),
            (found, _) => panic!("{found:?}"),
        }
    }

    #[test]
    fn a_polynomial_is_its_coefficients() {
        // 1 − 2·2 + 3·4 = 9
        check(&[("theta", array(&[3], &[1.0, -2.0, 3.0]))], "", Ok(9.0));
        check(&[("theta", array(&[1, 1], &[1.0]))], "", Err("one dimension"));
        check(&[("theta", array(&[1], &[f64::NAN]))], "", Err("not finite"));
    }

    #[test]
    fn a_network_is_its_layers() {
        // relu(2·[1, −1] + [0.5, 0]) = [2.5, 0]; 2.5·4 + 0·8 − 1 = 9
        let net = [
            ("0.weight", array(&[1, 2], &[1.0, -1.0])),
            ("0.bias", array(&[2], &[0.5, 0.0])),
            ("1.weight", array(&[2, 1], &[4.0, 8.0])),
            ("1.bias", array(&[1], &[-1.0])),
        ];
        check(&net, "relu", Ok(9.0));
        check(&net, "sine", Err("one of elu, identity, relu, relu6, sigmoid"));
        check(&net[..3], "relu", Err("the array `1.bias` of shape [1] is not there"));
        check(&net[..2], "relu", Err("it puts out 2 numbers, and its targets take 1"));
        let mut turned = net.clone();
        turned[0].1 = array(&[2, 1], &[1.0, -1.0]);
        check(&turned, "relu", Err("a layer for 2 numbers takes no 1"));
        turned[0].1 = array(&[2], &[1.0, -1.0]);
        check(&turned, "relu", Err("`0.weight` has the shape [in, out], and not [2]"));
        let more = [&net[..], &[("scale", array(&[1], &[1.0]))]].concat();
        check(&more, "relu", Err("the array `scale` belongs to no layer"));
        check(&[], "relu", Err("a network has the arrays `0.weight` and `0.bias`"));
    }

    #[test]
    fn our_own_models_are_read_as_they_were_written() {
        let own = Model::Polynomial(vec![1.0, 0.1]);
        let outputs = Outputs { files: [("m".to_owned(), Blob::plain(own.encode()))].into() };
        let read = ReadModel { outputs: One(outputs), name: "m".to_owned() };
        assert_eq!(read.run(&Ctx::new("read_model", 0, None)), Ok(own));
        let hostile = |units, expected: &str| {
            let module = Module::Sequence(vec![
                Module::Lstm { inputs: 1, units },
                Module::Last,
                Module::Dense { inputs: units, outputs: 1, curve: Curve::Identity },
            ]);
            let (form, head) = (Form { input: vec![2, 1], ..Form::default() }, Head::Mean);
            let net = NetModel::new(module, form, head, 1.0, Vec::new());
            let own = Model::Net(net);
            let outputs = Outputs { files: [("m".to_owned(), Blob::plain(own.encode()))].into() };
            let read = ReadModel { outputs: One(outputs), name: "m".to_owned() };
            let why = read.run(&Ctx::new("read_model", 0, None)).unwrap_err().to_string();
            assert!(why.contains(expected), "{why}");
        };
        hostile(usize::MAX, "too large");
        hostile(4, "`0.input_weight` of shape [1, 16] is not there");
    }
}
