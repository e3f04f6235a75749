// SPDX-License-Identifier: Apache-2.0
// A data set as NetCDF: frames of its runs, error estimates, and all information needed to reproduce it.
#pragma once

#include <cstddef>
#include <vector>

#include "dpde/runtime/run_file.h"
#include "driver/report/run_description.h"
#include "training/data/data_set.h"

namespace dpde::training {

/// One file of a data set, with the frames of its runs on one grid.
struct DataFile {
  DataSetMaker& maker;
  const std::vector<DataRun>& runs;
  std::size_t number;

  const model::DataSet::Grid& grid() const { return maker.set().grids[number]; }
  const GridFrames& of(const DataRun& run) const { return run.grids[number]; }
};

/// Content for the block in the text `source`, made by the command `origin`.
NetcdfContent content_of(const DataFile& file, const std::vector<OrderEstimate>& estimates, const SourceFile& source,
                         const driver::RunOrigin& origin);

}  // namespace dpde::training
