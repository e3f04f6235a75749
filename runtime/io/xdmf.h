// SPDX-License-Identifier: Apache-2.0
// Describes a NetCDF file on three axes for ParaView and VisIt, which read the values from it.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace dpde {

/// Fields at cell centres that are recorded at the same times.
struct XdmfSeries {
  std::vector<double> times;
  std::vector<std::string> fields;  // names in the file
};

/// `faces`: of the cells along x, y, z; one more than cells.
std::string xdmf_text(const std::string& file, const std::array<std::vector<double>, 3>& faces, bool is_single,
                      const std::vector<XdmfSeries>& all);

}  // namespace dpde
