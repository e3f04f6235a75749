// SPDX-License-Identifier: Apache-2.0
// The memory of the reference interpreter.
#include <limits>

#include "stencil/interpret/interpret.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

constexpr double garbage = std::numeric_limits<double>::signaling_NaN();

}  // namespace

std::vector<double>& State::cells_to_write(const std::string& field) {
  auto found = fields_.find(field);
  if (found == fields_.end()) {
    poison(field);
    found = fields_.find(field);
  }
  return found->second;
}

double& State::at(const std::string& field, CellIndex cell) { return cells_to_write(field)[index(cell)]; }

double State::at(const std::string& field, CellIndex cell) const {
  const std::vector<double>* cells = find_cells(field);
  return cells == nullptr ? garbage : (*cells)[index(cell)];
}

const std::vector<double>* State::find_cells(const std::string& field) const {
  const auto found = fields_.find(field);
  return found == fields_.end() ? nullptr : &found->second;
}

void State::poison(const std::string& field) {
  std::size_t size = 1;
  for (int axis = 0; axis < max_rank; ++axis) size *= grid_.cells[axis] + 2 * halo(axis);
  fields_[field].assign(size, garbage);
}

void State::set(const std::string& field, const std::vector<double>& interior) {
  poison(field);
  require(interior.size() == cell_count(), "one value a cell");
  auto next = interior.begin();
  std::vector<double>& cells = fields_.at(field);
  for_each_cell({}, grid_.cells, [&](const CellIndex& cell) { cells[index(cell)] = stored(*next++); });
}

std::vector<double> State::get(const std::string& field) const {
  const std::vector<double>* cells = find_cells(field);
  if (cells == nullptr) return std::vector<double>(cell_count(), garbage);
  std::vector<double> values;
  values.reserve(cell_count());
  for_each_cell({}, grid_.cells, [&](const CellIndex& cell) { values.push_back((*cells)[index(cell)]); });
  return values;
}

std::size_t State::cell_count() const {
  std::size_t count = 1;
  for (const int cells : grid_.cells) count *= static_cast<std::size_t>(cells);
  return count;
}

void State::set_coordinate(int axis, Topology topology, double low, double spacing) {
  CellIndex first{}, last = grid_.cells;
  for (int a = 0; a < max_rank; ++a) {
    first[a] -= halo(a);
    last[a] += halo(a);
  }
  std::vector<double>& cells = cells_to_write(std::string(1, "xyz"[axis]));
  for_each_cell(first, last, [&](const CellIndex& cell) {
    const int n = grid_.cells[axis];
    const int i = topology == Topology::periodic ? (cell[axis] % n + n) % n : cell[axis];
    cells[index(cell)] = stored(low + (i + 0.5) * spacing);
  });
}

}  // namespace dpde::stencil
