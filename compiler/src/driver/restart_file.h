// SPDX-License-Identifier: Apache-2.0
// A run that stopped on its way, on disk: the state it had reached, and what it is a run of.
//
// File: "dpderst3", then texts and numbers with their lengths, then a checksum of all before it. Written atomically.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "driver/session.h"
#include "source/diagnostic.h"

namespace dpde::driver {

/// What has to be the same for a run to go on to the same end: by name ("grid", "step"), in the order of their weight.
using RunIdentity = std::vector<std::pair<std::string, std::string>>;
RunIdentity identity_of(Session& session);

struct Restart {
  RunIdentity identity;
  int step = 0;
  std::vector<std::vector<double>> states;  // dense, in the order of the rollout
  StepController controller;                // of steps under a tolerance
  std::string record;                       // the caller's own
};

/// Bytes put one after the other, and taken off again. Taking what is not there gives nothing and spoils the reader.
class ByteWriter {
 public:
  void number(std::int64_t value);
  void text(std::string_view value);
  void values(const std::vector<double>& values);
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}
  std::int64_t number();
  std::string text();
  std::vector<double> values();
  /// Everything was there, and nothing is left.
  bool is_done() const { return fine_ && rest_.empty(); }
  bool is_fine() const { return fine_; }

 private:
  std::string_view take(std::size_t count);

  std::string_view rest_;
  bool fine_ = true;
};

/// With a checksum behind it; and what is before it, nullopt where it does not fit: so files that a kill or a disk has
/// damaged are known.
std::string sealed(std::string content);
std::optional<std::string_view> unsealed(std::string_view bytes);

/// Reports machine-failed; false then.
bool save_restart(const std::filesystem::path& path, const Restart& restart, DiagnosticSink& sink);
/// Reports cannot-read, bad-array-file when it is damaged, and restart-differs when it is of another run.
std::optional<Restart> load_restart(const std::filesystem::path& path, const RunIdentity& identity,
                                    DiagnosticSink& sink);

}  // namespace dpde::driver
