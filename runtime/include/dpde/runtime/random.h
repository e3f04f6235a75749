// SPDX-License-Identifier: Apache-2.0
// White noise: independent standard normal numbers. Each is a function of a seed and a cell only, so the values do not
// depend on the order of evaluation or the number of threads.
//
// Philox4x32 with 10 rounds (Salmon, Moraes, Dror & Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011) of
// the counter (cell, stream) and the key `seed`, each of two words, low word first. Its four words w0 .. w3 give two
// numbers of 53 bits, a = floor((w1*2^32 + w0)/2^11) and b = floor((w3*2^32 + w2)/2^11). The result is by Box and
// Muller: sqrt(-2*log((a + 1)/2^53))*cos(2*pi*b/2^53).
#pragma once

#include <array>
#include <cstdint>

#include "dpde/runtime/field.h"

namespace dpde {

std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key);

double normal(std::uint64_t seed, std::uint64_t cell, std::uint64_t stream = 0);

/// Fills the interior; cells are numbered as in dense arrays of the whole grid, x fastest.
void fill_noise(const dpde_layout& layout, void* base, std::uint64_t seed, std::uint64_t stream = 0);

}  // namespace dpde
