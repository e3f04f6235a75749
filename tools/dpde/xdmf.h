// SPDX-License-Identifier: Apache-2.0
// A description of a NetCDF file on three axes for ParaView and VisIt, which takes the values from there.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::tools {

/// Fields at cell centres that are recorded at the same times.
struct XdmfSeries {
  std::vector<double> times;
  std::vector<std::string> fields;  // as the file calls them
};

std::string xdmf_text(const std::string& file, const std::vector<model::Axis>& axes, bool is_single,
                      const std::vector<XdmfSeries>& all);

}  // namespace dpde::tools
