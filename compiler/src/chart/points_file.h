// SPDX-License-Identifier: Apache-2.0
// The points of a chart in a file from which another call goes on.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "chart/point.h"
#include "source/diagnostic.h"
#include "support/json.h"

namespace dpde::chart {

Json point_json(const Point& point);

/// The points that were run, CHART_points.json in the folder of --out: written anew after each.
class PointsFile {
 public:
  /// False and a diagnostic where a file that is to be resumed cannot be read.
  bool open(const std::string& folder, const std::string& chart, bool resume, DiagnosticSink& sink);
  /// `run` says what all points have in common: the text with what it imports, settings, the reference.
  static std::string key_of(const std::string& run, const Entry& entry);
  /// The point of an entry that was run before.
  std::optional<Point> find(const std::string& key, const Entry& entry) const;
  void add(const std::string& key, const Point& point);
  bool save(DiagnosticSink& sink) const;

 private:
  std::filesystem::path path_;
  std::map<std::string, Json> known_;
};

}  // namespace dpde::chart
