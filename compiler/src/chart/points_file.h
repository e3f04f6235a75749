// SPDX-License-Identifier: Apache-2.0
// File with the points of a chart, from which a later call resumes.
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

/// Finished points, in CHART_points.json in the folder of --out; rewritten after each point.
class PointsFile {
 public:
  /// Returns false with a diagnostic if a file to be resumed cannot be read.
  bool open(const std::string& folder, const std::string& chart, bool resume, DiagnosticSink& sink);
  /// `run`: common properties of all points: the text with its imports, settings, the reference.
  static std::string key_of(const std::string& run, const Entry& entry);
  /// The earlier point of an entry.
  std::optional<Point> find(const std::string& key, const Entry& entry) const;
  void add(const std::string& key, const Point& point);
  bool save(DiagnosticSink& sink) const;

 private:
  std::filesystem::path path_;
  std::map<std::string, Json> known_;
};

}  // namespace dpde::chart
