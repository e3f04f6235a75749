// SPDX-License-Identifier: Apache-2.0
#include "solve/coupled_matrix.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "solve/axis_colours.h"
#include "solve/grid_place.h"

namespace dpde {

namespace {

constexpr double most_band_work = 3e8;  // of factors; beyond, iterations
constexpr int most_coupled_iterations = 400;
}  // namespace

CoupledMatrix::CoupledMatrix(const CoupledShape& shape, Method method, double tolerance)
    : unknowns_(shape.unknowns), cells_(shape.cells[0] * shape.cells[1] * shape.cells[2]) {
  find_columns(shape);
  number_cells(shape);
  const std::int64_t size = cells_ * unknowns_, width = widest();
  const double work = static_cast<double>(size) * static_cast<double>(width) * static_cast<double>(width);
  if (method != Method::bicgstab && work <= most_band_work) {
    band_.emplace(size, width);
  } else if (method == Method::direct) {
    sparse_ = std::make_unique<SparseFactors>(columns_of_rows());
  } else {
    rows_ = std::make_unique<IncompleteFactors>(columns_of_rows());
    iterations_.emplace([this](std::span<const double> x, std::span<double> made) { rows_->multiply(x, made); },
                        [this](std::span<const double> r, std::span<double> z) { rows_->precondition(r, z); },
                        tolerance, most_coupled_iterations);
    iterations_->resize(static_cast<std::size_t>(size));
  }
  for (auto* values : {&unit_, &image_, &right_, &solution_}) values->assign(static_cast<std::size_t>(size), 0.0);
}

/// Which cells have each colour, and which of them the image in each cell may look at.
void CoupledMatrix::find_columns(const CoupledShape& shape) {
  const std::array<AxisColours, 3> axes{AxisColours(shape.cells[0], shape.periodic[0], shape.reach[0]),
                                        AxisColours(shape.cells[1], shape.periodic[1], shape.reach[1]),
                                        AxisColours(shape.cells[2], shape.periodic[2], shape.reach[2])};
  for_each_cell({axes[0].count, axes[1].count, axes[2].count}, [&](std::size_t, const GridPlace& colour) {
    std::vector<std::int64_t>& columns = columns_.emplace_back();
    std::vector<std::int64_t>& own = of_colour_.emplace_back();
    for_each_cell(shape.cells, [&](std::size_t number, const GridPlace& cell) {
      GridPlace column = cell;
      bool has_colour = true, is_there = true;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        has_colour = has_colour && axes[axis].colour[static_cast<std::size_t>(cell[axis])] == colour[axis];
        const int offset = axes[axis].offset(cell[axis], colour[axis]);
        is_there = is_there && offset != AxisColours::none;
        if (!is_there) break;
        column[axis] += offset;
        if (shape.periodic[axis])
          column[axis] = ((column[axis] % shape.cells[axis]) + shape.cells[axis]) % shape.cells[axis];
      }
      columns.push_back(is_there ? static_cast<std::int64_t>(number_of(shape.cells, column)) : -1);
      if (has_colour) own.push_back(static_cast<std::int64_t>(number));
    });
  });
}

/// Along periodic axes 0, n-1, 1, n-2, ...: so neighbours around the end are near too.
void CoupledMatrix::number_cells(const CoupledShape& shape) {
  numbers_.resize(static_cast<std::size_t>(cells_));
  for_each_cell(shape.cells, [&](std::size_t number, const GridPlace& cell) {
    GridPlace place = cell;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t i = cell[axis], n = shape.cells[axis];
      if (shape.periodic[axis] && shape.reach[axis] != 0) place[axis] = i <= (n - 1) / 2 ? 2 * i : 2 * (n - 1 - i) + 1;
    }
    numbers_[number] = static_cast<std::int64_t>(number_of(shape.cells, place));
  });
}

std::int64_t CoupledMatrix::widest() const {
  std::int64_t most = 0;
  for (const std::vector<std::int64_t>& columns : columns_) {
    for (std::size_t cell = 0; cell < columns.size(); ++cell) {
      if (columns[cell] < 0) continue;
      most = std::max(most, std::abs(numbers_[cell] - numbers_[static_cast<std::size_t>(columns[cell])]));
    }
  }
  return most * unknowns_ + unknowns_ - 1;
}

std::vector<std::vector<std::int64_t>> CoupledMatrix::columns_of_rows() const {
  std::vector<std::vector<std::int64_t>> rows(static_cast<std::size_t>(cells_ * unknowns_));
  for (const std::vector<std::int64_t>& columns : columns_) {
    for (std::int64_t cell = 0; cell < cells_; ++cell) {
      const std::int64_t column = columns[static_cast<std::size_t>(cell)];
      for (int p = 0; column >= 0 && p < unknowns_; ++p) {
        for (int q = 0; q < unknowns_; ++q)
          rows[static_cast<std::size_t>(number(cell, p))].push_back(number(column, q));
      }
    }
  }
  for (std::vector<std::int64_t>& row : rows) std::ranges::sort(row);
  return rows;
}

void CoupledMatrix::set(std::int64_t row, std::int64_t column, double value) {
  if (band_) {
    band_->entry(row, column) = value;
  } else if (sparse_) {
    sparse_->set(row, column, value);
  } else {
    rows_->set(row, column, value);
  }
}

bool CoupledMatrix::make(const CoupledImage& image) {
  if (band_) {
    band_->set_zero();
  } else if (sparse_) {
    sparse_->set_zero();
  } else {
    rows_->set_zero();
  }
  for (int q = 0; q < unknowns_; ++q) {
    const std::int64_t first = q * cells_;
    for (std::size_t colour = 0; colour < columns_.size(); ++colour) {
      for (const std::int64_t cell : of_colour_[colour]) unit_[static_cast<std::size_t>(first + cell)] = 1;
      image(unit_, image_);
      for (const std::int64_t cell : of_colour_[colour]) unit_[static_cast<std::size_t>(first + cell)] = 0;
      for (std::int64_t cell = 0; cell < cells_; ++cell) {
        const std::int64_t column = columns_[colour][static_cast<std::size_t>(cell)];
        for (int p = 0; column >= 0 && p < unknowns_; ++p)
          set(number(cell, p), number(column, q), image_[static_cast<std::size_t>(p * cells_ + cell)]);
      }
    }
  }
  if (sparse_) return sparse_->factor();
  return band_ ? band_->factor() : rows_->factor();
}

bool CoupledMatrix::solve(std::span<const double> right, std::span<double> x) {
  const auto renumbered = [&](const auto& f) {
    for (int p = 0; p < unknowns_; ++p) {
      for (std::int64_t cell = 0; cell < cells_; ++cell)
        f(static_cast<std::size_t>(number(cell, p)), static_cast<std::size_t>(p * cells_ + cell));
    }
  };
  renumbered([&](std::size_t inside, std::size_t outside) { right_[inside] = right[outside]; });
  bool has_come = true;
  if (band_) {
    band_->solve(right_);
    std::ranges::copy(right_, solution_.begin());
  } else if (sparse_) {
    sparse_->solve(right_, solution_);
  } else {
    std::ranges::fill(solution_, 0.0);
    has_come = iterations_->bicgstab(right_, solution_).converged;
  }
  renumbered([&](std::size_t inside, std::size_t outside) { x[outside] = solution_[inside]; });
  return has_come && std::ranges::all_of(solution_, [](double value) { return std::isfinite(value); });
}

}  // namespace dpde
