// SPDX-License-Identifier: Apache-2.0
// A run of a data set on disk, beside the file that is made of all of them: what it is of, its numbers, then a
// checksum.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "source/diagnostic.h"
#include "training/data/data_set.h"

namespace dpde::training {

class DataRunFile {
 public:
  /// FILE.RUN in the folder, FILE that of the first grid.
  DataRunFile(const std::filesystem::path& folder, const DataSetMaker& maker, int run);

  bool save(const DataRun& data, DiagnosticSink& sink) const;
  /// nullopt where it is not there, damaged or of another data set.
  std::optional<DataRun> load() const;
  void remove() const;

 private:
  std::filesystem::path path_;
  std::int64_t key_;
};

}  // namespace dpde::training
