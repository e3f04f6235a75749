// SPDX-License-Identifier: Apache-2.0
// Stores a report in the NetCDF file it belongs to, so that a finished job is not repeated.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "dpde/runtime/netcdf.h"
#include "report/report.h"

namespace dpde::report {

/// Marks the content as the result of the job with this key, and adds its report. The report must not contain numbers
/// that change between runs, such as times.
void add_report(NetcdfContent& content, std::uint64_t key, const Report& report);
/// The report in the file; nullopt if the file has no such mark, is damaged or does not exist.
std::optional<Report> report_of_finished(const std::filesystem::path& file, std::uint64_t key);

}  // namespace dpde::report
