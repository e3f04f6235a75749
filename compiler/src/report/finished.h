// SPDX-License-Identifier: Apache-2.0
// A report that is kept in the NetCDF file it is of, so that a job which is done is not done again.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "dpde/runtime/netcdf.h"
#include "report/report.h"

namespace dpde::report {

/// Marks the content as the result of the job with this key, with what is reported of it, in which there is nothing
/// that is another number the next time.
void add_report(NetcdfContent& content, std::uint64_t key, const Report& report);
/// That report, where the file has such a mark; nothing where it is damaged or not there.
std::optional<Report> report_of_finished(const std::filesystem::path& file, std::uint64_t key);

}  // namespace dpde::report
