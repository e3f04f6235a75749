// SPDX-License-Identifier: Apache-2.0
// One run of a data set in its own temporary file, next to the final file: identification, numbers, checksum.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "source/diagnostic.h"
#include "training/data/data_set.h"

namespace dpde::training {

class DataRunFile {
 public:
  /// FILE.RUN in the folder, with FILE the name of the first grid's file.
  DataRunFile(const std::filesystem::path& folder, const DataSetMaker& maker, int run);

  bool save(const DataRun& data, DiagnosticSink& sink) const;
  /// nullopt if it does not exist, is damaged or belongs to another data set.
  std::optional<DataRun> load() const;
  void remove() const;

 private:
  std::filesystem::path path_;
  std::int64_t key_;
};

}  // namespace dpde::training
