// SPDX-License-Identifier: Apache-2.0
#include "training/data/data_run_file.h"

#include <fmt/format.h>

#include <string>
#include <system_error>
#include <utility>

#include "dpde/runtime/bytes.h"
#include "driver/report/restart_file.h"
#include "files/files.h"

namespace dpde::training {

namespace {

bool read_grid(ByteReader& in, GridFrames& grid) {
  for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) grid.frames.push_back(in.values());
  for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) {
    const std::vector<double> residual = in.values();
    if (residual.size() != 2) return false;
    grid.residuals.push_back({residual[0], residual[1]});
  }
  return true;
}

}  // namespace

DataRunFile::DataRunFile(const std::filesystem::path& folder, const DataSetMaker& maker, int run)
    : path_(folder / fmt::format("{}.{}", maker.set().grids[0].file, run)),
      key_(static_cast<std::int64_t>(maker.key())) {}

bool DataRunFile::save(const DataRun& data, DiagnosticSink& sink) const {
  ByteWriter out;
  out.number(key_);
  out.values(data.params);
  out.number(static_cast<std::int64_t>(data.integrals.size()));
  for (const analysis::Integrals& integrals : data.integrals) {
    out.values(integrals.values);
    out.values({integrals.magnitude});
  }
  out.number(static_cast<std::int64_t>(data.grids.size()));
  for (const GridFrames& grid : data.grids) {
    out.number(static_cast<std::int64_t>(grid.frames.size()));
    for (const std::vector<double>& frames : grid.frames) out.values(frames);
    out.number(static_cast<std::int64_t>(grid.residuals.size()));
    for (const analysis::Residual& residual : grid.residuals) out.values({residual.rate, residual.relative});
  }
  out.values({data.cpu_seconds});
  return files::write_file(path_, driver::sealed(out.bytes()), sink);
}

std::optional<DataRun> DataRunFile::load() const {
  DiagnosticSink silent;
  std::error_code error;
  if (!std::filesystem::exists(path_, error)) return std::nullopt;
  const std::optional<std::string> bytes = files::read_file(path_, {}, silent);
  const std::optional<std::string_view> content = bytes ? driver::unsealed(*bytes) : std::nullopt;
  if (!content) return std::nullopt;
  ByteReader in(*content);
  if (in.number() != key_) return std::nullopt;
  DataRun data;
  data.params = in.values();
  for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) {
    analysis::Integrals integrals{in.values(), 0};
    const std::vector<double> magnitude = in.values();
    if (magnitude.size() != 1) return std::nullopt;
    integrals.magnitude = magnitude[0];
    data.integrals.push_back(std::move(integrals));
  }
  for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) {
    if (!read_grid(in, data.grids.emplace_back())) return std::nullopt;
  }
  const std::vector<double> seconds = in.values();
  if (seconds.size() != 1) return std::nullopt;
  data.cpu_seconds = seconds[0];
  return in.is_done() ? std::optional(std::move(data)) : std::nullopt;
}

void DataRunFile::remove() const {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

}  // namespace dpde::training
