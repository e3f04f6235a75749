// SPDX-License-Identifier: Apache-2.0
// What `dpde check` prints of its reports: in short or all of it, and once what tasks of a scene share.
#pragma once

#include <map>
#include <set>
#include <string>

#include "command.h"
#include "report/report.h"

namespace dpde::tools {

class CheckText {
 public:
  explicit CheckText(bool shows_all) : shows_all_(shows_all) {}

  /// A line and the indented lines after it belong together: they are left out where another task of this scene has
  /// the same. Details are left out too, with their number, unless all is shown.
  void tell(Job& job, const std::string& scene, const report::Report& report);

 private:
  bool shows_all_;
  std::map<std::string, std::set<std::string>> told_;  // by scene
};

}  // namespace dpde::tools
