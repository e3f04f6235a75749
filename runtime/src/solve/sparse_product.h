// SPDX-License-Identifier: Apache-2.0
// A sparse matrix times a vector, parts of its rows by the threads of a team: each row's sum is of one thread.
#pragma once

#include <Eigen/SparseCore>
#include <span>

#include "dpde/runtime/team.h"

namespace dpde {

/// y = rows*x
void multiply(const Eigen::SparseMatrix<double, Eigen::RowMajor>& rows, std::span<const double> x, std::span<double> y,
              const Team& team);

}  // namespace dpde
