// SPDX-License-Identifier: Apache-2.0
// Common basis of the interfaces dpde.h for C++ and dpde_c.h for C.
#pragma once

#include <string>
#include <vector>

#include "dpde/dpde.h"
#include "source/source_file.h"

namespace dpde::host {

struct Opened {
  Simulation simulation;
  std::vector<std::string> seeds;  // with HostOptions::inputs: for each state the datum that is its seed
  std::vector<Message> warnings;
  std::string warnings_text;
};

/// @throws Error like compile_text().
Opened open(const SourceFile& file, const HostOptions& options);

SourceFile read(const std::string& path);

}  // namespace dpde::host
