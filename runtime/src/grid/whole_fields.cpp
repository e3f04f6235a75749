// SPDX-License-Identifier: Apache-2.0
#include "grid/whole_fields.h"

#include <algorithm>
#include <span>

#include "dpde/runtime/field.h"
#include "dpde/runtime/layout.h"
#include "grid/real.h"

namespace dpde {

WholeFields::WholeFields(const dpde_layout& subgrid, Communicator& ranks, std::size_t count)
    : subgrid_(&subgrid), ranks_(&ranks) {
  const auto rank = static_cast<std::size_t>(subgrid.rank);
  layout_ = make_layout(std::span(subgrid.global).first(rank), {subgrid.halo[0], subgrid.halo[1], subgrid.halo[2]},
                        subgrid.real);
  pool_ = FieldPool(layout_, static_cast<int64_t>(count));
  std::size_t all = 1;
  for (std::size_t a = 0; a < rank; ++a) all *= static_cast<std::size_t>(layout_.cells[a] + 2 * layout_.halo[a]);
  values_.resize(all);
}

/// Calls f(element in the subgrid, index among the values, cells) for each row of the cells that no other rank has.
template <class F>
void WholeFields::for_each_own_row(const F& f) {
  int64_t from[3], to[3];
  for (std::size_t a = 0; a < 3; ++a) {
    from[a] = has_low_seam(*subgrid_, a) ? 0 : -subgrid_->halo[a];
    to[a] = subgrid_->cells[a] + (has_high_seam(*subgrid_, a) ? 0 : subgrid_->halo[a]);
  }
  const auto place = [&](std::size_t a, int64_t cell) { return cell + subgrid_->first[a] + subgrid_->halo[a]; };
  const auto size = [&](std::size_t a) { return layout_.cells[a] + 2 * layout_.halo[a]; };
  for (int64_t z = from[2]; z < to[2]; ++z) {
    for (int64_t y = from[1]; y < to[1]; ++y) {
      f(index_of(*subgrid_, from[0], y, z), (place(2, z) * size(1) + place(1, y)) * size(0) + place(0, from[0]),
        to[0] - from[0]);
    }
  }
}

void WholeFields::gather(const void* field, std::size_t number) {
  with_real(layout_.real, [&](auto real) {
    using Real = decltype(real);
    std::ranges::fill(values_, 0.0);
    for_each_own_row([&](int64_t element, int64_t place, int64_t cells) {
      std::copy_n(static_cast<const Real*>(field) + element, cells, values_.begin() + place);
    });
    ranks_->sum(values_);
    Real* to = static_cast<Real*>(base(number));
    auto next = values_.cbegin();
    for (int64_t z = -layout_.halo[2]; z < layout_.cells[2] + layout_.halo[2]; ++z) {
      for (int64_t y = -layout_.halo[1]; y < layout_.cells[1] + layout_.halo[1]; ++y) {
        const int64_t cells = layout_.cells[0] + 2 * layout_.halo[0];
        std::transform(next, next + cells, to + index_of(layout_, -layout_.halo[0], y, z),
                       [](double value) { return static_cast<Real>(value); });
        next += cells;
      }
    }
  });
}

void WholeFields::clear(std::size_t number) { fill_all(layout_, base(number), 0.0); }

void WholeFields::add(std::size_t number, void* field) {
  with_real(layout_.real, [&](auto real) {
    using Real = decltype(real);
    const Real* from = static_cast<const Real*>(base(number));
    auto next = values_.begin();
    for (int64_t z = -layout_.halo[2]; z < layout_.cells[2] + layout_.halo[2]; ++z) {
      for (int64_t y = -layout_.halo[1]; y < layout_.cells[1] + layout_.halo[1]; ++y)
        next =
            std::copy_n(from + index_of(layout_, -layout_.halo[0], y, z), layout_.cells[0] + 2 * layout_.halo[0], next);
    }
    ranks_->sum(values_);
    for_each_own_row([&](int64_t element, int64_t place, int64_t cells) {
      Real* const row = static_cast<Real*>(field) + element;
      for (int64_t x = 0; x < cells; ++x) row[x] += static_cast<Real>(values_[static_cast<std::size_t>(place + x)]);
    });
  });
}

}  // namespace dpde
