// SPDX-License-Identifier: Apache-2.0
// The controls found for a window, on disk while the others are sought.
#pragma once

#include <filesystem>
#include <optional>

#include "training/window_controls.h"

namespace dpde::tools {

/// TASK.nc.RUN.FRAME beside TASK.nc: what it is of, its numbers, then a checksum of all before it. Written atomically.
class WindowPart {
 public:
  WindowPart(const std::filesystem::path& file, std::uint64_t key, const training::Window& window);

  /// Reports machine-failed; false then.
  bool save(const training::FoundControls& found, DiagnosticSink& sink) const;
  /// nullopt where it is not there, damaged or of another search.
  std::optional<training::FoundControls> load() const;
  void remove() const;

 private:
  std::filesystem::path path_;
  std::int64_t key_;
  training::Window window_;
};

}  // namespace dpde::tools
