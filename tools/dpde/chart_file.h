// SPDX-License-Identifier: Apache-2.0
// The points of a chart in a file from which another call goes on.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "chart/point.h"
#include "command.h"

namespace dpde::tools {

Json point_json(const chart::Point& point);

/// The points that were run, CHART_points.json in the folder of --out: written anew after each.
class ChartFile {
 public:
  /// False and a diagnostic where a file that is to be resumed cannot be read.
  bool open(const std::string& folder, const std::string& chart, bool resume, DiagnosticSink& sink);
  /// Of the text with what it imports, the command's options, the entry and the reference.
  static std::string key_of(const Job& job, const chart::Entry& entry, const std::string& reference);
  /// The point of an entry that was run before.
  std::optional<chart::Point> find(const std::string& key, const chart::Entry& entry) const;
  void add(const std::string& key, const chart::Point& point);
  bool save(DiagnosticSink& sink) const;

 private:
  std::filesystem::path path_;
  std::map<std::string, Json> known_;
};

}  // namespace dpde::tools
