// SPDX-License-Identifier: Apache-2.0
#include "run/reverse/adjoint_states.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "dpde/runtime/communicator.h"
#include "dpde/runtime/field.h"

namespace dpde {

void AdjointStates::allocate(RunMemory& memory, const std::vector<char>& over) {
  const auto count = static_cast<int64_t>(states_);
  pool_ = memory.pool(setup_.layout, std::ssize(buffers_) * count - std::ranges::count(over, char{1}));
  if (memory.is_plan()) return;
  int64_t next = 0;
  for (size_t b = 0; b < buffers_.size(); ++b) {
    for (size_t s = 0; s < states_; ++s)
      buffers_[b].push_back(b == 1 && over[s] != 0 ? buffers_[0][s] : pool_.base(next++));
  }
}

void AdjointStates::zero() const {
  for (size_t s = 0; s < states_; ++s) zero(s);
}

void AdjointStates::zero(size_t state) const { fill_all(setup_.layout, seeds()[state], 0.0); }

void AdjointStates::add_spare(size_t state) const {
  add_interior(setup_.layout, seeds()[state], {&setup_.layout, spare()[state]}, setup_.team);
}

/// Sums row by row with extended range: adjoints of chaotic runs grow without bounds, and squares overflow earlier.
double AdjointStates::norm() const {
  const dpde_layout& layout = setup_.layout;
  const auto cells = [&](int axis) { return axis < layout.rank ? layout.cells[axis] : 1; };
  long double sum = 0;
  for (const void* base : seeds()) {
    for (int64_t z = 0; z < cells(2); ++z) {
      for (int64_t y = 0; y < cells(1); ++y) {
        for (int64_t x = 0; x < cells(0); ++x) {
          const long double value = value_at(layout, base, {x, y, z});
          sum += value * value;
        }
      }
    }
  }
  const auto own = static_cast<double>(std::sqrt(sum));
  const double most = largest_of(setup_.ranks, own);
  if (setup_.ranks == nullptr || most == 0) return own;
  double part = own / most * (own / most);
  setup_.ranks->sum({&part, 1});
  return most * std::sqrt(part);
}

}  // namespace dpde
