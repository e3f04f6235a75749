// SPDX-License-Identifier: Apache-2.0
#include "solve/operator/coupled_matrix.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>

#include "solve/fourier/grid_place.h"

namespace dpde {

namespace {

constexpr double most_band_work = 3e8;  // for factorisation; above, iterations
constexpr int most_coupled_iterations = 400;
}  // namespace

CoupledMatrix::CoupledMatrix(const CoupledShape& shape, Method method, double tolerance)
    : unknowns_(shape.unknowns),
      cells_(shape.cells[0] * shape.cells[1] * shape.cells[2]),
      colours_(cell_colours(shape.cells, shape.periodic, shape.reach)) {
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
    iterations_->resize(static_cast<std::size_t>(size), IterationMethod::bicgstab);
  }
  for (auto* values : {&unit_, &image_, &right_, &solution_}) values->assign(static_cast<std::size_t>(size), 0.0);
}

/// Numbers cells along periodic axes as 0, n-1, 1, n-2, ..., so that neighbours across the end are near, too.
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
  for (const CellColour& colour : colours_) {
    for (std::size_t cell = 0; cell < colour.sources.size(); ++cell) {
      if (colour.sources[cell] < 0) continue;
      most = std::max(most, std::abs(numbers_[cell] - numbers_[static_cast<std::size_t>(colour.sources[cell])]));
    }
  }
  return most * unknowns_ + unknowns_ - 1;
}

std::vector<std::vector<std::int64_t>> CoupledMatrix::columns_of_rows() {
  std::vector<std::vector<std::int64_t>> rows(static_cast<std::size_t>(cells_ * unknowns_));
  for (const CellColour& colour : colours_) {
    for (std::int64_t cell = 0; cell < cells_; ++cell) {
      const std::int64_t column = colour.sources[static_cast<std::size_t>(cell)];
      for (int p = 0; column >= 0 && p < unknowns_; ++p) {
        for (int q = 0; q < unknowns_; ++q)
          rows[static_cast<std::size_t>(number(cell, p))].push_back(number(column, q));
      }
    }
  }
  for (std::vector<std::int64_t>& row : rows) {
    std::ranges::sort(row);
    entries_ += static_cast<std::int64_t>(row.capacity());
  }
  return rows;
}

std::int64_t CoupledMatrix::bytes() const {
  constexpr std::int64_t number = 8, vectors_of_bicgstab = 9;
  std::int64_t bytes = number * (cells_ + 4 * cells_ * unknowns_);
  for (const CellColour& colour : colours_)
    bytes += number * std::ssize(colour.sources) + number * std::ssize(colour.cells);
  if (band_) bytes += band_->bytes();
  if (sparse_) bytes += sparse_->bytes();
  if (rows_) bytes += rows_->bytes() + vectors_of_bicgstab * number * cells_ * unknowns_;
  return bytes;
}

std::int64_t CoupledMatrix::bytes_of_making() const {
  return entries_ == 0
             ? 0
             : 8 * entries_ + static_cast<std::int64_t>(sizeof(std::vector<std::int64_t>)) * cells_ * unknowns_;
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
    for (const CellColour& colour : colours_) {
      for (const std::int64_t cell : colour.cells) unit_[static_cast<std::size_t>(first + cell)] = 1;
      image(unit_, image_);
      for (const std::int64_t cell : colour.cells) unit_[static_cast<std::size_t>(first + cell)] = 0;
      for (std::int64_t cell = 0; cell < cells_; ++cell) {
        const std::int64_t column = colour.sources[static_cast<std::size_t>(cell)];
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
