// SPDX-License-Identifier: Apache-2.0
#include "driver/data_set_cost.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <sstream>

#include "driver/files.h"

namespace dpde::driver {

std::string cost_file_of(const std::string& data_set) { return data_set + ".cost"; }

std::string cost_text(std::uint64_t hash, double seconds) { return fmt::format("data {:016x}\ncpu_s {}\n", hash, seconds); }

double stored_cost(const std::string& data_set, std::uint64_t hash) {
  std::error_code error;
  if (!std::filesystem::exists(cost_file_of(data_set), error)) return std::nan("");
  DiagnosticSink silent;
  std::istringstream text(read_file(cost_file_of(data_set), {}, silent).value_or(""));
  std::string data, its_hash, cpu;
  double seconds = 0;
  text >> data >> its_hash >> cpu >> seconds;
  const bool is_of_it = text && data == "data" && cpu == "cpu_s" && its_hash == fmt::format("{:016x}", hash);
  return is_of_it && seconds >= 0 ? seconds : std::nan("");
}

}  // namespace dpde::driver
