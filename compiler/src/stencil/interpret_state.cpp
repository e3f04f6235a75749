// SPDX-License-Identifier: Apache-2.0
// The memory of the reference interpreter.
#include <limits>

#include "stencil/interpret.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

constexpr double garbage = std::numeric_limits<double>::signaling_NaN();

}  // namespace

void for_each_cell(const Cell& low, const Cell& high, const std::function<void(const Cell&)>& f) {
  for (int k = low[2]; k < high[2]; ++k) {
    for (int j = low[1]; j < high[1]; ++j) {
      for (int i = low[0]; i < high[0]; ++i) f({i, j, k});
    }
  }
}

std::size_t State::index(const Cell& cell) const {
  std::size_t index = 0;
  for (int axis = max_rank - 1; axis >= 0; --axis) {
    const int width = grid_.cells[axis] + 2 * halo(axis);
    const int place = cell[axis] + halo(axis);
    require(place >= 0 && place < width, "a cell inside the halo");
    index = index * width + place;
  }
  return index;
}

double& State::at(const std::string& field, Cell cell) {
  auto found = fields_.find(field);
  if (found == fields_.end()) {
    poison(field);
    found = fields_.find(field);
  }
  return found->second[index(cell)];
}

double State::at(const std::string& field, Cell cell) const {
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
  require(interior.size() == get(field).size(), "one value a cell");
  auto next = interior.begin();
  std::vector<double>& cells = fields_.at(field);
  for_each_cell({}, grid_.cells, [&](const Cell& cell) { cells[index(cell)] = stored(*next++); });
}

std::vector<double> State::get(const std::string& field) const {
  std::vector<double> values;
  for_each_cell({}, grid_.cells, [&](const Cell& cell) { values.push_back(at(field, cell)); });
  return values;
}

void State::set_coordinate(int axis, Topology topology, double low, double spacing) {
  Cell first{}, last = grid_.cells;
  for (int a = 0; a < max_rank; ++a) {
    first[a] -= halo(a);
    last[a] += halo(a);
  }
  const std::string name(1, "xyz"[axis]);
  for_each_cell(first, last, [&](const Cell& cell) {
    const int n = grid_.cells[axis];
    const int i = topology == Topology::periodic ? (cell[axis] % n + n) % n : cell[axis];
    at(name, cell) = stored(low + (i + 0.5) * spacing);
  });
}

}  // namespace dpde::stencil
