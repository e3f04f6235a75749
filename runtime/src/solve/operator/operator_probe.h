// SPDX-License-Identifier: Apache-2.0
// The rows of a linear operator that is a list of operations, by what it makes of unit vectors. Where the row is the
// same in all cells one of them is enough. Else those of many cells are taken at once that no row reads two of
// (colours: Curtis, Powell and Reid 1974; of a stencil with few entries fewer colours: solve/pattern_colours.h). What
// has been found is compared with what the operator makes of arbitrary values, in each cell.
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

/// Numbers to work in.
struct ProbeRoom {
  std::span<double> values, image;
};

/// Of one operator, whose coefficients may change from one probe to the next.
class OperatorProbe {
 public:
  OperatorProbe() = default;
  /// `reach`: how far from a cell its image looks, -1: anywhere. `rounding`: relative error of values. `what`: its name
  /// in messages. `known`: of the operator whatever its coefficients are.
  OperatorProbe(const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic,
                const std::array<std::int64_t, 3>& reach, double rounding, std::string what,
                const OperatorKnowledge& known = {});

  /// Its rows. `used`: an operator that is no longer needed, whose memory is taken. `room`: of two numbers a cell, or
  /// none. With both nothing is allocated that was not in what the probe before has found, on more than 64 cells.
  /// \throws dpde::Error where the operator is not linear or reaches farther.
  GridOperator find(const LinearImage& image, GridOperator used = {}, const ProbeRoom& room = {});
  /// A row for each cell, whether they are alike or not.
  StencilMatrix matrix(const LinearImage& image, StencilMatrix used = {});
  /// How often the last probe has run the operator.
  int images() const { return images_; }

 private:
  struct Departure {
    double difference = 0, entry = 0;  // and the largest coefficient
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
    std::vector<std::array<int, 3>> offsets, known;  // some of the last probe; those that colours were looked for of
    std::optional<PatternColours> colours;
  } pattern_;
  ConstantRows candidate_;
  DoubtfulSums doubtful_;
  NullSpaceMemory of_null_space_;
  std::vector<double> own_;  // values and their image where no room is given, while they are needed
  std::span<double> values_, image_;
  int images_ = 0;
};

}  // namespace dpde
