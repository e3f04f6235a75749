// SPDX-License-Identifier: Apache-2.0
// Finds the matrix rows of a linear operator, given as a list of operations, by applying it to unit vectors. For
// constant rows one suffices. Otherwise cells of which no row reads two share one vector (colours: Curtis, Powell and
// Reid 1974; fewer for a stencil with few entries: solve/matrix/pattern_colours.h). The result is compared in each cell
// with the operator applied to arbitrary values.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "solve/matrix/pattern_colours.h"
#include "solve/matrix/stencil_matrix.h"
#include "solve/operator/box_probe.h"
#include "solve/operator/grid_operator.h"
#include "solve/rows/row_sums.h"

namespace dpde {

/// Work memory.
struct ProbeRoom {
  std::span<double> values, image;
};

/// For one operator, whose coefficients may change between probes.
class OperatorProbe {
 public:
  OperatorProbe() = default;
  /// `reach`: stencil radius; -1: the whole axis. `rounding`: relative error of values. `what`: its name in messages.
  /// `known`: properties that hold for all coefficients.
  OperatorProbe(const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic,
                const std::array<std::int64_t, 3>& reach, double rounding, std::string what,
                const OperatorKnowledge& known = {});

  /// Its rows. `used`: an operator whose memory is reused. `room`: two numbers a cell, or empty. With both, on more
  /// than 64 cells, nothing is allocated beyond the memory of the previous probe.
  /// \throws dpde::Error if the operator is not linear or its stencil is wider than `reach`.
  GridOperator find(const LinearImage& image, GridOperator used = {}, const ProbeRoom& room = {});
  /// A row for each cell, whether they are constant or not.
  StencilMatrix matrix(const LinearImage& image, StencilMatrix used = {});
  /// Number of applications of the operator in the last probe.
  int images() const { return images_; }

 private:
  struct Departure {
    double difference = 0, entry = 0;  // entry: the largest coefficient
    double allowed = 0;
  };

  const ConstantRows* constant_rows(const LinearImage& image);
  std::optional<std::array<Sides, 3>> find_sides(const LinearImage& image, const ConstantRows& row);
  bool is_made_by(const ConstantRows& rows, const LinearImage& image);
  std::optional<double> sum_of(const ConstantRows& rows, const LinearImage& image);
  bool have_one_moment(const ConstantRows& rows, double sum, const LinearImage& image);
  LinearImage counted(const LinearImage& image);
  std::span<const double> sums_of(const StencilMatrix& matrix, const LinearImage& image);
  StencilMatrix found(const LinearImage& image, StencilMatrix used);
  const std::array<AxisColours, 3>& colours();
  bool is_by_pattern(const LinearImage& image, StencilMatrix& matrix);
  void check_zero(const LinearImage& image);
  Departure departure_of(const LinearImage& image, const StencilMatrix& matrix);
  void take_memory(const ProbeRoom& room);
  void drop_memory();
  void make(const LinearImage& image);
  std::size_t cell_count() const { return static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]); }

  std::array<std::int64_t, 3> cells_{}, reach_{};
  std::array<bool, 3> periodic_{};
  double rounding_ = 0;
  std::string what_;
  OperatorKnowledge known_;
  std::optional<std::array<AxisColours, 3>> colours_;
  struct Pattern {
    std::vector<std::array<int, 3>> offsets,
        known;  // some offsets found in the last probe; those for which colours were computed
    std::optional<PatternColours> colours;
  } pattern_;
  ConstantRows candidate_;
  DoubtfulSums doubtful_;
  NullSpaceMemory of_null_space_;
  std::vector<double> own_;  // values and their image if no room is given
  std::span<double> values_, image_;
  int images_ = 0;
};

}  // namespace dpde
