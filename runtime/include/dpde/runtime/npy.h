// SPDX-License-Identifier: Apache-2.0
// NumPy's .npy files: reads and writes arrays of numbers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace dpde {

struct NpyArray {
  std::vector<int64_t> shape;  // as in the file, e.g. (nz, ny, nx); empty: one number
  std::vector<double> values;  // C order (last axis fastest), also if the file has Fortran order
};

/// Reads float64, float32, integers of 1 to 8 bytes and truth values (0 and 1), of either byte order, C and Fortran
/// order, format versions 1 to 3.
/// @throws Error(input) with the file and its fault (never allocates more than the file holds).
NpyArray read_npy(const std::filesystem::path& path);

/// The same for bytes in memory; `name` stands for the file in messages.
NpyArray parse_npy(std::span<const char> bytes, const std::string& name);

/// The bytes of a file of float64, or float32 if `is_single`: C order, version 1.0.
/// @throws Error(input) if shape and length disagree.
std::string compose_npy(std::span<const int64_t> shape, std::span<const double> values, bool is_single = false);

/// Writes float64, C order, version 1.0, atomically (see atomic_file.h).
/// @throws Error(input) if shape and length disagree, Error(machine) if the file cannot be written.
void write_npy(const std::filesystem::path& path, std::span<const int64_t> shape, std::span<const double> values);

/// The same for values in `count` parts; each is requested as it is written, so that one is in memory at a time.
void write_npy(const std::filesystem::path& path, std::span<const int64_t> shape, int64_t count,
               const std::function<std::vector<double>(int64_t)>& part);

}  // namespace dpde
