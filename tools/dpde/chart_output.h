// SPDX-License-Identifier: Apache-2.0
// A chart as files, text and JSON, and its points in a file from which another call goes on.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "chart/point.h"
#include "command.h"

namespace dpde::tools {

/// The points that were run, SCENE_chart_points.json in the folder of --out: written anew after each.
class ChartFile {
 public:
  /// False and a diagnostic where a file that is to be resumed cannot be read.
  bool open(const std::string& folder, const std::string& scene, bool resume, DiagnosticSink& sink);
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

/// Table, picture, CSV and `result`.
void write_chart(Job& job, const model::Problem& problem, const std::vector<chart::Point>& points,
                 const chart::Reference& reference, int threads, Json& result);

}  // namespace dpde::tools
