//! Networks as safetensors: a JSON header with names, types, shapes and offsets, then the numbers,
//! little-endian.

use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

use flatland::sdf::Sdf;
use flatland::sdf::shapes::Parametric;
use safetensors::tensor::{Dtype, Metadata, TensorView};

use super::error::excerpt;
use super::memory::with_room;
use super::{Error, NetworkProblem, files};
use crate::sdf::network::{Architecture, Network};

/// Size of the header length field in bytes.
const LENGTH: usize = 8;

/// The metadata entry with the architecture that the weights do not determine.
const ENTRY: &str = "network";

/// Reads a network from a safetensors file.
///
/// Its tensors are named as PyTorch names those of a list `layers` of linear layers: `layers.K.weight` of
/// rows × columns (outputs × inputs) and `layers.K.bias` of rows, K = 0, 1, …, in F32 or F64. The tensors
/// determine the number and width of the layers. The entry `network` of the metadata gives the rest, such as
/// `sharpness=100 frequencies=6`, with `slope_bound=1.5` if a bound is to be
/// [stated](Network::with_slope_bound). In Python: `save_file(model.state_dict(), path, metadata={"network":
/// "sharpness=100 frequencies=6"})`. Other entries are not read.
///
/// # Errors
/// [`Error::File`] or [`Error::Network`]: also for tensors that do not belong to a network.
pub fn read_network(path: &Path) -> Result<Network, Error> {
    parse_network(&files::read(path)?, path)
}

/// [`read_network`] from memory. `path` is for messages.
///
/// # Errors
/// [`Error::Network`].
pub fn parse_network(bytes: &[u8], path: &Path) -> Result<Network, Error> {
    parse(bytes).map_err(|problem| Error::Network { path: path.to_path_buf(), problem })
}

/// Writes a network in the format of [`read_network`], in F64, atomically. The bytes are a deterministic
/// function of the network.
///
/// # Errors
/// [`Error::File`], or [`Error::Network`] if memory is insufficient.
pub fn write_network(path: &Path, network: &Network) -> Result<(), Error> {
    let bytes = encode(network).map_err(|problem| Error::Network { path: path.to_path_buf(), problem })?;
    files::write_bytes(path, &bytes)
}

fn encode(network: &Network) -> Result<Vec<u8>, NetworkProblem> {
    let (architecture, parameters) = (network.architecture(), network.parameters());
    let mut numbers = with_room(8 * parameters.len(), "the weights")?;
    parameters.iter().try_for_each(|p| numbers.write_all(&p.to_le_bytes())).ok();
    let mut tensors = vec![];
    for k in 0..architecture.layers() {
        let (rows, columns) = architecture.shape(k);
        let (weight, bias) = architecture.ranges(k);
        for (kind, shape, place) in [("weight", vec![rows, columns], weight), ("bias", vec![rows], bias)] {
            let data = &numbers[8 * place.start..8 * place.end];
            tensors.push((name(k, kind), TensorView::new(Dtype::F64, shape, data)?));
        }
    }
    let Architecture { sharpness, frequencies, .. } = architecture;
    let bound = network.slope_bound();
    // A single entry: the crate writes several in arbitrary order.
    let entry = format!("sharpness={sharpness} frequencies={frequencies} slope_bound={bound}");
    Ok(safetensors::serialize(tensors, Some(HashMap::from([(ENTRY.to_owned(), entry)])))?)
}

fn name(k: usize, kind: &str) -> String {
    format!("layers.{k}.{kind}")
}

fn parse(bytes: &[u8]) -> Result<Network, NetworkProblem> {
    let (header, data) = split(bytes)?;
    let header: Metadata = serde_json::from_slice(header)?;
    if header.data_len() != data.len() {
        return Err(NetworkProblem::Length { expected: header.data_len(), found: data.len() });
    }
    let entry = header.metadata().as_ref().and_then(|entries| entries.get(ENTRY));
    let stated = Stated::parse(entry.ok_or(NetworkProblem::NoArchitecture)?)?;
    let layers = layers(&header)?;
    let first = name(0, "weight");
    let width = header.info(&first).and_then(|info| info.shape.first().copied()).unwrap_or(0);
    let Stated { sharpness, frequencies, slope_bound } = stated;
    let architecture = Architecture { hidden: layers - 1, width, sharpness, frequencies };
    architecture.check()?;
    let mut parameters = with_room(data.len() / 4, "the weights")?;
    for k in 0..layers {
        let (rows, columns) = architecture.shape(k);
        for (kind, shape) in [("weight", vec![rows, columns]), ("bias", vec![rows])] {
            add_tensor(&header, data, name(k, kind), shape, &mut parameters)?;
        }
    }
    let network = Network::new(architecture, parameters)?;
    Ok(match slope_bound {
        Some(bound) => network.with_slope_bound(bound)?,
        None => network,
    })
}

/// Splits a file into the header and the numbers after it.
fn split(bytes: &[u8]) -> Result<(&[u8], &[u8]), NetworkProblem> {
    let truncated = |expected| NetworkProblem::Truncated { expected, found: bytes.len() };
    let (&length, rest) = bytes.split_first_chunk::<LENGTH>().ok_or(truncated(LENGTH as u128))?;
    let length = u64::from_le_bytes(length);
    let header = usize::try_from(length).ok().and_then(|length| rest.split_at_checked(length));
    header.ok_or(truncated(LENGTH as u128 + u128::from(length)))
}

/// The architecture in the metadata.
struct Stated {
    sharpness: f64,
    frequencies: usize,
    slope_bound: Option<f64>,
}

impl Stated {
    fn parse(text: &str) -> Result<Self, NetworkProblem> {
        let error = |expected, found: &str| NetworkProblem::Architecture { expected, found: excerpt(found) };
        let (mut sharpness, mut frequencies, mut slope_bound) = (None, None, None);
        for part in text.split_whitespace() {
            let (key, value) = part.split_once('=').ok_or(error("KEY=VALUE", part))?;
            let number = || value.parse::<f64>().map_err(|_| error("a number", part));
            let twice = match key {
                "sharpness" => sharpness.replace(number()?).is_some(),
                "slope_bound" => slope_bound.replace(number()?).is_some(),
                "frequencies" => {
                    let count = value.parse().map_err(|_| error("a whole number", part))?;
                    frequencies.replace(count).is_some()
                }
                _ => return Err(error("sharpness, frequencies or slope_bound", part)),
            };
            if twice {
                return Err(error("every number once", part));
            }
        }
        let sharpness = sharpness.ok_or(error("sharpness=…", text))?;
        Ok(Self { sharpness, frequencies: frequencies.ok_or(error("frequencies=…", text))?, slope_bound })
    }
}

/// The number of layers, at least 2; an error if a tensor is missing or unexpected.
fn layers(header: &Metadata) -> Result<usize, NetworkProblem> {
    let has = |k| ["weight", "bias"].iter().any(|kind| header.info(&name(k, kind)).is_some());
    let layers = (0..).take_while(|&k| has(k)).count();
    let missing = || NetworkProblem::Missing { tensor: name(layers, "weight") };
    if layers < 2 {
        return Err(missing());
    }
    for tensor in header.offset_keys() {
        let rest = tensor.strip_prefix("layers.").and_then(|rest| rest.split_once('.'));
        let layer = rest.and_then(|(k, kind)| Some((k.parse::<usize>().ok()?, kind)));
        match layer {
            Some((k, kind)) if matches!(kind, "weight" | "bias") && name(k, kind) == tensor => {
                if k >= layers {
                    return Err(missing());
                }
            }
            _ => return Err(NetworkProblem::Unexpected { tensor: excerpt(&tensor) }),
        }
    }
    Ok(layers)
}

/// Appends the numbers of a tensor after checking its shape.
fn add_tensor(
    header: &Metadata,
    data: &[u8],
    tensor: String,
    expected: Vec<usize>,
    parameters: &mut Vec<f64>,
) -> Result<(), NetworkProblem> {
    let Some(info) = header.info(&tensor) else { return Err(NetworkProblem::Missing { tensor }) };
    if info.shape != expected {
        return Err(NetworkProblem::Shape { tensor, expected, found: info.shape.clone() });
    }
    let (start, end) = info.data_offsets;
    // The header was checked to cover the data, each number once.
    let bytes = data.get(start..end).unwrap_or_default();
    let before = parameters.len();
    match info.dtype {
        Dtype::F32 => {
            let words = bytes.as_chunks::<4>().0;
            parameters.extend(words.iter().map(|&word| f64::from(f32::from_le_bytes(word))));
        }
        Dtype::F64 => {
            let words = bytes.as_chunks::<8>().0;
            parameters.extend(words.iter().map(|&word| f64::from_le_bytes(word)));
        }
        other => return Err(NetworkProblem::Type { tensor, found: other.to_string() }),
    }
    match parameters[before..].iter().enumerate().find(|(_, p)| !p.is_finite()) {
        Some((index, &value)) => Err(NetworkProblem::NotFinite { tensor, index, value }),
        None => Ok(()),
    }
}
