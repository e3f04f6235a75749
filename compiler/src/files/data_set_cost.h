// SPDX-License-Identifier: Apache-2.0
// What a data set has cost, in a file NAME.nc.cost beside it: a measurement, and the data themselves are the same bytes
// whenever they are made.
#pragma once

#include <cstdint>
#include <string>

#include "source/diagnostic.h"

namespace dpde::files {

std::string cost_file_of(const std::string& data_set);
/// Its text: seconds that processors worked for the data set whose bytes have this hash.
std::string cost_text(std::uint64_t hash, double seconds);
/// Not a number where there is no such file, or it is of other data. Reports bad-array-file where it is no such text.
double stored_cost(const std::string& data_set, std::uint64_t hash, SourceRange where, DiagnosticSink& sink);

}  // namespace dpde::files
