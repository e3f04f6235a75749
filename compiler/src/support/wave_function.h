// SPDX-License-Identifier: Apache-2.0
// Functions of a polynomial of wave numbers, by which transforms multiply waves: those of exponential integrators, of
// spectral solves, and of filters (runtime/abi/dpde/wave_functions.h). As text: phi2(p), inverse1(p), heaviside0(p).
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace dpde {

struct WaveFunction {
  enum class Kind { none, phi, inverse, heaviside };  // none: 1
  Kind kind = Kind::none;
  int number = 0;

  explicit operator bool() const { return kind != Kind::none; }
  bool operator==(const WaveFunction&) const = default;
};

inline constexpr std::array<std::string_view, 4> wave_function_names{"", "phi", "inverse", "heaviside"};

constexpr std::string_view name_of(WaveFunction::Kind kind) {
  return wave_function_names[static_cast<std::size_t>(kind)];
}

}  // namespace dpde
