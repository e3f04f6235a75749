// SPDX-License-Identifier: Apache-2.0
// Cost of a data set, in a separate file NAME.nc.cost: it is a measurement, while the data are the same bytes whenever
// they are made.
#pragma once

#include <cstdint>
#include <string>

#include "source/diagnostic.h"

namespace dpde::files {

std::string cost_file_of(const std::string& data_set);
/// Text of the file: CPU seconds for the data set with this hash.
std::string cost_text(std::uint64_t hash, double seconds);
/// NaN if the file does not exist or belongs to other data. Reports bad-array-file if its text is invalid.
double stored_cost(const std::string& data_set, std::uint64_t hash, SourceRange where, DiagnosticSink& sink);

}  // namespace dpde::files
