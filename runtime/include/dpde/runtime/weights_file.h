// SPDX-License-Identifier: Apache-2.0
// Named arrays in files: weights of networks, in and out. Two formats, told apart by the ending of the name:
//  - .safetensors: arrays of F32 and F64; others may be there (counters, masks) and have no values here;
//  - .npz (NumPy): arrays as in npy.h. Entries are written uncompressed and read so: numpy.savez, not savez_compressed.
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
  std::string other_type = {};  // of numbers that are not read, as the file calls it
};

/// The arrays in the order of the file.
/// @throws Error(input) naming the file and what is wrong with it (never allocates more than the file holds).
std::vector<NamedArray> read_weights(const std::filesystem::path& path);
/// The same from bytes in memory; `name` stands for the file in messages and tells the format.
std::vector<NamedArray> parse_weights(std::string_view bytes, const std::string& name);

/// Writes doubles, or floats where `is_single`, atomically (see atomic_file.h).
/// @throws Error(input) for another ending of the name and for shapes that do not fit, Error(machine) when the file
/// cannot be written.
void write_weights(const std::filesystem::path& path, std::span<const NamedArray> arrays, bool is_single = false);

/// The weights of a network as arrays called <network>.v<layer>.weight, shape (channels, channels in / groups, then
/// `extent` an axis), and <network>.v<layer>.bias, shape (channels). Layers count from 1, as `dpde emit` prints them.
/// Of a network that the host computes, one array <network>.weights.
std::vector<NamedArray> arrays_of(const dpde_network& network, std::span<const double> weights);

/// The other way: every array of the network must be among `arrays`, with its shape and finite values; others of
/// another network may be there, and such as are not read. `file` stands for where they come from in messages. Where
/// the arrays have one other prefix throughout (weights of a network that was called otherwise), that is taken. So are
/// arrays that are called <number>.weight and <number>.bias, as PyTorch calls those of a Sequential: the layers in
/// their order.
/// @throws Error(input) that names the first array that does not fit, what is wanted and what is there.
std::vector<double> weights_of(const dpde_network& network, std::span<const NamedArray> arrays,
                               const std::string& file);

}  // namespace dpde
