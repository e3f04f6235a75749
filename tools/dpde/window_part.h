// SPDX-License-Identifier: Apache-2.0
// Stores the controls found for a window on disk while others are still being optimised.
#pragma once

#include <filesystem>
#include <optional>

#include "training/window_controls.h"

namespace dpde::tools {

/// TASK.nc.RUN.FRAME next to TASK.nc: key, numbers, and a checksum of all before it. Written atomically.
class WindowPart {
 public:
  WindowPart(const std::filesystem::path& file, std::uint64_t key, const training::Window& window);

  /// Reports machine-failed and returns false on failure.
  bool save(const training::FoundControls& found, DiagnosticSink& sink) const;
  /// nullopt if the file does not exist, is damaged or belongs to another search.
  std::optional<training::FoundControls> load() const;
  void remove() const;

 private:
  std::filesystem::path path_;
  std::int64_t key_;
  training::Window window_;
};

}  // namespace dpde::tools
