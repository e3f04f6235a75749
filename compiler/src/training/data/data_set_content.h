// SPDX-License-Identifier: Apache-2.0
// A data set as NetCDF: the frames of its runs, what is known of their errors, and all that it takes to make it again.
#pragma once

#include <cstddef>
#include <vector>

#include "dpde/runtime/run_file.h"
#include "driver/report/run_description.h"
#include "training/data/data_set.h"

namespace dpde::training {

/// One file of a data set: the frames of its runs on one grid.
struct DataFile {
  DataSetMaker& maker;
  const std::vector<DataRun>& runs;
  std::size_t number;

  const model::DataSet::Grid& grid() const { return maker.set().grids[number]; }
  const GridFrames& of(const DataRun& run) const { return run.grids[number]; }
};

/// Of the block in the text `source`, by the command `origin`.
NetcdfContent content_of(const DataFile& file, const std::vector<OrderEstimate>& estimates, const SourceFile& source,
                         const driver::RunOrigin& origin);

}  // namespace dpde::training
