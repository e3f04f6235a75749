// SPDX-License-Identifier: Apache-2.0
// Named arrays in files: weights of networks. The file name's ending gives the format:
// - .safetensors: arrays of F32 and F64; other types may be present (counters, masks) and are not read;
// - .npz (NumPy): arrays as in npy.h. Entries are uncompressed: numpy.savez, not savez_compressed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/network_abi.h"

namespace dpde {

struct NamedArray {
  std::string name;
  std::vector<int64_t> shape;  // C order, the last axis is the fastest
  std::vector<double> values;
  std::string other_type = {};  // type name of an array that is not read
};

/// The arrays in the order of the file.
/// @throws Error(input) with the file and its fault (never allocates more than the file holds).
std::vector<NamedArray> read_weights(const std::filesystem::path& path);
/// The same for bytes in memory; `name` stands for the file in messages and gives the format.
std::vector<NamedArray> parse_weights(std::string_view bytes, const std::string& name);

/// Writes doubles, or floats if `is_single`, atomically (see atomic_file.h).
/// @throws Error(input) for another ending of the name and for wrong shapes, Error(machine) if the file cannot be
/// written.
void write_weights(const std::filesystem::path& path, std::span<const NamedArray> arrays, bool is_single = false);

/// The weights of a network as arrays <network>.v<layer>.weight of shape (channels, channels in / groups, then `extent`
/// for each axis), and <network>.v<layer>.bias of shape (channels). Layers count from 1, as printed by `dpde emit`. For
/// a network that the host computes: one array <network>.weights.
std::vector<NamedArray> arrays_of(const dpde_network& network, std::span<const double> weights);

/// The inverse: every array of the network must be among `arrays`, with its shape and finite values; other arrays are
/// ignored. `file` names their source in messages. Two other namings are accepted: one different prefix throughout (a
/// network that had another name), and <number>.weight, <number>.bias as in a PyTorch Sequential, the layers in order.
/// @throws Error(input) with the first array that does not fit, its expected and its actual shape.
std::vector<double> weights_of(const dpde_network& network, std::span<const NamedArray> arrays,
                               const std::string& file);

}  // namespace dpde
