//! Networks.

use flatland::sdf::Sdf;
use flatland::sdf::shapes::Parametric;
use glam::DVec3;
use serde_json::{Value, json};

use super::{check_messages, here, message};
use crate::io::{parse_network, read_network, write_network};
use crate::sdf::network::{Architecture, Network};

fn network() -> Network {
    let architecture = Architecture { hidden: 2, width: 5, sharpness: 0.1 + 0.2, frequencies: 2 };
    Network::sphere(architecture, 0.5, 1).unwrap().with_slope_bound(2.0 / 3.0).unwrap()
}

pub(super) fn file() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.safetensors");
    write_network(&path, &network()).unwrap();
    assert_eq!(read_network(&path).unwrap(), network());
    std::fs::read(&path).unwrap()
}

/// One hidden neuron φ = 4 σ(x + 2y + 3z − 1) + 0.5 in single precision.
fn header() -> Value {
    json!({
        "__metadata__": { "format": "pt", "network": "sharpness=100 frequencies=0" },
        "layers.0.weight": { "dtype": "F32", "shape": [1, 3], "data_offsets": [0, 12] },
        "layers.0.bias": { "dtype": "F32", "shape": [1], "data_offsets": [12, 16] },
        "layers.1.weight": { "dtype": "F32", "shape": [1, 1], "data_offsets": [16, 20] },
        "layers.1.bias": { "dtype": "F32", "shape": [1], "data_offsets": [20, 24] },
    })
}

fn numbers() -> Vec<u8> {
    [1.0, 2.0, 3.0, -1.0, 4.0, 0.5].iter().flat_map(|x: &f32| x.to_le_bytes()).collect()
}

fn whole(header: &Value, numbers: &[u8]) -> Vec<u8> {
    let header = header.to_string().into_bytes();
    [&(header.len() as u64).to_le_bytes(), &header[..], numbers].concat()
}

pub(super) fn single() -> Vec<u8> {
    whole(&header(), &numbers())
}

#[test]
fn a_file_is_the_same_network_to_the_bit() {
    assert_eq!(file(), file());
    let bits = |network: &Network| network.parameters().iter().map(|p| p.to_bits()).collect::<Vec<_>>();
    let read = parse_network(&file(), here("a")).unwrap();
    assert_eq!(bits(&read), bits(&network()));
    assert_eq!(read.slope_bound(), 2.0 / 3.0);
}

#[test]
fn single_precision_is_read() {
    let network = parse_network(&single(), here("a")).unwrap();
    assert_eq!(
        network.architecture(),
        Architecture { hidden: 1, width: 1, sharpness: 100.0, frequencies: 0 }
    );
    assert_eq!(network.parameters(), [1.0, 2.0, 3.0, -1.0, 4.0, 0.5]);
    // e^{−500} is negligible compared with 5.
    assert_eq!(network.jet(DVec3::ONE).value, 20.5);
}

#[test]
fn every_truncation_is_refused() {
    let bytes = file();
    for end in 0..bytes.len() {
        assert!(parse_network(&bytes[..end], here("a")).is_err(), "{end} of {} bytes", bytes.len());
    }
}

#[test]
fn errors_say_what_is_wrong() {
    let parsed = |header: &Value, numbers: &[u8]| message(parse_network(&whole(header, numbers), here("a")));
    let changed = |change: &dyn Fn(&mut Value)| {
        let mut header = header();
        change(&mut header);
        parsed(&header, &numbers())
    };
    let entry = |text: &str| changed(&|h| h["__metadata__"]["network"] = json!(text));
    let renamed = |from: &str, to: &str| {
        changed(&|h| {
            let tensor = h.as_object_mut().unwrap().remove(from).unwrap();
            h[to] = tensor;
        })
    };
    let number = |index: usize, value: f32| {
        let mut numbers = numbers();
        numbers[4 * index..4 * index + 4].copy_from_slice(&value.to_le_bytes());
        parsed(&header(), &numbers)
    };
    let shaped = |tensor: &str, shape: Value| changed(&|h| h[tensor]["shape"] = shape.clone());
    let bytes = |bytes: &[u8]| message(parse_network(bytes, here("a")));
    let all = "sharpness, frequencies or slope_bound";
    let none = "a: the metadata have no \"network\"; write \"sharpness=100 frequencies=0\" there, with the numbers it was \
                trained with";
    let unexpected = |name: &str| {
        format!("a: a network has no tensor \"{name}\"; expected layers.K.weight and layers.K.bias only")
    };
    check_messages(&[
        (bytes(&[]), "a: the header takes 8 bytes, but the file has 0"),
        (bytes(&[255; 8]), "a: the header takes 18446744073709551623 bytes, but the file has 8"),
        (bytes(&[2, 0, 0, 0, 0, 0, 0, 0, b'{']), "a: the header takes 10 bytes, but the file has 9"),
        (parsed(&header(), &numbers()[1..]), "a: the tensors take 24 bytes, but the file has 23 for them"),
        (parsed(&header(), &[0; 25]), "a: the tensors take 24 bytes, but the file has 25 for them"),
        (changed(&|h| h["__metadata__"] = json!({})), none),
        (changed(&|h| drop(h.as_object_mut().unwrap().remove("__metadata__"))), none),
        (
            entry("sharpness=1"),
            "a: the metadata's \"network\": expected frequencies=…, found \"sharpness=1\"",
        ),
        (
            entry("frequencies=1"),
            "a: the metadata's \"network\": expected sharpness=…, found \"frequencies=1\"",
        ),
        (entry("sharp"), "a: the metadata's \"network\": expected KEY=VALUE, found \"sharp\""),
        (entry("beta=1"), &format!("a: the metadata's \"network\": expected {all}, found \"beta=1\"")),
        (
            entry("frequencies=-1"),
            "a: the metadata's \"network\": expected a whole number, found \"frequencies=-1\"",
        ),
        (entry("sharpness=b"), "a: the metadata's \"network\": expected a number, found \"sharpness=b\""),
        (
            entry("sharpness=1 sharpness=1"),
            "a: the metadata's \"network\": expected every number once, found \"sharpness=1\"",
        ),
        (entry("sharpness=0 frequencies=0"), "a: network: sharpness = 0 is not positive and finite"),
        (entry("sharpness=1 frequencies=33"), "a: network: frequencies = 33 is not at most 32"),
        (
            entry("sharpness=1 frequencies=0 slope_bound=nan"),
            "a: network: slope_bound = NaN is not positive and finite",
        ),
        (entry("sharpness=1 frequencies=2"), "a: \"layers.0.weight\" has the shape [1, 3]; expected [1, 15]"),
        (renamed("layers.0.weight", "layers.4.weight"), "a: there is no tensor \"layers.2.weight\""),
        (renamed("layers.1.bias", "layers.2.bias"), "a: there is no tensor \"layers.1.bias\""),
        (renamed("layers.1.bias", "layers.1.scale"), &unexpected("layers.1.scale")),
        (renamed("layers.1.bias", "layers.01.bias"), &unexpected("layers.01.bias")),
        (renamed("layers.0.weight", "lin0.weight"), &unexpected("lin0.weight")),
        (shaped("layers.0.weight", json!([3])), "a: \"layers.0.weight\" has the shape [3]; expected [3, 3]"),
        (
            shaped("layers.0.weight", json!([3, 1])),
            "a: \"layers.0.weight\" has the shape [3, 1]; expected [3, 3]",
        ),
        (shaped("layers.0.bias", json!([1, 1])), "a: \"layers.0.bias\" has the shape [1, 1]; expected [1]"),
        (
            changed(&|h| {
                h["layers.0.weight"] = json!({ "dtype": "F16", "shape": [1, 6], "data_offsets": [0, 12] });
            }),
            "a: \"layers.0.weight\" has the shape [1, 6]; expected [1, 3]",
        ),
        (
            changed(&|h| h["layers.0.weight"]["dtype"] = json!("I32")),
            "a: \"layers.0.weight\" has numbers of type I32, which are not supported; save as F32 or F64",
        ),
        (
            number(2, f32::NAN),
            "a: number 2 of \"layers.0.weight\" (from 0, row by row) is NaN; all must be finite",
        ),
        (
            number(5, f32::INFINITY),
            "a: number 0 of \"layers.1.bias\" (from 0, row by row) is inf; all must be finite",
        ),
    ]);
    let begins = |text: &str, beginning: &str| assert!(text.starts_with(beginning), "{text}");
    begins(&changed(&|h| h["layers.0.weight"]["dtype"] = json!("F17")), "a: cannot understand the header: ");
    begins(
        &shaped("layers.0.weight", json!([1_u64 << 40, 1_u64 << 40])),
        "a: cannot understand the header: ",
    );
    begins(&bytes(&[1, 0, 0, 0, 0, 0, 0, 0, b'{']), "a: cannot understand the header: ");
}

/// Offsets that are consistent, but exceed the size of any file in sum.
#[test]
fn sizes_near_the_largest_are_refused() {
    let tensor = (1_u64 << 61) - 1;
    let mut header = header();
    for k in 0..8 {
        let offsets = [k * tensor, (k + 1) * tensor];
        header[format!("layers.{k}.weight")] =
            json!({ "dtype": "U8", "shape": [tensor], "data_offsets": offsets });
    }
    header.as_object_mut().unwrap().retain(|name, _| !name.ends_with("bias"));
    let text = message(parse_network(&whole(&header, &numbers()), here("a")));
    assert_eq!(text, "a: the tensors take 18446744073709551608 bytes, but the file has 24 for them");
    let empty = json!({
        "__metadata__": { "network": "sharpness=100 frequencies=0" },
        "layers.0.weight": { "dtype": "F32", "shape": [1_u64 << 60, 0], "data_offsets": [0, 0] },
        "layers.1.weight": { "dtype": "F32", "shape": [0, 1], "data_offsets": [0, 0] },
    });
    let text = message(parse_network(&whole(&empty, &[]), here("a")));
    assert_eq!(text, "a: network: width = 1152921504606847000 is not 1 to 4096");
}
