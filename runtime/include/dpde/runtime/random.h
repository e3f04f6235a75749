// SPDX-License-Identifier: Apache-2.0
// White noise: independent standard normal numbers, each a function of a seed and of where it stands, so that they are
// the same in any order and for any number of threads.
//
// Philox4x32 with 10 rounds (Salmon, Moraes, Dror & Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011) of
// the counter (cell, stream) and the key `seed`, each of two words, the low one first. Of its four words w0 .. w3 the
// first two and the last two make numbers a and b of 53 bits, (w1*2^32 + w0)/2^11 and (w3*2^32 + w2)/2^11 rounded down;
// the result is that of Box and Muller, sqrt(-2*log((a + 1)/2^53))*cos(2*pi*b/2^53).
#pragma once

#include <array>
#include <cstdint>

#include "dpde/runtime/field.h"

namespace dpde {

std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key);

double normal(std::uint64_t seed, std::uint64_t cell, std::uint64_t stream = 0);

/// The interior; cells are counted as in dense arrays of the whole grid, x fastest.
void fill_noise(const dpde_layout& layout, void* base, std::uint64_t seed, std::uint64_t stream = 0);

}  // namespace dpde
