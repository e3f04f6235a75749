// SPDX-License-Identifier: Apache-2.0
// Log of evaluations of an objective on disk, in order. Optimisers are deterministic, so a killed run that reads its
// evaluations back continues exactly where it was, for any method and any state of its line search.
//
// Format: "dpdelog1", key, unknowns (8 bytes each), then records of loss, gradient, checksum. The log ends at the first
// truncated or damaged record; later ones are overwritten.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "source/diagnostic.h"

namespace dpde::files {

class EvaluationLog {
 public:
  /// `key`: hash of everything the evaluations depend on. With `resume`, records of a log with the same key and size
  /// are kept, and another log is an error; otherwise the log starts empty. Nothing is written before the first append.
  /// Check `is_open()`.
  EvaluationLog(const std::filesystem::path& path, std::uint64_t key, Eigen::Index unknowns, bool resume,
                DiagnosticSink& sink);
  ~EvaluationLog();
  EvaluationLog(const EvaluationLog&) = delete;
  EvaluationLog& operator=(const EvaluationLog&) = delete;

  bool is_open() const { return file_ >= 0; }
  /// Number of records at the start.
  std::int64_t recorded() const { return recorded_; }
  /// Reads the next record; returns false if there is none.
  bool next(double& loss, Eigen::VectorXd& gradient);
  /// @throws Error(machine) if it cannot be written.
  void append(double loss, const Eigen::VectorXd& gradient);

 private:
  bool read_record(std::int64_t index, double& loss, Eigen::VectorXd& gradient);
  std::int64_t record_bytes() const { return 8 * (unknowns_ + 2); }

  std::filesystem::path path_;
  Eigen::Index unknowns_;
  int file_ = -1;
  std::int64_t recorded_ = 0, position_ = 0;
  double last_sync_;
  std::vector<char> record_;
};

}  // namespace dpde::files
